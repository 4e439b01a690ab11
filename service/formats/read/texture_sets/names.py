"""Roles of images, and the materials they belong to, by the words of their file names.

The words are those that ambientCG, Poly Haven, Quixel, textures.com, FreePBR, 3dtextures and Poliigon use, and those
of Substance's exports for Unreal Engine, Unity and glTF.
"""

from __future__ import annotations

import re
from collections.abc import Container, Iterable, Sequence
from dataclasses import dataclass
from itertools import permutations, product
from typing import Literal

Role = Literal[
    "color", "roughness", "gloss", "metallic", "normal", "height", "opacity", "emission", "specular", "occlusion",
    "other",
]  # fmt: skip

WORDS: dict[Role, tuple[str, ...]] = {
    "color": ("color", "colour", "albedo", "basecolor", "basecolour", "basemap", "basecol", "diff", "diffuse", "col",
              "alb", "dif", "clr", "base"),
    "roughness": ("roughness", "rough", "rgh"),
    "gloss": ("gloss", "glossiness", "smoothness", "glossy"),
    "metallic": ("metalness", "metallic", "metal", "mtl", "metallicness", "metallness", "metallicity", "met"),
    "normal": ("normal", "normals", "nrm", "nor", "norm", "nml", "nrml", "nm"),
    "height": ("height", "heightmap", "displacement", "displace", "disp", "bump", "dis", "relief", "displ", "dsp",
               "hgt"),
    "opacity": ("opacity", "alpha", "mask", "transparency", "transparent", "cutout", "opac", "transp", "alp"),
    "emission": ("emission", "emissive", "emit", "emissivity", "glow", "emis", "emi", "selfillumination",
                 "selfillum"),
    "specular": ("specular", "spec", "specularlevel", "reflection", "refl", "specularity", "reflectance", "spc"),
    "occlusion": ("ao", "ambientocclusion", "occlusion", "occ", "mixedao", "occl"),
    "other": (
        "ior", "vectordisp", "vdm", "matid", "materialid", "cav",
        "cavity", "curvature", "translucency", "translucent", "transmission", "fuzz", "thickness", "sss",
        "scattering", "bentnormal", "bentnormals", "worldnormal", "worldspacenormal", "objectnormal",
        "objectspacenormal", "vectordisplacement", "detailmask", "detailnormal", "detailalbedo", "clearcoat",
        "clearcoatnormal", "clearcoatroughness", "coatnormal", "coatroughness", "subsurface", "subsurfacecolor",
        "sheencolor", "sheenroughness", "preview", "thumbnail", "thumb", "anisotropy", "idmap", "position",
    ),
}  # fmt: skip
# Unreal Engine's abbreviations, which stand last or before a size, where no word is.
LETTERS: dict[str, Role] = {
    "d": "color", "a": "color", "bc": "color", "c": "color", "n": "normal", "r": "roughness", "m": "metallic",
    "h": "height", "e": "emission", "s": "specular", "g": "gloss", "o": "opacity",
}  # fmt: skip
# Several maps in the channels of one image, by the initials of its name.
PACKED: dict[str, dict[Role, str]] = {
    "maskmap": {"metallic": "r", "occlusion": "g", "gloss": "a"},  # Unity's high definition pipeline
    "ordp": {"occlusion": "r", "roughness": "g", "height": "b"},  # Quixel's for Unreal Engine
}
INITIALS: dict[Role, tuple[str, ...]] = {"occlusion": ("o", "a", "ao"), "roughness": ("r",), "metallic": ("m",)}
# Words of two roles that are one name, and the channels.
PAIRS: tuple[tuple[Role, Role, dict[Role, str]], ...] = (
    ("metallic", "roughness", {"roughness": "g", "metallic": "b"}),  # glTF
    ("metallic", "gloss", {"metallic": "r", "gloss": "a"}),  # Unity
    ("specular", "gloss", {"specular": "", "gloss": "a"}),  # Unity
    ("color", "opacity", {"color": "", "opacity": "a"}),  # Unity
)
TRIPLED: tuple[Role, ...] = ("occlusion", "roughness", "metallic")  # words that together name a packed image
# Names of several words are known without what parts these: "Opacity Mask", "opacity-mask" and "OpacityMask" are one.
MOST_WORDS = 5
KINDS = ("map", "maps", "tex", "texture")  # these may follow any word
MASKED: tuple[Role, ...] = ("opacity", "emission", "roughness", "metallic", "specular")  # and "mask" those of these
TINTED: tuple[Role, ...] = ("color", "emission", "specular", "other")  # and a word for colour these
DOUBLED: tuple[Role, ...] = ("color", "opacity", "emission", "height", "occlusion")  # two words of one role are one
SUBJECTS = ("metal", "mtl", "met", "mask", "base")  # as likely what an image shows
SPACES = ("world", "object", "worldspace", "objectspace", "ws", "os")  # of normals that no normal map has
# How a file says which of two sets it belongs to, after its size.
WORKFLOW = re.compile(r"(?i)(?<=\dk)_(?:metalness|specular)$")
OPENGL, DIRECTX = ("gl", "ogl", "opengl"), ("dx", "directx")
# Words about the file, not about its subject: 2K, 4096, 1024x1024, 16bit, the formats, and levels of detail.
FILE_WORDS = re.compile(
    r"(?i)\d{1,2}k|128|256|512|1024|2048|4096|8192|16384|\d{3,5}x\d{3,5}|\d{1,2}bit|jpe?g|png|exr|tiff?|tga|webp|hdr|lod\d|seamless"
)
# Tiles: 1001 to 1100 as a part of the name, though 1024 without a dot before it is a size; u1_v1; or where a number
# is to be put in.
UDIM = re.compile(r"(?i)[._-]?(?:<udim>|%\(udim\)d)|[._ -]u(\d{1,2})[_-]?v(\d{1,2})(?![a-z0-9])|\.(1\d{3})$"
                  r"|[_ -](?!1024)(10\d\d|1100)$")  # fmt: skip
