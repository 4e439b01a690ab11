"""Scenes that would be long files of numbers: charts of the parameters of `disney`, and a thousand spheres."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from service.document.presets.encoders import encode_ply

# Charts of the `disney` model's parameters, as in the notes that introduced it [Burley 2012, "Physically Based
# Shading at Disney", figure 16: a row of spheres for each parameter].
STEPS = 11  # spheres of a row: the parameter is 0, .1, ... 1
# What each row's material has besides its own parameter: without specular light a specular tint shows nothing.
ROWS: dict[str, dict[str, Any]] = {
    "base_color": {"roughness": 0.5},
    "subsurface": {"base_color": [0.82, 0.5, 0.36], "roughness": 1, "specular": 0.2},
    "metallic": {"base_color": [0.9, 0.62, 0.26], "roughness": 0.25},
    "specular": {"base_color": [0.28, 0.02, 0.02], "roughness": 0.25},
    "specular_tint": {"base_color": [0.42, 0.03, 0.03], "roughness": 0.25, "specular": 1},
    "roughness": {"base_color": [0.02, 0.12, 0.34], "specular": 1},
    "anisotropic": {"base_color": [0.78, 0.72, 0.6], "metallic": 1, "roughness": 0.45},
    "sheen": {"base_color": [0.006, 0.05, 0.04], "roughness": 1, "specular": 0},
    "sheen_tint": {"base_color": [0.006, 0.05, 0.04], "roughness": 1, "specular": 0, "sheen": 1},
    "clearcoat": {"base_color": [0.14, 0.008, 0.02], "roughness": 1, "specular": 0},
    "clearcoat_gloss": {"base_color": [0.14, 0.008, 0.02], "roughness": 1, "specular": 0, "clearcoat": 1},
}
# A lamp from the front, by whose highlight gloss is judged, and one from behind: sheen is seen against the light.
LAMPS = [
    {"type": "directional", "direction": [0.5, -0.6, -0.8], "irradiance": 2, "angular_diameter": 5},
    {"type": "directional", "direction": [-0.55, -0.35, 1], "irradiance": 5, "angular_diameter": 10},
]
GRID = (0.0, 0.25, 0.5, 0.75, 1.0)
GRID_SPECULAR = (0.0, 0.25, 0.5, 1.0)
RADIUS, PITCH = 0.45, 1.0  # metres
LETTERS = 0.06  # metres of a square of the labels' letters
INK = {"type": "diffuse", "albedo": 0.01}
# The letters of the labels: capitals of three by five squares. Rows from above, three bits each.
GLYPHS = {
    "A": 0o25755, "B": 0o65656, "C": 0o34443, "D": 0o65556, "E": 0o74647, "F": 0o74644, "G": 0o34553, "H": 0o55755,
    "I": 0o72227, "L": 0o44447, "M": 0o57755, "N": 0o65555, "O": 0o25552, "P": 0o65644, "R": 0o65655, "S": 0o34216,
    "T": 0o72222, "U": 0o55557, "0": 0o25552, "1": 0o26227, "2": 0o61247, "5": 0o74616, "7": 0o71222, ".": 0o00002,
    " ": 0,
}  # fmt: skip
ADVANCE = 4  # squares from one letter to the next


def parameter_rows() -> dict[str, Any]:
    """A row for each parameter, from 0 on the left to 1 on the right; base_color goes from black to white."""
    materials, shapes = dict[str, Any](), list[dict[str, Any]]()
    for row, (parameter, others) in enumerate(ROWS.items()):
        for step in range(STEPS):
            value = round(step / (STEPS - 1), 3)
            name = f"{parameter.replace('_', ' ').replace('color', 'colour').capitalize()} {value:.1f}"
            materials[name] = {"type": "disney", **others, parameter: value}
            shapes.append(_ball(step - (STEPS - 1) / 2, (len(ROWS) - 1) / 2 - row, name))
    chart = _chart("Disney parameters, 0 to 1", "disney-parameters-labels", materials, shapes, distance=26.5)
    chart["camera"] |= {"position": [-1.6, 0.2, 26.5], "target": [-1.6, 0.2, 0]}  # labels stand on the left
    return chart | {"lights": LAMPS}


def parameter_labels() -> bytes:
    """Labels: each row's on its left, and 0, 0.5 and 1 above the columns."""
    end, top = (STEPS - 1) / 2, (len(ROWS) - 1) / 2
    rows = [(name.replace("_", " "), -end - 0.75, top - row, 1.0) for row, name in enumerate(ROWS)]
    return written([*rows, *((f"{x + 0.5:g}", x * 2 * end, top + 0.85, 0.5) for x in (-0.5, 0.0, 0.5))], LETTERS)


