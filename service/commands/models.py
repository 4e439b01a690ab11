"""glTF models as the command line takes them: a GLB, or a .gltf with its buffers and images in files beside it."""

from __future__ import annotations

import base64
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import unquote

from service.commands import BadInput
from service.problems import AssetError

if TYPE_CHECKING:
    from service.assets import AssetStore, FileAssets
    from service.assets.importing import Imported


def is_model(data: bytes) -> bool:
    """By its bytes; of JSON by the `asset` at its root, which is an object, and which no scene's document has."""
    if data.startswith(b"glTF"):
        return True
    try:
        tree = json.loads(data) if data.lstrip()[:1] == b"{" else None
    except (ValueError, RecursionError):
        return False
    return isinstance(tree, dict) and isinstance(tree.get("asset"), dict)


def import_model(path: Path, data: bytes, store: AssetStore, files: FileAssets) -> Imported:
    """The model as a document whose references are assets of `store`. Tells its warnings. Raises ServiceError."""
    if not data.startswith(b"glTF"):
        data = _embedded(data, files)
    imported = store.scene(store.add(data, filename=path.name).id)
    for warning in imported.warnings:
        print(f"warning: {warning['pointer']}: {warning['detail']}", file=sys.stderr)
    return imported


def _embedded(data: bytes, files: FileAssets) -> bytes:
    """The JSON of a .gltf with the files that it names put into it."""
    try:
        tree = json.loads(data)
    except (ValueError, RecursionError):
        return data  # whoever reads it says what is wrong
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