INNER_TILE = re.compile(r"[._ -](?!1024)(10\d\d|1100)(?=[._ -])")
FIRST_TILE = 1001
WORD = re.compile(r"[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+|\d+")


def _named() -> dict[str, tuple[dict[Role, str], bool | None]]:
    """The channels and, of normals, whether green points as in DirectX, by the name in one word."""
    found: dict[str, tuple[dict[Role, str], bool | None]] = {}
    for role, words in WORDS.items():
        likely = [word for word in words if word not in SUBJECTS]
        longer = [word + kind for word in words for kind in KINDS]
        longer += [word + "mask" for word in likely if role in MASKED]
        longer += [word + color for word in words if role in TINTED for color in ("color", "colour", "col")]
        longer += [one + other for one in likely for other in words if role in DOUBLED and one != other]
        found |= {name: ({role: ""}, None) for name in longer}
    for marks, directx in ((OPENGL, False), (DIRECTX, True)):
        for word in WORDS["normal"]:
            for normal in (word, *(word + kind for kind in KINDS)):
                found |= {
                    name: ({"normal": ""}, directx) for mark in marks for name in (normal + mark, mark + normal)
                }
    found |= {
        name: ({"other": ""}, None)
        for one in WORDS["normal"]
        for space in SPACES
        for name in (one + space, space + one)
    }
    found |= {word: ({role: ""}, None) for role, words in WORDS.items() for word in words}
    packed = {
        name + kind: channels
        for name, channels in (PACKED | _initials() | _pairs(False)).items()
        for kind in ("", *KINDS)
    }
    return found | {name: (channels, None) for name, channels in packed.items()}


def _initials() -> dict[str, dict[Role, str]]:
    """Channels by the initials of occlusion, roughness and metallic, in any order."""
    return {
        "".join(letters): dict(zip(roles, "rgb", strict=True))
        for roles in permutations(INITIALS)
        for letters in product(*(INITIALS[role] for role in roles))
    }


def _pairs(with_subjects: bool) -> dict[str, dict[Role, str]]:
    """Channels by names of two words: those whose first word may be what the image shows, or all others."""
    return {
        one + other: channels
        for first, second, channels in PAIRS
        for one in WORDS[first]
        for other in WORDS[second]
        if (one in SUBJECTS) == with_subjects and other not in SUBJECTS
    }


NAMES = _named()
SINGLE = {name for name, (channels, _) in NAMES.items() if len(channels) == 1}
DOUBTFUL = _pairs(True)


