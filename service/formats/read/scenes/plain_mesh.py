"""The scene around a single mesh: a file of triangles without materials, lights and cameras."""

from __future__ import annotations

from typing import Any

import numpy as np

from service.formats.read.scenes.framing import framed
from service.formats.read.scenes.rays import Placed
from service.formats.read.scenes.room import stand_inside
from service.formats.types import MeshData

GREY = {"type": "diffuse", "albedo": 0.8}  # the material of a mesh without one
NAME = "default"


def plain_scene(asset: str, mesh: MeshData) -> tuple[dict[str, Any], str | None]:
    """A document that shows the mesh whole, in grey or its own colours, and what is to be said of it. There is no
    light but in a closed room."""
    document = {
        "version": 1,
        "camera": framed(mesh.bounds),
        "materials": {NAME: dict(GREY)},
        "shapes": [{"type": "mesh", "asset": asset, "material": NAME}],
    }
    return document, stand_inside(document, [Placed(mesh.vertices, mesh.faces, np.eye(4), True, NAME)], mesh.bounds)
