"""Lit models as glTF files, in the units that Blender writes."""

from __future__ import annotations

from typing import Any

import numpy as np

from tests.gltf_files import QUAD, QUAD_FACES, Gltf

LIGHTS = "KHR_lights_punctual"
BLENDER_LAMP = {"type": "point", "intensity": 54351.41306588226}  # Blender's start-up lamp of 1 000 W
SUN = {"type": "directional", "intensity": 6830}  # Blender's sun of 10 W/m^2


def placed(axes: Any, at: Any) -> list[float]:
    """A node's matrix with these columns."""
    return np.column_stack([np.vstack([np.transpose(axes), np.zeros(3)]), [*at, 1]]).T.reshape(-1).tolist()


def looking(position: Any, target: Any) -> list[float]:
    """The matrix of a node whose -z runs from the one point to the other."""
    z = np.subtract(position, target) / np.linalg.norm(np.subtract(position, target))
    x = np.cross([0, 1, 0], z) / np.linalg.norm(np.cross([0, 1, 0], z))
    return placed([x, np.cross(z, x), z], position)


def wall(file: Gltf, middle: Any, u: Any, v: Any) -> None:
    """A parallelogram of the first material, u and v being half its edges."""
    file.node(mesh=0, matrix=placed([u, v, np.cross(u, v)], middle))


def lit(file: Gltf, light: dict[str, Any], matrix: list[float]) -> None:
    lights = file.tree.setdefault("extensions", {}).setdefault(LIGHTS, {"lights": []})["lights"]
    file.node(extensions={LIGHTS: {"light": len(lights)}}, matrix=matrix)
    lights.append(light)


def seen(file: Gltf, position: Any, target: Any, aspect: float = 1.5, yfov: float = 0.7) -> Gltf:
    lens = {"yfov": yfov, "znear": 0.1, "aspectRatio": aspect}
    file.node(
        camera=file.add("cameras", {"type": "perspective", "perspective": lens}), matrix=looking(position, target)
    )
    return file


def plastered(albedo: float = 0.8) -> Gltf:
    file = Gltf()
    rough = {"baseColorFactor": [albedo] * 3 + [1], "metallicFactor": 0, "roughnessFactor": 1}
    material = file.add("materials", {"doubleSided": True, "pbrMetallicRoughness": rough})
    file.mesh(file.primitive({"POSITION": QUAD}, QUAD_FACES, material=material))
    return file


def start_up(light: dict[str, Any], aspect: float = 1.5) -> Gltf:
    """Blender's: a cube of 2 m, a lamp and a camera 7 and 11 m away."""
    file = plastered()
    for axis in range(3):
        u, v = np.roll(np.eye(3), axis, axis=0)[:2]
        for side in (-1, 1):
            wall(file, side * np.cross(u, v), u, v)
    lit(file, light, looking([4.08, 5.9, -1.01], [0, 0, 0]))
    return seen(file, [7.36, 4.96, 6.93], [0, 0, 0], aspect, 0.4)


def room(sun: dict[str, Any] = SUN) -> Gltf:
    """Four metres wide; the sun comes in by a window of 1.5 m x 1.2 m, and most of what is seen lies in the shade."""
    file = plastered(0.7)
    wall(file, [2, 0, 2.5], [2, 0, 0], [0, 0, 2.5])
    wall(file, [2, 3, 2.5], [2, 0, 0], [0, 0, 2.5])
    wall(file, [4, 1.5, 2.5], [0, 1.5, 0], [0, 0, 2.5])
    wall(file, [2, 1.5, 0], [2, 0, 0], [0, 1.5, 0])
    wall(file, [2, 1.5, 5], [2, 0, 0], [0, 1.5, 0])
    wall(file, [0, 1.5, 0.75], [0, 1.5, 0], [0, 0, 0.75])
    wall(file, [0, 1.5, 4], [0, 1.5, 0], [0, 0, 1])
    wall(file, [0, 0.5, 2.25], [0, 0.5, 0], [0, 0, 0.75])
    wall(file, [0, 2.6, 2.25], [0, 0.4, 0], [0, 0, 0.75])
    lit(file, sun, looking([-3, 3, 1.8], [0, 1, 2.2]))
    return seen(file, [3.5, 1.6, 4.7], [1.5, 1.1, 1], 4 / 3, 0.9)
