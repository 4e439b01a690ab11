"""Models as the command line takes them: a GLB, a .gltf or an OBJ with its files beside it, a zip of these, a PLY
with its textures beside it, an STL or a USD file; and materials, a .mtlx with its images beside it.

The importer always reads one file: a .gltf with its files inlined, an OBJ or a .mtlx and its files as a zip.
"""

from __future__ import annotations

import base64
import json
import posixpath
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import unquote

from service.cli import BadInput
from service.formats import formats
from service.formats.errors import ParseError
from service.formats.formats import sniff, text
from service.formats.read.gltf.document import load
from service.problems import AssetError

if TYPE_CHECKING:
    from service.formats.scene_import import Imported
    from service.formats.types import Pose
    from service.server.assets import AssetStore, FileAssets


WHOLE = ("glb", "zip", "ply", "stl", "usd", *formats.FOREIGN)  # formats that are one file
SUFFIXES = tuple(f".{each}" for each, format in formats.SUFFIXES.items() if format in (*WHOLE, "gltf", "obj", "mtlx"))
MTLLIB = re.compile(rb"(?:^|[\r\n])[ \t]*mtllib[ \t]+([^\r\n]*)")


def is_model(path: Path, data: bytes) -> bool:
    """By its name or its bytes; of JSON by the object `asset` at its root, which no scene's document has."""
    if path.suffix.lower() in SUFFIXES or sniff(data) in (*WHOLE, "obj", "mtlx"):
        return True
    try:
        tree = load(data) if b'"asset"' in data else None
    except ParseError:
        return False
    return isinstance(tree, dict) and isinstance(tree.get("asset"), dict)


def import_model(path: Path, data: bytes, store: AssetStore, files: FileAssets, pose: Pose | None = None) -> Imported:
    """The model, perhaps in a pose, as a document whose references are assets of `store`. Prints warnings. Raises
    ServiceError."""
    format = sniff(data, filename=path.name)
    title = None
    if format == "obj":
        data, title = _zipped(path, data, files), "the OBJ file"
    elif format == "ply" and (found := _ply_textures(data, files)):
        data, format, title = _packed(path, data, ".ply", found), "zip", "the PLY file"
    elif format == "mtlx":
        data, format, title = _with_images(path, data, files), "zip", "the MaterialX file"
    elif format not in WHOLE:
        data, format = _embedded(data, files), "gltf"
    from service.formats.types import Pose
    from service.server.assets.posing import posed_scene

    info = store.add(data, filename=f"model.{format}", title=title)
    imported = store.materials(info.id) if info.kind == "materials" else posed_scene(store, info.id, pose or Pose())
    for warning in imported.warnings:
        place = f"{warning['pointer']}: " if warning["pointer"] else ""
        print(f"warning: {place}{warning['detail']}", file=sys.stderr)
    return imported


def zipped_images(folder: Path) -> bytes:
    """The images of a folder, and its MaterialX files, as a zip. Raises BadInput where there is none."""
    from service.cli import files
    from service.formats.read.obj.importer import zipped

    endings = tuple(f".{ending}" for ending, format in formats.SUFFIXES.items() if formats.KINDS[format] == "image")
    taken = (*endings, ".mtlx")
    paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in taken and path.is_file())
    if not paths:
        raise BadInput(f"{str(folder)!r}: holds no images ({', '.join(endings)})")
    return zipped({f"{folder.resolve().name}/{path.name}": files.read(path) for path in paths})


def _embedded(data: bytes, files: FileAssets) -> bytes:
    """The JSON of a .gltf with the files that it names inlined."""
    try:
        tree = load(data)
    except ParseError:
        return data  # unchanged: the importer reports the mistake and its place
    for kind in ("buffers", "images"):
        items = tree.get(kind) if isinstance(tree, dict) else None
        for k, item in enumerate(items if isinstance(items, list) else ()):
            uri = item.get("uri") if isinstance(item, dict) else None
            if isinstance(uri, str) and not uri.startswith("data:"):
                item["uri"] = _read(uri, f"/{kind}/{k}/uri", files)
    return json.dumps(tree, sort_keys=True).encode()


