"""The images of each material: which is taken where several are of one thing, and what is said of the others."""

from __future__ import annotations

import posixpath
from collections.abc import Iterable
from dataclasses import dataclass, field

from service.formats.read.scenes.warnings import Warnings
from service.formats.read.texture_sets.names import FILE_WORDS, FIRST_TILE, Meaning, Role, meaning, tiles_within

# Things that no parameter has: they are left out, with a warning.
LEFT_OUT: dict[Role, str] = {
    "occlusion": "ambient occlusion is left out: the light that reaches a corner is traced",
    "other": "there is no parameter for such an image; it is left out",
}
FOLDERS = ("textures", "texture", "tex", "maps", "map", "images", "image", "img")  # that any set may have
UDIM = "UDIM tiles are not supported"


@dataclass(frozen=True)
class RoleImage:
    """An image for one role, or the channel of one."""

    path: str
    meaning: Meaning
    channel: str  # "" for the whole image


@dataclass
class TextureSet:
    """The images of one material, by role."""

    sources: dict[Role, RoleImage] = field(default_factory=dict)


def texture_sets(paths: Iterable[str], notes: Warnings) -> dict[str, TextureSet]:
    """The sets by material, in the order of their names; paths lead to images. What is not taken is noted."""
    stems = {path: posixpath.splitext(posixpath.basename(path))[0] for path in sorted(paths)}
    tiled = tiles_within(stems.values())
    named: dict[str, list[tuple[str, Meaning]]] = {}
    names: dict[str, str] = {}
    meanings = _read(stems, tiled)
    for path, found in meanings.items():
        if found is None:
            notes.add(path, "the file's name does not say what the image is of; it is left out")
        elif found.tile is not None and found.tile != FIRST_TILE:
            notes.add(path, f"{UDIM}; this one is left out")
        else:
            if found.tile is not None:
                notes.add(path, f"{UDIM}; tile {FIRST_TILE} is shown wherever the material is")
            name = _material(path, found)
            named.setdefault(key := _plain(name), []).append((path, found))
            names.setdefault(key, name)
    sets = {names[key]: _chosen(images, notes) for key, images in named.items()}
    return {name: each for name, each in sets.items() if each.sources}


def _read(stems: dict[str, str], tiled: set[str]) -> dict[str, Meaning | None]:
    """What each image is of. Another reading is right where all images of a material have one, and add something to
    another material."""
    found = {path: meaning(stem, tiled) for path, stem in stems.items()}
    groups: dict[str, dict[str, Meaning]] = {}
    for path, each in found.items():
        if each is not None:
            groups.setdefault(_plain(_material(path, each)), {})[path] = each
    for images in groups.values():
        others = {path: each.other for path, each in images.items() if each.other is not None}
        wider = {_plain(_material(path, other)) for path, other in others.items()}
        if len(others) < len(images) or len(wider) != 1 or (there := groups.get(wider.pop())) is None:
            continue
        taken = {role for each in there.values() for role in each.channels}
        if not any(role in taken for other in others.values() for role in other.channels):
            found |= others
    return found


def _plain(name: str) -> str:
    """A name without case and what parts its words, so that `Old Wood` and `old-wood` are one."""
    return "".join(letter for letter in name.casefold() if letter.isalnum()) or name


def _material(path: str, found: Meaning) -> str:
    """The name of its material: what is left of the file's name, else that of the innermost folder whose name is not
    one that any set may have."""
    folders = [part for part in posixpath.dirname(path).split("/") if part and not _is_general(part)]
    return found.material or (folders[-1] if folders else "material")


def _is_general(folder: str) -> bool:
    return folder.lower() in FOLDERS or FILE_WORDS.fullmatch(folder) is not None


def _chosen(images: list[tuple[str, Meaning]], notes: Warnings) -> TextureSet:
    out = TextureSet()
    for path, found in sorted(images, key=lambda image: _rank(image[1])):
        taken = False
        for role, channel in found.channels.items():
            if role in LEFT_OUT:
                if not found.packed:
                    notes.add(path, LEFT_OUT[role])
                    taken = True
                continue
            target = out.sources.setdefault(role, RoleImage(path, found, channel))
            taken = taken or target.path == path
        if not taken:
            others = {out.sources[role].path for role in found.channels if role in out.sources}
            notes.add(path, f"another image of this is used: {', '.join(sorted(others))}")
    if "gloss" in out.sources and "roughness" in out.sources:
        unused = out.sources.pop("gloss")
        if unused.path not in {each.path for each in out.sources.values()}:
            notes.add(unused.path, f"another image of this is used: {out.sources['roughness'].path}")
    return out


def _rank(found: Meaning) -> tuple[bool, bool]:
    """Separate images come before packed ones, and normals for OpenGL before those for DirectX."""
    return found.packed, bool(found.directx)
