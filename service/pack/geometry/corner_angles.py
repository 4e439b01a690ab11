"""The loop over a mesh's faces that finds the normals of its positions. Importing it loads numba: half a second."""

from __future__ import annotations

import math

import numpy as np

from gpu.jit import jit


@jit
def add_faces(vertices: np.ndarray, faces: np.ndarray, joined: np.ndarray, sums: np.ndarray) -> None:
    """Add each face's unit normal times its angle at each corner to the row of `sums` (k, 3) that `joined` (m, 3)
    names: that of the corner's position. A face without an area adds nothing."""
    edges = np.empty((3, 3))
    for face in range(len(faces)):
        for k in range(3):
            corner, following = faces[face, k], faces[face, (k + 1) % 3]
            for axis in range(3):
                edges[k, axis] = vertices[following, axis] - vertices[corner, axis]
        x = edges[0, 1] * edges[1, 2] - edges[0, 2] * edges[1, 1]
        y = edges[0, 2] * edges[1, 0] - edges[0, 0] * edges[1, 2]
        z = edges[0, 0] * edges[1, 1] - edges[0, 1] * edges[1, 0]
        twice_area = math.sqrt(x * x + y * y + z * z)
        if twice_area > 0.0:
            for k in range(3):
                along = edges[k, 0] * edges[k - 1, 0] + edges[k, 1] * edges[k - 1, 1] + edges[k, 2] * edges[k - 1, 2]
                weight = math.atan2(twice_area, -along) / twice_area
                row = joined[face, k]
                sums[row, 0] += weight * x
                sums[row, 1] += weight * y
                sums[row, 2] += weight * z
