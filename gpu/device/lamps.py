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
    for kind, middles, areas in _shapes(arrays):
        mine = kinds == kind
        radiance = arrays.materials["emission"][lights["material"][mine]] @ LUMINANCE
        place[mine], intensity[mine] = middles[lights["index"][mine]], areas[lights["index"][mine]] * radiance
    first = np.argsort(-intensity, kind="stable")[:MOST]
    out = np.zeros((4, MOST), np.float32)
    out[:3, : len(first)], out[3, : len(first)] = place[first].T, intensity[first]
    return out


def _shapes(arrays: SceneArrays) -> list[tuple[LightKind, np.ndarray, np.ndarray]]:
    """The middles (n, 3) and the areas (n,), as they are seen, of the shapes of each kind of light."""
    balls, quads, corners = arrays.spheres, arrays.quads, arrays.triangles
    a, b, c = (corners[name].astype(float) for name in ("v0", "v1", "v2"))
    out = [
        (LightKind.SPHERE, balls["center"], np.pi * balls["radius"].astype(float) ** 2),
        (LightKind.QUAD, quads["origin"] + 0.5 * (quads["u"] + quads["v"]), quads["area"]),
        (LightKind.TRIANGLE, (a + b + c) / 3, 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)),
    ]
    for kind, solids in ((LightKind.ELLIPSOID, arrays.ellipsoids), (LightKind.CYLINDER, arrays.boxes)):
        rows = np.stack([solids[f"row_{axis}"] for axis in "xyz"], axis=1).astype(float)
        shrinks = np.abs(np.linalg.det(rows)) if len(rows) else np.zeros(0)  # of volumes, to a unit ball or cube
        out.append((kind, solids["center"], np.pi * np.maximum(shrinks, 1e-30) ** (-2 / 3)))
    return out
