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
COLORS = {
    "Petrol": "#264653",
    "Teal": "#2a9d8f",
    "Saffron": "#e9c46a",
    "Apricot": "#f4a261",
    "Coral": "#e76f51",
    "Ivory": "#f1ede4",
    "Plum": "#6d597a",
    "Indigo": "#355070",
}
FINISHES: dict[str, dict[str, Any]] = {
    "metal": {"metallic": 1, "roughness": 0.25},
    "lacquer": {"roughness": 0.3, "clearcoat": 0.6},
    "chalk": {"roughness": 0.8, "specular": 0.3},
}
MATERIALS = {
    f"{hue} {finish}": {"type": "disney", "base_color": color, **how}
    for finish, how in FINISHES.items()
    for hue, color in COLORS.items()
}
NAMES = tuple(MATERIALS)


def sphere_field() -> dict[str, Any]:
    """The scene document, the same on every call; its middle sphere is the subject."""
    return {
        "title": "Field of 1000 spheres",
        "version": 1,
        "camera": {"position": [0, 4.6, 11.6], "target": [0, 0.05, 0.6], "vfov": 30},
        "environment": {"type": "image", "asset": "builtin:studio", "rotation": -20},
        "materials": {
            "Copper": {"type": "disney", "base_color": [0.955, 0.638, 0.538], "metallic": 1, "roughness": 0.12},
            "Floor": {"type": "diffuse", "albedo": 0.11},
            **{name: dict(material) for name, material in MATERIALS.items()},
        },
        "shapes": [
            {"type": "quad", "origin": [-60, 0, 60], "u": [120, 0, 0], "v": [0, 0, -120], "material": "Floor"},
            {"type": "sphere", "center": [0, SUBJECT_RADIUS, 0], "radius": SUBJECT_RADIUS, "material": "Copper"},
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
    return {"type": "sphere", "center": center, "radius": radius, "material": NAMES[i * 7 % len(NAMES)]}
