"""A model on disk and the files that it names, as one zip: what the importers read, by the rule by which they find
files in it."""

from __future__ import annotations

import posixpath
import re
import sys
from functools import cached_property
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

from service.cli import BadInput
from service.formats.errors import ParseError
from service.formats.formats import CRATE, KINDS, MODELS, USD_LAYERS, USD_TEXT, decoded, sniff, text
from service.formats.read.references import URL, Finder, base_name, is_absolute, located
from service.problems import AssetError

if TYPE_CHECKING:
    from service.server.assets import FileAssets

MTLLIB = re.compile(rb"(?:^|[\r\n])[ \t]*mtllib[ \t]+([^\r\n]*)")
ENDINGS: dict[str, tuple[str, ...]] = {
    "obj": (".obj",),
    "mtlx": (".mtlx",),
    "gltf": (".gltf",),
    "glb": (".glb",),
    "ply": (".ply",),
}
ENDINGS |= {"usd": USD_LAYERS} | {format: (f".{format}",) for format in MODELS}


def with_parts(path: Path, data: bytes, format: str, files: FileAssets) -> bytes | None:
    """A zip of the model and those of its files that exist; None where it names none. Raises BadInput for a file that
    may not be read."""
    from service.formats.read.archive import zipped

    beside = _Neighbours(files, path.name)
    found = _PARTS[format](data, beside)
    if found is None:
        return None
    entries = {name: files.read(name) for name in found}
    # A path may lead out of the folder where --asset-root allows that: in the zip the model lies as deep.
    deep = max((name.split("/").count("..") for name in entries), default=0)
    folder = "/".join(["model"] * deep)
    member = path.name if path.suffix.lower() in ENDINGS[format] else f"{path.name}{ENDINGS[format][0]}"
    named = {posixpath.normpath(posixpath.join(folder, name)): content for name, content in entries.items()}
    return zipped(named | {posixpath.join(folder, member.replace("\\", "_")): data})


class _Neighbours:
    """The files in the model's folder, and in other folders that were allowed."""

    def __init__(self, files: FileAssets, model: str) -> None:
        self.files, self.model = files, model

    def find(self, source: str, *spellings: str, place: str) -> str | None:
        """The path of the file that the file at `source` calls by one of these names. Both are relative to the
        model's folder. Raises BadInput."""
        for reference in spellings:
            if not URL.match(reference) and not is_absolute(reference):
                path = located(source, reference)
                if self._holds(path, place):
                    return path
        for reference in spellings:
            beside = posixpath.join(posixpath.dirname(source), base_name(reference))
            if base_name(reference) and not URL.match(reference) and self._holds(beside, place):
                return beside
        found = self._finder.find(source, *spellings)
        return None if found is None else found.path

    def _holds(self, path: str, place: str) -> bool:
        try:
            return bool(path) and path != "." and self.files.holds(path)
        except AssetError as error:
            raise BadInput(f"{place}: {error.detail}") from None

    @cached_property
    def _finder(self) -> Finder:
        return Finder(self.files.listed())


def _of_obj(data: bytes, beside: _Neighbours) -> list[str]:
    """Material libraries and the images that they name."""
    from service.formats.read.obj.libraries import readings
    from service.formats.read.obj.mtl import read_mtl
    from service.formats.read.scenes.warnings import Warnings

    libraries: dict[str, None] = {}
    for statement in dict.fromkeys(MTLLIB.findall(text(data))):
        known = readings(decoded(statement).strip(), lambda name: beside.find("", name, place="mtllib"))
        names = [name for _, name in known]
        libraries |= {name: None for name in names if name is not None and not name.lower().endswith(".obj")}
    found = dict(libraries)
    for library in libraries:
        try:
            materials = read_mtl(library, beside.files.read(library), Warnings())  # the importer reports its oddities
        except ParseError:
            continue  # and its mistakes
        maps = [each for material in materials.values() for each in material.maps.values()]
        for each in (reading for found_map in maps for reading in (found_map, *found_map.others)):
            image = beside.find(library, each.reference, place=each.place) if each.reference else None
            found |= {image: None} if image is not None else {}
    return list(found)


def _of_gltf(data: bytes, beside: _Neighbours) -> list[str] | None:
    """Buffers, which must be there, and images."""
    from service.formats.read.gltf.beside import spellings
    from service.formats.read.gltf.document import external

    named = external(data)
    found = []
    for pointer, uri in named:
        path = beside.find("", *spellings(uri), place=pointer)
        if path is None and pointer.startswith("/buffers"):
            where = "lies elsewhere; only files beside the model are read" if URL.match(uri) else "is not there"
            raise BadInput(f"{pointer}: {uri[:100]!r} {where}")
        if path is not None:
            found.append(path)
    return found if named else None


def _of_mtlx(data: bytes, beside: _Neighbours) -> list[str]:
    """Images, and the files that it includes with theirs."""
    from service.formats.read.materialx.document import named

    found: dict[str, None] = {}
    left = [("", data)]
    while left:
        source, text = left.pop()
        names = named(text)
        for name in (*names.files, *names.included):
            path = beside.find(source, name, place=source or "the MaterialX file")
            if path is not None and path not in found and name in names.included:
                left.append((path, beside.files.read(path)))
            found |= {path: None} if path is not None else {}
    return list(found)


def _of_usd(data: bytes, beside: _Neighbours) -> list[str] | None:
    """Layers, MaterialX files and images, and what the former name in turn."""
    from service.formats.read.materialx.document import named
    from service.formats.read.usd_names import names_in_layer

    found: dict[str, None] = {}
    left = [("", data)]
    while left:
        source, layer = left.pop()
        names = named(layer) if source.lower().endswith(".mtlx") else (names_in_layer(layer),)
        for name in chain(*names):
            try:
                path = beside.find(source, name, place=source or "the USD file")
            except BadInput as error:  # it may be in a variant that is not shown
                print(f"warning: {error}", file=sys.stderr)
                continue
            if path is None or path in found:
                continue
            content = beside.files.read(path)
            if is_layer := content.startswith((CRATE, USD_TEXT)) or path.lower().endswith(".mtlx"):
                left.append((path, content))
            if is_layer or KINDS.get(sniff(content, filename=path) or "") == "image":
                found[path] = None
    return list(found) or None


def _of_ply(data: bytes, beside: _Neighbours) -> list[str] | None:
    from service.formats.read.ply_header import read_header

    try:
        names = read_header(memoryview(data)).textures_of(beside.model)
    except ParseError:
        return None  # the importer reports the mistake
    return [path for name in names if (path := beside.find("", name, place="TextureFile")) is not None] or None


def _of_library(data: bytes, beside: _Neighbours) -> list[str] | None:
    """The images whose names stand in the file, which a library alone can read."""
    images = tuple(f".{suffix}" for suffix in IMAGES)
    known = data.lower()
    names = [name for name in beside.files.listed() if name.lower().endswith(images)]
    return [name for name in names if base_name(name).lower().encode() in known] or None


IMAGES = ("png", "jpg", "jpeg", "webp", "tga", "bmp", "tif", "tiff")
_PARTS = {"obj": _of_obj, "gltf": _of_gltf, "glb": _of_gltf, "mtlx": _of_mtlx, "ply": _of_ply, "usd": _of_usd}
_PARTS |= dict.fromkeys(MODELS, _of_library)
