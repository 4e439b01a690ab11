"""The scene around a single mesh: a file of triangles without materials, lights and cameras."""

from __future__ import annotations

from typing import Any

from service.assets.scenes.framing import framed
from service.assets.types import MeshData

GREY = {"type": "diffuse", "albedo": 0.8}  # the material of what has none
NAME = "default"


def plain_scene(asset: str, mesh: MeshData) -> dict[str, Any]:
    """A document that shows the mesh whole, in grey or its own colours; it has no light."""
    return {
        "version": 1,
        "camera": framed(mesh.bounds),
        "materials": {NAME: dict(GREY)},
        "shapes": [{"type": "mesh", "asset": asset, "material": NAME}],
    }
