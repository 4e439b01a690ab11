"""Boxes and a model of triangles, over the number of bounces."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from service.document import presets
from tests.bench.seeds.stage import Document, Stage, sheet, shown

ROOMS = ("cornell-boxes", "cornell-spheres", "cornell-glossy", "cornell-open")
SIZE = 384
AROUND = 64  # facets of the vase's circumference

# Radius and height of the vase's outline, from the middle of its foot to the inside of its neck, and the rings after
# which another material begins.
OUTLINE = (
    (0.0, 0.0), (0.34, 0.0), (0.36, 0.05), (0.2, 0.12), (0.16, 0.22), (0.4, 0.5), (0.62, 0.85), (0.6, 1.15),
    (0.36, 1.45), (0.22, 1.65), (0.2, 1.85), (0.3, 2.02), (0.28, 2.03), (0.16, 1.84), (0.16, 1.5),
)  # fmt: skip
MATERIALS: dict[str, Document] = {
    "foot": {"type": "disney", "base_color": "#5b3a21", "roughness": 0.5},
    "body": {"type": "disney", "base_color": "#1f5f7a", "roughness": 0.35, "clearcoat": 1},
    "belt": {"type": "disney", "base_color": [1, 0.77, 0.34], "metallic": 1, "roughness": 0.25},
    "neck": {"type": "disney", "base_color": "#c8452d", "roughness": 0.3},
}
BANDS = (("foot", 0.3), ("body", 0.62), ("belt", 0.7), ("neck", 1.0))  # shares of the outline


def rooms(stage: Stage) -> list[dict[str, Any]]:
    """Milliseconds for a path of every pixel with 1 to 4 bounces, a row for each room."""
    side = stage.either(SIZE, 24)
    pictures, seen = {}, []
    names = ROOMS[: stage.either(None, 1)]
    for room in names:
        stage.told(room)
        scene = presets.get("scenes", room)
        packed = stage.packed(scene)
        for n in range(1, 5):
            pictures[room, n] = stage.picture(packed, side, side, max_bounces=n)
        seen.append(
            [shown(stage.image(packed, side * 3 // 8, side * 3 // 8, 256, max_bounces=n)) for n in range(1, 5)]
        )
    taken = stage.rates(pictures)
    stage.pictures["rooms"] = sheet(seen)
    return [
        {"room": room, "size": side, "ms": [1e3 * taken[room, n] for n in range(1, 5)]} for room in names
    ]  # fmt: skip


def model(stage: Stage) -> dict[str, Any]:
    """The same for the vase, with 0 to 4 bounces."""
    stage.told("a vase of triangles")
    side = stage.either(SIZE, 24)
    packed = stage.packed(vase())
    pictures = {n: stage.picture(packed, side, side, max_bounces=n) for n in range(5)}
    seen = [shown(stage.image(packed, side * 3 // 8, side * 3 // 8, 64, max_bounces=n)) for n in range(5)]
    stage.pictures["model"] = sheet([seen])
    taken = stage.rates(pictures)
    return {"triangles": len(packed.triangles), "size": side, "ms": [1e3 * taken[n] for n in range(5)]}


def vase() -> Document:
    """A solid of revolution of four materials, on a table."""
    shapes: list[Document] = [
        {"type": "quad", "origin": [-30, 0, 30], "u": [60, 0, 0], "v": [0, 0, -60], "material": "table"}
    ]
    outline = _smooth(55)
    first = 0
    for name, share in BANDS:
        last = round(share * (len(outline) - 1))
        vertices, faces = _turned(outline[first : last + 1])
        shapes.append({"type": "mesh", "vertices": vertices, "faces": faces, "material": name})
        first = last
    return {
        "version": 1,
        "camera": {"position": [0, 1.9, 5.2], "target": [0, 1, 0], "vfov": 30},
        "environment": presets.get("environments", "studio"),
        "materials": {**MATERIALS, "table": {"type": "diffuse", "albedo": 0.35}},
        "shapes": shapes,
    }


def _smooth(rings: int) -> np.ndarray:
    """(rings + 1, 2): the outline through a spline of Catmull and Rom [1974]."""
    p = np.array(OUTLINE)
    p = np.vstack([2 * p[0] - p[1], p, 2 * p[-1] - p[-2]])
    t = np.linspace(0, len(OUTLINE) - 1, rings + 1)
    k = np.minimum(t.astype(int), len(OUTLINE) - 2)
    x = (t - k)[:, None]
    a, b, c, d = (p[k + i] for i in range(4))
    out = b + 0.5 * x * (c - a + x * (2 * a - 5 * b + 4 * c - d + x * (3 * (b - c) + d - a)))
    out[:, 0] = np.maximum(out[:, 0], 0.002)  # a ring of no size would be triangles of no area
    out[:, 1] = np.maximum(out[:, 1], 0.0)
    return np.asarray(out)


def _turned(outline: np.ndarray) -> tuple[list[list[float]], list[list[int]]]:
    angle = np.arange(AROUND) * (2 * math.pi / AROUND)
    radius, height = outline[:, 0, None], outline[:, 1, None]
    around = [radius * np.cos(angle), np.broadcast_to(height, (len(outline), AROUND)), radius * np.sin(angle)]
    vertices = np.stack(around, axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(len(outline) - 1), np.arange(AROUND), indexing="ij")
    a, b = i * AROUND + j, i * AROUND + (j + 1) % AROUND
    c, d = a + AROUND, b + AROUND
    faces = np.stack([a, c, b, b, c, d], axis=-1).reshape(-1, 3)
    return vertices.round(5).tolist(), faces.tolist()
