"""Models as the command line takes them: a GLB, a .gltf, an OBJ or a USD file with its files beside it, a zip of
these, a PLY with its textures beside it, or an STL; and materials, a .mtlx with its images beside it.

The importer always reads one file: a model that names others is read from a zip of all of them.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from service.cli import BadInput
from service.formats import formats
from service.formats.errors import ParseError
from service.formats.formats import sniff
from service.formats.read.gltf.document import load

if TYPE_CHECKING:
    from service.formats.scene_import import Imported
    from service.formats.types import Pose
    from service.server.assets import AssetStore, FileAssets


WHOLE = ("glb", "zip", "ply", "stl", "usd", *formats.FOREIGN)  # formats that bytes tell
SUFFIXES = tuple(f".{each}" for each, format in formats.SUFFIXES.items() if format in (*WHOLE, "gltf", "obj", "mtlx"))
TITLES = {"obj": "the OBJ file", "mtlx": "the MaterialX file", "gltf": "the glTF file", "ply": "the PLY file"}
TITLES |= {"usd": "the USD file"}


def is_model(path: Path, data: bytes) -> bool:
    """By its name or its bytes; of JSON by the object `asset` at its root, which no scene's document has."""
    if path.suffix.lower() in SUFFIXES or sniff(data) in (*WHOLE, "obj", "mtlx"):
        return True
    try:
        tree = load(data) if b'"asset"' in data else None
    except ParseError:
        return False
    return isinstance(tree, dict) and isinstance(tree.get("asset"), dict)


def import_model(
    path: Path, data: bytes, store: AssetStore, files: FileAssets, pose: Pose | None = None, entry: str | None = None
) -> Imported:
    """The model, perhaps in a pose, as a document whose references are assets of `store`; of several in a zip that
    which `entry` names. Prints warnings. Raises ServiceError."""
    from service.cli.neighbours import with_parts
    from service.formats.types import Pose
    from service.server.assets.posing import posed_scene

    format = sniff(data, filename=path.name) or "gltf"
    if format not in (*WHOLE, *TITLES):
        format = "gltf"  # the importer says what is wrong
    title = TITLES.get(format)
    if format in (*TITLES, "glb", *formats.MODELS) and (packed := with_parts(path, data, format, files)) is not None:
        data, format = packed, "zip"
    info = store.add(data, filename=f"model.{format}", title=title, entry=entry)
    imported = store.materials(info.id) if info.kind == "materials" else posed_scene(store, info.id, pose or Pose())
    for warning in imported.warnings:
        place = f"{warning['pointer']}: " if warning["pointer"] else ""
        print(f"warning: {place}{warning['detail']}", file=sys.stderr)
    return imported


def zipped_images(folder: Path) -> bytes:
    """The images of a folder, and its MaterialX files, as a zip. Raises BadInput where there is none."""
    from service.cli import files
    from service.formats.read.archive import zipped

    endings = tuple(f".{ending}" for ending, format in formats.SUFFIXES.items() if formats.KINDS[format] == "image")
    taken = (*endings, ".mtlx")
    paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in taken and path.is_file())
    if not paths:
        raise BadInput(f"{str(folder)!r}: holds no images ({', '.join(endings)})")
    return zipped({f"{folder.resolve().name}/{path.name}": files.read(path) for path in paths})
