"""Roles of images, and the materials they belong to, by the words of their file names.

The words are those that ambientCG, Poly Haven, Quixel, textures.com, FreePBR, 3dtextures and Poliigon use, and those
of Substance's exports for Unreal Engine, Unity and glTF.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

Role = Literal[
    "color", "roughness", "gloss", "metallic", "normal", "height", "opacity", "emission", "specular", "occlusion",
    "other",
]  # fmt: skip

WORDS: dict[Role, tuple[str, ...]] = {
    "color": ("color", "colour", "albedo", "basecolor", "basecolour", "basemap", "diff", "diffuse", "col", "alb"),
    "roughness": ("roughness", "rough", "rgh"),
    "gloss": ("gloss", "glossiness", "smoothness"),
    "metallic": ("metalness", "metallic", "metal", "mtl", "metallicness", "metallness"),
    "normal": ("normal", "normals", "nrm", "nor", "norm", "nml", "normalmap"),
    "height": ("height", "heightmap", "displacement", "displace", "disp", "bump", "bumpmap", "dis"),
    "opacity": ("opacity", "alpha", "mask", "transparency", "cutout"),
    "emission": ("emission", "emissive", "emit", "emissivity", "glow"),
    "specular": ("specular", "spec", "reflection", "refl"),
    "occlusion": ("ao", "ambientocclusion", "occlusion", "occ"),
    "other": (
        "cavity", "curvature", "translucency", "translucent", "transmission", "fuzz", "thickness", "sss",
        "scattering", "preview", "thumbnail", "thumb", "anisotropy", "idmap", "position",
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
}
# The same, and other things that two words say which each would say otherwise alone.
PAIRS: dict[tuple[str, str], dict[Role, str]] = {
    ("metallic", "roughness"): {"roughness": "g", "metallic": "b"},  # glTF
    ("metallic", "smoothness"): {"metallic": "r", "gloss": "a"},  # Unity
    ("mask", "map"): {"metallic": "r", "occlusion": "g", "gloss": "a"},  # Unity's high definition pipeline
    ("albedo", "transparency"): {"color": "", "opacity": "a"},  # Unity
    ("base", "color"): {"color": ""},
    ("base", "colour"): {"color": ""},
    ("base", "col"): {"color": ""},
    ("base", "map"): {"color": ""},
    ("ambient", "occlusion"): {"occlusion": ""},
}
TRIPLED: tuple[Role, ...] = ("occlusion", "roughness", "metallic")  # words that together name a packed image
OPENGL, DIRECTX = ("gl", "ogl", "opengl", "open"), ("dx", "directx", "direct")
ONE_WORD = {f"{normal}{mark}": (normal, mark) for normal in ("normal", "nor", "nrm") for mark in ("gl", "ogl", "dx")}
# Words about the file, not about its subject: 2K, 4096, 1024x1024, 16bit, the formats, and levels of detail.
FILE_WORDS = re.compile(
    r"(?i)\d{1,2}k|\d{3,5}|\d{3,5}x\d{3,5}|\d{1,2}bit|jpe?g|png|exr|tiff?|tga|webp|hdr|lod\d|seamless"
)
# The number of a tile; 1024 without a dot before it is a size.
UDIM = re.compile(r"\.1\d{3}$|[_-](?!1024)(?:10\d\d|1100)$")
WORD = re.compile(r"[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+|\d+")

_ROLES: dict[str, Role] = {word: role for role, words in WORDS.items() for word in words}


@dataclass(frozen=True)
class Meaning:
    """The role of an image. `channels`: for each role the channel that has it, or "" for the whole image."""

    material: str  # what is left of the name; "" where nothing is
    channels: dict[Role, str]
    directx: bool | None = None  # of normals: which way green points; None where the name does not say
    udim: bool = False  # a tile of several

    @property
    def packed(self) -> bool:
        return len(self.channels) > 1


def meaning(stem: str) -> Meaning | None:
    """The role of the image with this file name, without its ending; None where no word says. The last word that says
    it decides."""
    udim = UDIM.search(stem) is not None
    words = [(found.start(), found.end(), found[0].lower()) for found in WORD.finditer(stem)]
    found = _last([text for _, _, text in words])
    if found is None:
        return None
    first, last, channels, directx = found
    before, after = stem[: words[first][0]], stem[words[last][1] :]
    return Meaning(_subject(before) or _subject(after), channels, directx, udim)


def _last(words: Sequence[str]) -> tuple[int, int, dict[Role, str], bool | None] | None:
    """The places of the first and the last word of what decides, and what that is."""
    for k in range(len(words) - 1, -1, -1):
        word, pair = words[k], (words[k - 1], words[k]) if k else ("", "")
        three = words[max(k - 2, 0) : k + 1]
        roles = [_ROLES.get(each) for each in three]
        if len(three) == 3 and sorted(map(str, roles)) == sorted(TRIPLED):
            return k - 2, k, {role: channel for role, channel in zip(roles, "rgb", strict=True) if role}, None
        if pair in PAIRS:
            return k - 1, k, PAIRS[pair], None
        if word in PACKED:
            return k, k, PACKED[word], None
        if word in ONE_WORD:
            return k, k, {"normal": ""}, ONE_WORD[word][1] == "dx"
        if word in _ROLES:
            role = _ROLES[word]
            directx, mark = _mark(words, k) if role == "normal" else (None, k)
            return k, mark, {role: ""}, directx
    for k in range(len(words) - 1, 0, -1):
        if words[k] in LETTERS:
            return k, k, {LETTERS[words[k]]: ""}, None
        if not FILE_WORDS.fullmatch(words[k]) and not (words[k] == "k" or words[k].isdigit()):
            break
    return None


def _mark(words: Sequence[str], k: int) -> tuple[bool | None, int]:
    """True where green points as in DirectX by the words beside `normal`, None where they do not say; and the place
    of the last word that belongs to it."""
    for near in (k + 1, k - 1):
        word = words[near] if 0 <= near < len(words) else ""
        if word in OPENGL or word in DIRECTX:
            last = near
            if near > k and word in ("open", "direct"):  # OpenGL and DirectX are two words each
                last += 1
            return word in DIRECTX, max(min(last, len(words) - 1), k)
    return None, k


def _subject(text: str) -> str:
    """A name without what is said of the file."""
    words = [word for word in re.split(r"[ _\-.()\[\]+,]+", text) if word and not FILE_WORDS.fullmatch(word)]
    return "_".join(words)
