"""A thousand spheres, laid out as the seeds of a sunflower."""

from __future__ import annotations

import math
from typing import Any

COUNT = 1000
GOLDEN = (math.sqrt(5) - 1) / 2
SPACING = 0.34  # metres; the nearest neighbours in Vogel's spiral are 1.6 times this apart
SUBJECT_RADIUS = 0.95
# Seeds that would lie under the subject, which stands in the middle.
SKIPPED = 14
COLORS = ("#264653", "#2a9d8f", "#e9c46a", "#f4a261", "#e76f51", "#f1ede4", "#6d597a", "#355070")
FINISHES: tuple[dict[str, Any], ...] = (
    {"metallic": 1, "roughness": 0.25},
    {"roughness": 0.3, "clearcoat": 0.6},
    {"roughness": 0.8, "specular": 0.3},
)


def sphere_field() -> dict[str, Any]:
    """The scene document, the same on every call; its middle sphere is the subject."""
    return {
        "title": "Field of 1000 spheres",
        "version": 1,
        "camera": {"position": [0, 4.6, 11.6], "target": [0, 0.05, 0.6], "vfov": 30},
        "environment": {"type": "image", "asset": "builtin:studio", "rotation": -20},
        "materials": {
            "subject": {"type": "disney", "base_color": [0.955, 0.638, 0.538], "metallic": 1, "roughness": 0.12},
            "floor": {"type": "diffuse", "albedo": 0.11},
            **{_name(i): _material(i) for i in range(len(COLORS) * len(FINISHES))},
        },
        "shapes": [
            {"type": "quad", "origin": [-60, 0, 60], "u": [120, 0, 0], "v": [0, 0, -120], "material": "floor"},
            {"type": "sphere", "center": [0, SUBJECT_RADIUS, 0], "radius": SUBJECT_RADIUS, "material": "subject"},
            *(_seed(i) for i in range(1, COUNT)),
        ],
    }


def _seed(i: int) -> dict[str, Any]:
    """[Vogel 1979]: seed n at the distance c sqrt(n), each a golden angle further."""
    n = i + SKIPPED
    distance, angle = SPACING * math.sqrt(n), 2 * math.pi * GOLDEN * n
    # Multiples of irrational numbers, modulo 1, look random and are spread more evenly than random ones.
    radius = round(SPACING * (0.5 + 0.28 * (i * math.sqrt(2) % 1) ** 2), 3)
    center = [round(distance * math.cos(angle), 3), radius, round(distance * math.sin(angle), 3)]
    return {"type": "sphere", "center": center, "radius": radius, "material": _name(i * 7)}


def _name(i: int) -> str:
    return f"color-{i % len(COLORS)}-{i // len(COLORS) % len(FINISHES)}"


def _material(i: int) -> dict[str, Any]:
    return {"type": "disney", "base_color": COLORS[i % len(COLORS)], **FINISHES[i // len(COLORS)]}
