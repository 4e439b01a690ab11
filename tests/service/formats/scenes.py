"""glTF files as the scenes that they become."""

from __future__ import annotations

from typing import Any

import numpy as np

from service.document import parse_scene
from service.formats.scene_import import Imported
from service.server.assets import AssetStore
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


def corners(store: AssetStore, shape: dict[str, Any]) -> np.ndarray:
    """(m, 3, 3) in the world."""
    mesh = store.mesh(shape["asset"])
    matrix = np.reshape(shape.get("transform", {"matrix": np.eye(4)})["matrix"], (4, 4))
    return (mesh.vertices @ matrix[:3, :3].T + matrix[:3, 3])[mesh.faces]
