"""Scenes that differ in how their noise is distributed over the picture."""

from __future__ import annotations

from typing import Any

import numpy as np

from service.document import presets
from tests.rendering import document

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
SHAPES = [
    {"type": "sphere", "center": [0, 0, 0], "radius": 0.8, "material": "ball"},
    {"type": "quad", "origin": [-6, -0.8, 6], "u": [12, 0, 0], "v": [0, 0, -12], "material": "floor"},
]
FLOOR = {"type": "diffuse", "albedo": 0.5}


def under_a_lamp(ball: dict[str, Any]) -> dict[str, Any]:
    """A small lamp in sight, whose edges carry most of the error."""
    lamp = {"type": "quad", "origin": [-0.4, 1.2, -0.4], "u": [0.8, 0, 0], "v": [0, 0, 0.8], "material": "lamp"}
    materials = {"ball": ball, "floor": FLOOR, "lamp": {"type": "diffuse", "albedo": 0, "emission": 30}}
    return document([*SHAPES, lamp], materials, environment={"type": "constant", "radiance": 0.3})


SCENES = {
    "cornell": presets.get("scenes", "cornell-boxes"),
    "rough metal": under_a_lamp({"type": "principled", "metallic": 1, "roughness": 0.3}),
    "rough glass": under_a_lamp({"type": "principled", "transmission": 1, "roughness": 0.4}),
    "furnace": document(SHAPES[:1], {"ball": FLOOR}, environment={"type": "constant", "radiance": 1}),
}


def luminance(made: Any) -> np.ndarray:
    values: np.ndarray = made.read()[..., :3].astype(float) @ LUMINANCE
    return values
