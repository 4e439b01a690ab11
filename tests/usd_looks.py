"""A material of a USD file on a square, and what becomes of it."""

from __future__ import annotations

from typing import Any

import numpy as np

from service.document import parse_scene
from service.formats.scene_import import Imported
from service.server.assets import AssetStore
from tests.usd_files import PNG, QUAD, mesh, usda, usdz

CHANNELS = np.dstack([np.full((2, 2), value, np.uint8) for value in (200, 100, 50)])
UV = """
    texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (
        interpolation = "vertex"
    )
    texCoord2f[] primvars:lightmap = [(0.5, 0), (0.5, 0), (0.5, 1), (0, 1)] (
        interpolation = "vertex"
    )
"""


def worn(
    store: AssetStore, look: str, images: dict[str, np.ndarray] | None = None, unit: float = 1
) -> tuple[dict[str, Any], Imported]:
    """The material "Look" in the document, on a square; `unit` is how many metres a unit of the stage has."""
    root = usda(look + mesh("Sign", "rel material:binding = </Look>", body=QUAD + UV), f"metersPerUnit = {unit:g}")
    data = usdz({"root.usda": root} | {name: PNG(pixels) for name, pixels in (images or {}).items()})
    found = store.scene(store.add(data).id)
    parse_scene(found.scene({"type": "constant", "radiance": 1}))
    return found.document["materials"][found.document["shapes"][0]["material"]], found
