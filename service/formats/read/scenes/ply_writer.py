"""A mesh as a PLY file for the store. The same triangles always give the same bytes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from service.formats.read.ply import ALPHA, GROUP
from service.formats.read.raw_mesh import Numbers
from service.formats.types import Indices


def ply(
    vertices: Numbers,
    faces: Indices,
    normals: Numbers | None = None,
    uvs: Sequence[Numbers | None] = (),
    colors: Numbers | None = None,
    tangents: Numbers | None = None,
    groups: npt.NDArray[np.integer] | None = None,
) -> bytes:
    """A binary, little-endian file of vertices (n, 3), triangles (m, 3) and attributes of the vertices.

    `uvs` are at most two sets (n, 2), v pointing up; `colors` (n, 3 or 4) linear; `tangents` (n, 4); `groups` (m,)
    the smoothing group of each triangle.
    """
    columns = {"x": vertices[:, 0], "y": vertices[:, 1], "z": vertices[:, 2]}
    if normals is not None:
        columns |= {f"n{axis}": normals[:, k] for k, axis in enumerate("xyz")}
    if tangents is not None:
        columns |= {f"t{axis}": tangents[:, k] for k, axis in enumerate("xyzw")}
    for names, chart in zip((("s", "t"), ("s1", "t1")), uvs, strict=False):
        if chart is not None:
            columns |= {name: chart[:, k] for k, name in enumerate(names)}
    if colors is not None:
        channels = ("red", "green", "blue", ALPHA)[: colors.shape[1]]
        columns |= {name: colors[:, k] for k, name in enumerate(channels)}
    rows = np.empty(len(vertices), [(name, "<f4") for name in columns])
    for name, column in columns.items():
        rows[name] = column
    beside = [] if groups is None else [("group", "<i4")]
    triangles = np.empty(len(faces), [("count", "u1"), ("corners", "<i4", (3,)), *beside])
    triangles["count"], triangles["corners"] = 3, faces
    if groups is not None:
        triangles["group"] = groups
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(rows)}\n"
        + "".join(f"property float {name}\n" for name in columns)
        + f"element face {len(triangles)}\nproperty list uchar int vertex_indices\n"
        + ("" if groups is None else f"property int {GROUP}\n")
        + "end_header\n"
    )
    return b"".join([header.encode(), rows.data, triangles.data])
