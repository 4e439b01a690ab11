"""A zip of images as a document with materials and textures, without a shape."""

from __future__ import annotations

import posixpath
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from service.formats.errors import ParseError
from service.formats.formats import OTHER_MODELS, UNREAD, sniff
from service.formats.read.archive import Archive
from service.formats.read.image import PILLOW
from service.formats.read.other_images import ENDINGS, NAMED, readable
from service.formats.read.png_chunks import opened
from service.formats.read.scenes.names import unique
from service.formats.read.scenes.part_files import PartFiles
from service.formats.read.scenes.warnings import Warnings
from service.formats.read.texture_sets.baking import inverted, is_transparent, turned
from service.formats.read.texture_sets.names import FIRST_TILE, Role
from service.formats.read.texture_sets.real_size import Size, by_names, by_note
from service.formats.read.texture_sets.sets import UDIM, RoleImage, TextureSet, texture_sets
from service.formats.types import AssetLimits, SceneFile

MOST_MATERIALS = 1_000
COLOURED: tuple[Role, ...] = ("color", "emission")
FLOATS = ("exr", "hdr")  # formats whose colours are linear
# Members of `principled` that take one channel of an image.
SCALARS: dict[Role, str] = {
    "roughness": "roughness", "gloss": "roughness", "metallic": "metallic", "opacity": "alpha",
    "specular": "specular",
}  # fmt: skip
RELIEF = 0.02  # metres from black to white, as of bricks or bark: images do not say
# What a document needs beside materials; nobody sees it.
CAMERA = {"position": [0, 0, 4], "target": [0, 0, 0]}


def read_texture_sets(archive: Archive, limits: AssetLimits, nothing: str) -> SceneFile:
    """The materials of a zip, each a `principled`. Raises ParseError, which says `nothing` where there is none."""
    notes, files = Warnings(names_files=True), PartFiles()
    note = by_note(archive)
    others = [path for path in archive.names if note is None or path != note[0]]
    images = {path: data for path in others if (data := _image(archive, path, limits, notes)) is not None}
    sets = texture_sets(images, notes)
    if not sets:
        tiles = f". {UDIM}, and it has none that is tile {FIRST_TILE}" if notes.has(UDIM) else ""
        broken = [each for each in notes.document() if each["pointer"].lower().endswith(ENDINGS)]
        told = f"; {broken[0]['pointer'][:100]} is {broken[0]['detail']}" if broken else ""
        raise ParseError(f"{nothing}{tiles}{told}")
    if len(sets) > MOST_MATERIALS:
        raise ParseError(f"it holds images of {len(sets)} materials; {MOST_MATERIALS} are allowed")
    textures = _Textures(images, files, limits)
    materials = {}
    for name, each in sets.items():
        paths = [source.path for source in each.sources.values()]
        textures.size = note[1] if note and len(sets) == 1 else by_names(paths)
        materials[name] = _material(each, textures, notes)
        if textures.size:
            width, height = textures.size
            shown = f"they show {width:g} x {height:g} m, and repeat so for texture coordinates in metres"
            notes.add(note[0] if note and len(sets) == 1 else paths[0], shown)
    document = {
        "version": 1, "camera": CAMERA, "materials": materials, "textures": textures.documents, "shapes": [],
    }  # fmt: skip
    return SceneFile(document, files.parts, notes.document(), 0, False)


def _image(archive: Archive, path: str, limits: AssetLimits, notes: Warnings) -> bytes | None:
    if path.lower().endswith(OTHER_MODELS):
        notes.add(path, f"{UNREAD}; left out")
        return None
    data = readable(archive.read(path), limits.max_texels, path)
    if data is None:
        notes.add(path, f"not an image in a supported format ({NAMED}); left out")
    return data


@dataclass
class _Textures:
    """The textures of all materials; `documents` are the finished ones by name."""

    images: dict[str, bytes]
    files: PartFiles
    limits: AssetLimits
    size: Size | None = None  # of what the images of the present material show
    documents: dict[str, dict[str, Any]] = field(default_factory=dict)
    _names: dict[tuple[str, str, str], str] = field(default_factory=dict)

    def use(self, source: RoleImage, role: Role) -> str:
        """The name of the texture that shows an image in a role."""
        data = self.images[source.path]
        way = {"gloss": "roughness", "normal": "turned"}.get(role, "") if _is_baked(source, role) else ""
        space = "srgb" if role in COLOURED and sniff(data) not in FLOATS else "linear"
        key = source.path, f"{way}{source.channel if way else ''}", space
        coloured = source.path, "", "srgb"
        if source.channel == "a" and not way and coloured in self._names:
            return self._names[coloured]  # alpha is linear in any texture
        if key not in self._names:
            if role == "gloss":
                data = inverted(data, source.channel, self.limits)
            elif way:
                data = turned(data, self.limits)
            stem = posixpath.splitext(posixpath.basename(source.path))[0]
            name = unique(f"{stem} as roughness" if role == "gloss" else stem, self.documents)
            asset = self.files.add(data, source.path)
            scale = {"scale": [float(f"{1 / side:.6g}") for side in self.size]} if self.size else {}
            self.documents[name] = {"asset": asset, "color_space": space, **scale}
            self._names[key] = name
        return self._names[key]


@contextmanager
def _at(path: str) -> Iterator[None]:
    """Names the image that can't be read."""
    try:
        yield
    except ParseError as error:
        raise ParseError(error.detail, path[:100]) from None
    except (OSError, SyntaxError, ValueError) as error:
        raise ParseError(f"it can't be read ({str(error)[:100]})", path[:100]) from None


def _without_alpha(data: bytes) -> bool:
    """True for an image without transparency, whose alpha says nothing."""
    if sniff(data) not in PILLOW:
        return False
    try:
        image = opened(data, list(PILLOW.values()))
    except (OSError, SyntaxError, ValueError):
        return False  # it is refused as a part
    return "A" not in image.getbands() and "transparency" not in image.info


def _is_baked(source: RoleImage, role: Role) -> bool:
    return role == "gloss" or (role == "normal" and bool(source.meaning.directx))


def _material(images: TextureSet, textures: _Textures, notes: Warnings) -> dict[str, Any]:
    out: dict[str, Any] = {"type": "principled"}
    for role, source in images.sources.items():
        if source.channel == "a" and _without_alpha(textures.images[source.path]):
            notes.add(source.path, f"it has no alpha channel, from which its {role} would be read")
            continue
        with _at(source.path):
            name = textures.use(source, role)
            is_cut_out = role == "color" and is_transparent(textures.images[source.path], textures.limits)
        if role == "color":
            out["base_color"] = {"texture": name}
            if is_cut_out and "opacity" not in images.sources:
                notes.add(source.path, "its alpha is left out: no image's name says that it is the opacity")
        elif role == "emission":
            out["emission"] = {"texture": name}
        elif role == "normal":
            out["normal_map"] = {"texture": name}
        elif role == "height":
            out["height"] = {"texture": name, "scale": RELIEF}
            shown = "with displacement, else the normal map shows them" if "normal" in images.sources else "as bumps"
            notes.add(source.path, f"heights, shown {shown}; {RELIEF:g} m from black to white are assumed")
            if "normal" in images.sources:
                out["height"]["shading"] = False  # it is of the same relief
        else:
            channel = {} if role == "gloss" or not source.channel else {"channel": source.channel}
            out[SCALARS[role]] = {"texture": name, **channel}
    return out
