"""The lamps that distances in media are drawn towards: shaders/path/equiangular.glsl."""

from __future__ import annotations

import numpy as np

from gpu.arrays import SceneArrays
from gpu.kernels.light_kinds import KINDS, OF_SHAPES, POINTS
from gpu.kernels.shape_kinds import records
from gpu.layout import LUMINANCE

MOST = 4  # as a vec4 has
MEMBERS = ("lamps_x", "lamps_y", "lamps_z", "lamps_intensity")  # of `layout.Uniforms`


def brightest(arrays: SceneArrays) -> np.ndarray:
    """(4, MOST) float32: x, y, z and the intensity, W / sr of luminance, of the brightest lamps that have a place. Of
    shapes they are the middle and the greatest intensity, about; 0 where there are fewer."""
    lights = arrays.lights
    place, intensity = np.zeros((len(lights), 3)), np.zeros(len(lights))
    kinds = lights["kind"]
    points = np.isin(kinds, POINTS)
    place[points], intensity[points] = lights["position"][points], lights["intensity"][points] @ LUMINANCE
    for kind in OF_SHAPES:
        mine, row = np.flatnonzero(kinds == kind), KINDS[kind]  # of all triangles of a scene few may shine
        if len(mine):
            assert row.shape is not None and row.seen is not None
            place[mine], areas = row.seen(records(arrays, row.shape)[lights["index"][mine]])
            intensity[mine] = areas * (arrays.materials["emission"][lights["material"][mine]] @ LUMINANCE)
    first = np.argsort(-intensity, kind="stable")[:MOST]
    out = np.zeros((4, MOST), np.float32)
    out[:3, : len(first)], out[3, : len(first)] = place[first].T, intensity[first]
    return out