def _read(uri: str, pointer: str, files: FileAssets) -> str:
    if "://" in uri:
        raise BadInput(f"{pointer}: {uri[:100]!r} lies elsewhere; only files beside the model are read")
    try:
        data = files.read(unquote(uri))
    except AssetError as error:
        raise BadInput(f"{pointer}: {error.detail}") from None
    return "data:application/octet-stream;base64," + base64.b64encode(data).decode()


def _zipped(path: Path, data: bytes, files: FileAssets) -> bytes:
    """A zip of the OBJ and those of its libraries and textures that exist."""
    found = {located: files.read(located) for located in _libraries(data, files)}
    for library, content in list(found.items()):
        found |= {image: files.read(image) for image in _textures(library, content, files)}
    return _packed(path, data, ".obj", found)


def _packed(path: Path, data: bytes, ending: str, found: dict[str, bytes]) -> bytes:
    """A zip of the model and of other files by their paths from its folder."""
    from service.formats.read.obj.importer import zipped

    # A path may lead out of the folder where --asset-root allows that: in the zip the model lies as deep.
    deep = max((name.split("/").count("..") for name in found), default=0)
    folder = "/".join(["model"] * deep)
    member = (path.name if path.suffix.lower() == ending else f"{path.name}{ending}").replace("\\", "_")
    entries = {posixpath.normpath(posixpath.join(folder, name)): content for name, content in found.items()}
    return zipped(entries | {posixpath.join(folder, member): data})


def _ply_textures(data: bytes, files: FileAssets) -> dict[str, bytes]:
    """The images that exist of those that a PLY file's comments name, by their paths from its folder."""
    from service.formats.read.obj.paths import located
    from service.formats.read.ply_header import read_header

    try:
        named = read_header(memoryview(data)).textures
    except ParseError:
        return {}  # the importer reports the mistake
    paths = [path for name in named if _is_there(path := located("", name), "comment TextureFile", files)]
    return {path: files.read(path) for path in paths}


def _with_images(path: Path, data: bytes, files: FileAssets) -> bytes:
    """A zip of the MaterialX file and those of its images that exist; a larger one is refused as such."""
    from service.formats.read.materialx.document import file_names
    from service.formats.read.obj.paths import is_absolute, located

    found = {located("", name): name for name in file_names(data) if "://" not in name and not is_absolute(name)}
    entries = {place: files.read(place) for place, name in found.items() if _is_there(place, name, files)}
    return _packed(path, data, ".mtlx", entries)


def _libraries(data: bytes, files: FileAssets) -> Iterator[str]:
    """The paths of the material libraries that exist, relative to the model's folder."""
    from service.formats.read.obj.paths import library_names, located

    for statement in dict.fromkeys(MTLLIB.findall(text(data))):

        def is_there(name: str) -> bool:
            return not name.lower().endswith(".obj") and _is_there(located("", name), "mtllib", files)

        for name in library_names(statement.decode("utf-8", "replace").strip(), is_there):
            if is_there(name):
                yield located("", name)


def _textures(library: str, content: bytes, files: FileAssets) -> Iterator[str]:
    """The paths of existing images that a library names, relative to the model's folder."""
    from service.formats.read.obj.mtl import read_mtl
    from service.formats.read.obj.paths import located
    from service.formats.read.scenes.warnings import Warnings

    try:
        materials = read_mtl(library, content, Warnings())  # the importer reports its oddities
    except ParseError:
        return  # and its mistakes
    for material in materials.values():
        for found in material.maps.values():
            paths = (located(library, reading.reference) for reading in (found, *found.others))
            path = next((path for path in paths if _is_there(path, found.place, files)), None)
            if path is not None:
                yield path


def _is_there(path: str, place: str, files: FileAssets) -> bool:
    try:
        return files.holds(path)
    except AssetError as error:
        raise BadInput(f"{place}: {error.detail}") from None
