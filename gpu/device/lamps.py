"""The lamps that distances in media are drawn towards: shaders/path/equiangular.glsl."""

from __future__ import annotations

import numpy as np

from gpu.arrays import SceneArrays
from gpu.layout import LUMINANCE, LightKind

MOST = 4  # as a vec4 has
MEMBERS = ("lamps_x", "lamps_y", "lamps_z", "lamps_intensity")  # of `layout.Uniforms`


def brightest(arrays: SceneArrays) -> np.ndarray:
    """(4, MOST) float32: x, y, z and the intensity, W / sr of luminance, of the brightest lamps that have a place. Of
    shapes they are the middle and the greatest intensity, about; 0 where there are fewer."""
    lights = arrays.lights
    place, intensity = np.zeros((len(lights), 3)), np.zeros(len(lights))
    kinds = lights["kind"]
    points = (kinds == LightKind.POINT) | (kinds == LightKind.SPOT)
    place[points], intensity[points] = lights["position"][points], lights["intensity"][points] @ LUMINANCE
    for kind, records, described in (
        (LightKind.SPHERE, arrays.spheres, _balls),
        (LightKind.QUAD, arrays.quads, _quads),
        (LightKind.TRIANGLE, arrays.triangles, _triangles),
        (LightKind.ELLIPSOID, arrays.ellipsoids, _solids),
        (LightKind.CYLINDER, arrays.boxes, _solids),
    ):
        mine = np.flatnonzero(kinds == kind)  # of all triangles of a scene few may shine
        if len(mine):
            place[mine], areas = described(records[lights["index"][mine]])
            intensity[mine] = areas * (arrays.materials["emission"][lights["material"][mine]] @ LUMINANCE)
    first = np.argsort(-intensity, kind="stable")[:MOST]
    out = np.zeros((4, MOST), np.float32)
    out[:3, : len(first)], out[3, : len(first)] = place[first].T, intensity[first]
    return out


# Of shapes: their middles (n, 3), and their areas (n,) as they are seen.


def _balls(balls: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return balls["center"], np.pi * balls["radius"].astype(float) ** 2


def _quads(quads: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return quads["origin"] + 0.5 * (quads["u"] + quads["v"]), quads["area"]


def _triangles(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    a, b, c = (triangles[name].astype(float) for name in ("v0", "v1", "v2"))
    return (a + b + c) / 3, 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)


def _solids(solids: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """As balls of the same volume."""
    rows = np.stack([solids[f"row_{axis}"] for axis in "xyz"], axis=1).astype(float)  # object from world
    return solids["center"], np.pi * np.maximum(np.abs(np.linalg.det(rows)), 1e-30) ** (-2 / 3)
