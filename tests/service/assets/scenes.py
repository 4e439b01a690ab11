"""glTF files as the scenes that they become."""

from __future__ import annotations

from service.assets import AssetStore
from service.assets.scene_import import Imported
from service.scene import parse_scene
from tests.gltf_files import Gltf


def imported(store: AssetStore, file: Gltf) -> Imported:
    info = store.add(file.glb())
    assert info.kind == "scene"
    found = store.scene(info.id)
    assert (info.warnings or []) == found.warnings
    parse_scene(found.document)
    return found


def noted(found: Imported) -> dict[str, str]:
    return {warning["pointer"]: warning["detail"] for warning in found.warnings}
