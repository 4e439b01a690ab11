"""Roles of images, and the materials they belong to, by the words of their file names.

The words are those that ambientCG, Poly Haven, Quixel, textures.com, FreePBR, 3dtextures and Poliigon use, and those
of Substance's exports for Unreal Engine, Unity and glTF.
"""

from __future__ import annotations

import re
from collections.abc import Container, Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

Role = Literal[
    "color", "roughness", "gloss", "metallic", "normal", "height", "opacity", "emission", "specular", "occlusion",
    "other",
]  # fmt: skip

WORDS: dict[Role, tuple[str, ...]] = {
    "color": ("color", "colour", "albedo", "basecolor", "basecolour", "basemap", "basecol", "diff", "diffuse", "col",
              "alb"),
    "roughness": ("roughness", "rough", "rgh"),
    "gloss": ("gloss", "glossiness", "smoothness"),
    "metallic": ("metalness", "metallic", "metal", "mtl", "metallicness", "metallness", "metallicity"),
    "normal": ("normal", "normals", "nrm", "nor", "norm", "nml", "nrml"),
    "height": ("height", "heightmap", "displacement", "displace", "disp", "bump", "dis", "relief"),
    "opacity": ("opacity", "alpha", "mask", "transparency", "transparent", "cutout"),
    "emission": ("emission", "emissive", "emit", "emissivity", "glow"),
    "specular": ("specular", "spec", "specularlevel", "reflection", "refl"),
    "occlusion": ("ao", "ambientocclusion", "occlusion", "occ"),
    "other": (
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
    "arm": {"occlusion": "r", "roughness": "g", "metallic": "b"},
    "orm": {"occlusion": "r", "roughness": "g", "metallic": "b"},
    "mra": {"metallic": "r", "roughness": "g", "occlusion": "b"},
    "rma": {"roughness": "r", "metallic": "g", "occlusion": "b"},
    "metallicroughness": {"roughness": "g", "metallic": "b"},  # glTF
    "metallicsmoothness": {"metallic": "r", "gloss": "a"},  # Unity
    "maskmap": {"metallic": "r", "occlusion": "g", "gloss": "a"},  # Unity's high definition pipeline
    "albedotransparency": {"color": "", "opacity": "a"},  # Unity
}
TRIPLED: tuple[Role, ...] = ("occlusion", "roughness", "metallic")  # words that together name a packed image
# Names of several words are known without what parts these: "Opacity Mask", "opacity-mask" and "OpacityMask" are one.
MOST_WORDS = 5
KINDS = ("map", "maps", "tex", "texture")  # these may follow any word
MASKED: tuple[Role, ...] = ("opacity", "emission", "roughness", "metallic", "specular")  # and "mask" those of these
TINTED: tuple[Role, ...] = ("color", "emission", "specular")  # and a word for colour these
DOUBLED: tuple[Role, ...] = ("color", "opacity", "emission", "height", "occlusion")  # two words of one role are one
SUBJECTS = ("metal", "mtl", "mask")  # as likely what an image shows
OPENGL, DIRECTX = ("gl", "ogl", "opengl"), ("dx", "directx")
# Words about the file, not about its subject: 2K, 4096, 1024x1024, 16bit, the formats, and levels of detail.
FILE_WORDS = re.compile(
    r"(?i)\d{1,2}k|\d{3,5}|\d{3,5}x\d{3,5}|\d{1,2}bit|jpe?g|png|exr|tiff?|tga|webp|hdr|lod\d|seamless"
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
    found |= {word: ({role: ""}, None) for role, words in WORDS.items() for word in words}
    packed = {name + kind: channels for name, channels in PACKED.items() for kind in ("", *KINDS)}
    return found | {name: (channels, None) for name, channels in packed.items()}


NAMES = _named()


@dataclass(frozen=True)
class Meaning:
    """The role of an image. `channels`: for each role the channel that has it, or "" for the whole image."""

    material: str  # what is left of the name; "" where nothing is
    channels: dict[Role, str]
    directx: bool | None = None  # of normals: which way green points; None where the name does not say
    tile: int | None = None  # of several (UDIM), 1001 and on; 0 where its number is to be put in

    @property
    def packed(self) -> bool:
        return len(self.channels) > 1


def meaning(stem: str, tiled: Container[str] = ()) -> Meaning | None:
    """The role of the image with this file name, without its ending; None where no word says. The last word that says
    it decides. Numbers within the names `tiled` are those of tiles."""
    tile, rest = _tile(stem, stem in tiled)
    words = [(found.start(), found.end(), found[0].lower()) for found in WORD.finditer(rest)]
    found = _last([text for _, _, text in words])
    if found is None:
        return None
    first, last, channels, directx = found
    before, after = rest[: words[first][0]], rest[words[last][1] :]
    return Meaning(_subject(before) or _subject(after), channels, directx, tile)


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
        channels, directx = NAMES["".join(words[first : k + 1])]
        three, at = [channels], first
        while len(three) < 3 and at > 0 and (before := _ending(words, at - 1)) is not None:
            three.insert(0, NAMES["".join(words[before:at])][0])
            at = before
        roles = [next(iter(each)) for each in three if len(each) == 1]
        if sorted(roles) == sorted(TRIPLED):
            return at, k, dict(zip(roles, "rgb", strict=True)), None
        return first, k, channels, directx
    for k in range(len(words) - 1, 0, -1):
        if words[k] in LETTERS:
            return k, k, {LETTERS[words[k]]: ""}, None
        if not FILE_WORDS.fullmatch(words[k]) and not (words[k] == "k" or words[k].isdigit()):
            break
    return None


def _ending(words: Sequence[str], last: int) -> int | None:
    """The place of the first word of the longest name that ends with this one."""
    for first in range(max(last - MOST_WORDS + 1, 0), last + 1):
        parts = words[first : last + 1]
        if all(len(part) > 1 or part == "x" for part in parts) and "".join(parts) in NAMES:
            return first
    return None


def _subject(text: str) -> str:
    """A name without what is said of the file."""
    words = [word for word in re.split(r"[ _\-.()\[\]+,]+", text) if word and not FILE_WORDS.fullmatch(word)]
    return "_".join(words)
