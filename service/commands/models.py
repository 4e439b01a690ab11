"""glTF models as the command line takes them: a GLB, or a .gltf with its buffers and images in files beside it."""

from __future__ import annotations

import base64
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import unquote

from service.assets.errors import ParseError
from service.assets.gltf.document import load
from service.commands import BadInput
from service.problems import AssetError

if TYPE_CHECKING:
    from service.assets import AssetStore, FileAssets
    from service.assets.scene_import import Imported


def is_model(path: Path, data: bytes) -> bool:
    """By its name or its bytes; of JSON by the object `asset` at its root, which no scene's document has."""
    if data.startswith(b"glTF") or path.suffix.lower() in (".glb", ".gltf"):
        return True
    try:
        tree = load(data) if b'"asset"' in data else None
    except ParseError:
        return False
    return isinstance(tree, dict) and isinstance(tree.get("asset"), dict)


def import_model(path: Path, data: bytes, store: AssetStore, files: FileAssets) -> Imported:
    """The model as a document whose references are assets of `store`. Tells its warnings. Raises ServiceError."""
    if not data.startswith(b"glTF"):
        data = _embedded(data, files)
    imported = store.scene(store.add(data, filename="model.gltf").id)
    for warning in imported.warnings:
        place = f"{warning['pointer']}: " if warning["pointer"] else ""
        print(f"warning: {place}{warning['detail']}", file=sys.stderr)
    return imported


def _embedded(data: bytes, files: FileAssets) -> bytes:
    """The JSON of a .gltf with the files that it names put into it."""
    try:
        tree = load(data)
    except ParseError:
        return data  # the importer says what is wrong, and where in the file as it is
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