def parameter_grid() -> dict[str, Any]:
    """Four blocks, specular 0 and 0.25 above 0.5 and 1; in each roughness grows to the right, metallic upwards."""
    materials, shapes = dict[str, Any](), list[dict[str, Any]]()
    middle, apart = (len(GRID) - 1) / 2, len(GRID) + 0.6
    for block, specular in enumerate(GRID_SPECULAR):
        for row, metallic in enumerate(GRID):
            for column, roughness in enumerate(GRID):
                name = f"Metallic {metallic:g}, roughness {roughness:g}, specular {specular:g}"
                materials[name] = {
                    "type": "disney",
                    "base_color": [0.75, 0.34, 0.16],
                    "metallic": metallic,
                    "roughness": roughness,
                    "specular": specular,
                }
                x, y = (block % 2 - 0.5) * apart, (0.5 - block // 2) * apart
                shapes.append(_ball(x + column - middle, y + row - middle, name))
    title = "Disney grid: metallic, roughness, specular"
    chart = _chart(title, "disney-grid-labels", materials, shapes, distance=24.6)
    chart["camera"] |= {"position": [-0.5, -0.15, 24.6], "target": [-0.5, -0.15, 0]}
    return chart


def grid_labels() -> bytes:
    """Labels of each block: its specular above it, the roughness below, the metallic on the left."""
    apart, reach = len(GRID) + 0.6, (len(GRID) - 1) / 2
    lines = []
    for block, specular in enumerate(GRID_SPECULAR):
        x, y = (block % 2 - 0.5) * apart, (0.5 - block // 2) * apart
        lines.append((f"specular {specular:g}", x, y + reach + 0.72, 0.5))
        if block // 2:
            lines += [(f"{value:g}", x + k - reach, y - reach - 0.7, 0.5) for k, value in enumerate(GRID)]
            lines.append(("roughness", x, y - reach - 1.1, 0.5))
        if not block % 2:
            lines += [(f"{value:g}", x - reach - 0.65, y + k - reach, 1.0) for k, value in enumerate(GRID)]
            lines.append(("metallic", x - reach - 0.55, y + reach + 0.72, 1.0))
    return written(lines, 0.8 * LETTERS)


def _ball(x: float, y: float, material: str) -> dict[str, Any]:
    center = [round(x * PITCH, 3), round(y * PITCH, 3), 0]
    return {"type": "sphere", "center": center, "radius": RADIUS, "material": material}


def _chart(
    title: str, labels: str, materials: dict[str, Any], shapes: list[dict[str, Any]], distance: float
) -> dict[str, Any]:
    """Nothing stands between the spheres and the studio's lamps but other spheres."""
    return {
        "title": title,
        "group": "Tests",
        "version": 1,
        # A long lens: all spheres are seen and lit nearly alike.
        "camera": {"position": [0, 0, distance], "target": [0, 0, 0], "vfov": 28},
        "environment": {"type": "image", "asset": "builtin:studio", "rotation": -20},
        "materials": materials | {"Ink": INK},
        "shapes": [*shapes, {"name": "Labels", "type": "mesh", "asset": f"builtin:{labels}", "material": "Ink"}],
    }


def written(lines: list[tuple[str, float, float, float]], size: float) -> bytes:
    """A binary PLY in the plane z = 0 that faces +Z. `lines`: (words, x, y, side) about whose middle height y they
    stand; `side` is where x lies in them: 0 at their left end, 1 at the right one. `size`: metres of a square."""
    corners = np.concatenate(
        [_squares(words) * size + _start(words, x, y, side, size) for words, x, y, side in lines]
    )
    flat = np.concatenate([corners, np.zeros_like(corners[..., :1])], axis=-1).reshape(-1, 3).round(6) + 0.0
    first = np.arange(len(corners))[:, None] * 4
    faces = np.concatenate([first + np.array(half) for half in ((0, 1, 2), (0, 2, 3))])
    return encode_ply(dict(zip("xyz", flat.T, strict=True)), faces)


def _start(words: str, x: float, y: float, side: float, size: float) -> tuple[float, float]:
    return x - side * (len(words) * ADVANCE - 1) * size, y - 2.5 * size


def _squares(words: str) -> np.ndarray:
    """The corners of all squares that are black, (n, 4, 2), counter-clockwise."""
    places = [
        (ADVANCE * k + column, 4 - row)
        for k, letter in enumerate(words.upper())
        for row in range(5)
        for column in range(3)
        if GLYPHS[letter] >> (3 * (4 - row) + 2 - column) & 1
    ]
    return np.array(places, dtype=float)[:, None] + [[0, 0], [1, 0], [1, 1], [0, 1]]


# A thousand spheres, laid out as the seeds of a sunflower.
FIELD_COUNT = 1000
GOLDEN = (math.sqrt(5) - 1) / 2
SPACING = 0.34  # metres; the nearest neighbours in Vogel's spiral are 1.6 times this apart
SUBJECT_RADIUS = 0.95
# Seeds that would lie under the subject, which stands in the middle.
SKIPPED = 14
FIELD_COLORS = {
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
FIELD_MATERIALS = {
    f"{hue} {finish}": {"type": "disney", "base_color": color, **how}
    for finish, how in FINISHES.items()
    for hue, color in FIELD_COLORS.items()
}
FIELD_NAMES = tuple(FIELD_MATERIALS)


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
            **{name: dict(material) for name, material in FIELD_MATERIALS.items()},
        },
        "shapes": [
            {"type": "quad", "origin": [-60, 0, 60], "u": [120, 0, 0], "v": [0, 0, -120], "material": "Floor"},
            {"type": "sphere", "center": [0, SUBJECT_RADIUS, 0], "radius": SUBJECT_RADIUS, "material": "Copper"},
            *(_seed(i) for i in range(1, FIELD_COUNT)),
        ],
    }


def _seed(i: int) -> dict[str, Any]:
    """[Vogel 1979]: seed n at the distance c sqrt(n), each a golden angle further."""
    n = i + SKIPPED
    distance, angle = SPACING * math.sqrt(n), 2 * math.pi * GOLDEN * n
    # Multiples of irrational numbers, modulo 1, look random and are spread more evenly than random ones.
    radius = round(SPACING * (0.5 + 0.28 * (i * math.sqrt(2) % 1) ** 2), 3)
    center = [round(distance * math.cos(angle), 3), radius, round(distance * math.sin(angle), 3)]
    return {"type": "sphere", "center": center, "radius": radius, "material": FIELD_NAMES[i * 7 % len(FIELD_NAMES)]}