@dataclass(frozen=True)
class Meaning:
    """The role of an image. `channels`: for each role the channel that has it, or "" for the whole image."""

    material: str  # what is left of the name; "" where nothing is
    channels: dict[Role, str]
    directx: bool | None = None  # of normals: which way green points; None where the name does not say
    tile: int | None = None  # of several (UDIM), 1001 and on; 0 where its number is to be put in
    # Another reading, which takes the word before for one of the role as well: `Helmet_metalRoughness` is of the
    # Helmet, but `Rusty_Metal_Roughness` of the Rusty_Metal.
    other: Meaning | None = None

    @property
    def packed(self) -> bool:
        return len(self.channels) > 1


def meaning(stem: str, tiled: Container[str] = ()) -> Meaning | None:
    """The role of the image with this file name, without its ending; None where no word says. The last word that says
    it decides. Numbers within the names `tiled` are those of tiles."""
    shorter = WORKFLOW.sub("", stem)
    if shorter != stem and (found := meaning(shorter, {shorter} if stem in tiled else ())) is not None:
        return found
    tile, rest = _tile(stem, stem in tiled)
    places = [(found.start(), found.end(), found[0].lower()) for found in WORD.finditer(rest)]
    words = [text for _, _, text in places]
    decides = _last(words)
    if decides is None:
        return None
    first, last, channels, directx = decides

    def material(first: int) -> str:
        return _subject(rest[: places[first][0]]) or _subject(rest[places[last][1] :])

    other = None
    if first and (before := _ending(words, first - 1, SINGLE)) is not None:
        packed = DOUBTFUL.get("".join(words[before : last + 1]))
        other = Meaning(material(before), packed or channels, directx, tile)
    return Meaning(material(first), channels, directx, tile, other)


def tiles_within(stems: Iterable[str]) -> set[str]:
    """Those of the names that have the number of a tile within, as one of them with the first tile's shows."""
    parts = {stem: INNER_TILE.sub(".", stem) for stem in stems if INNER_TILE.search(stem)}
    first = {part for stem, part in parts.items() if str(FIRST_TILE) in stem}
    return {stem for stem, part in parts.items() if part in first}


def _tile(stem: str, inner: bool) -> tuple[int | None, str]:
    """The number of its tile, and the name without it."""
    found = UDIM.search(stem) or (INNER_TILE.search(stem) if inner else None)
    if found is None:
        return None, stem
    given = [int(group) for group in found.groups() if group is not None]
    if len(given) == 2:  # counted from 1, or from 0 as `u0_v0` shows
        base = min(1, *given)
        given = [FIRST_TILE + given[0] - base + 10 * (given[1] - base)]
    return (given[0] if given else 0), f"{stem[: found.start()]} {stem[found.end() :]}"


def _last(words: Sequence[str]) -> tuple[int, int, dict[Role, str], bool | None] | None:
    """The places of the first and the last word of what decides, and what that is."""
    for k in range(len(words) - 1, -1, -1):
        first = _ending(words, k)
        if first is None:
            continue
        return _tripled(words, k) or (first, k, *NAMES["".join(words[first : k + 1])])
    for k in range(len(words) - 1, 0, -1):
        if words[k] in LETTERS:
            return k, k, {LETTERS[words[k]]: ""}, None
        if not FILE_WORDS.fullmatch(words[k]) and not (words[k] == "k" or words[k].isdigit()):
            break
    return None


def _tripled(words: Sequence[str], last: int) -> tuple[int, int, dict[Role, str], None] | None:
    """The same of three names that together are a packed image's, the last of which ends with this word."""
    roles: list[Role] = []
    at = last + 1
    while len(roles) < 3 and (before := _ending(words, at - 1, SINGLE)) is not None:
        roles.insert(0, next(iter(NAMES["".join(words[before:at])][0])))
        at = before
    return (at, last, dict(zip(roles, "rgb", strict=True)), None) if sorted(roles) == sorted(TRIPLED) else None


def _ending(words: Sequence[str], last: int, names: Container[str] = NAMES) -> int | None:
    """The place of the first word of the longest of these names that ends with this one."""
    for first in range(max(last - MOST_WORDS + 1, 0), last + 1):
        parts = words[first : last + 1]
        if all(len(part) > 1 or part == "x" for part in parts) and "".join(parts) in names:
            return first
    return None


def _subject(text: str) -> str:
    """A name without what is said of the file."""
    words = [word for word in re.split(r"[ _\-.()\[\]+,]+", text) if word and not FILE_WORDS.fullmatch(word)]
    return "_".join(words)
