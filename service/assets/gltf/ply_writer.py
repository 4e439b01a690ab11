"""A primitive as a PLY file: what our own store keeps of each. The same triangles always give the same bytes."""

from __future__ import annotations

import numpy as np

from service.assets.gltf.primitives import Primitive
from service.assets.readers.ply import ALPHA


def ply(primitive: Primitive) -> bytes:
    """Binary, little-endian; v points up, colours are linear floats."""
    columns = {"x": primitive.vertices[:, 0], "y": primitive.vertices[:, 1], "z": primitive.vertices[:, 2]}
    if primitive.normals is not None:
        columns |= {f"n{axis}": primitive.normals[:, k] for k, axis in enumerate("xyz")}
    if primitive.tangents is not None:
        columns |= {f"t{axis}": primitive.tangents[:, k] for k, axis in enumerate("xyzw")}
    for names, uvs in zip((("s", "t"), ("s1", "t1")), primitive.uvs, strict=True):
        if uvs is not None:
            columns |= {names[0]: uvs[:, 0], names[1]: 1 - uvs[:, 1]}
    if primitive.colors is not None:
        channels = ("red", "green", "blue", ALPHA)[: primitive.colors.shape[1]]
        columns |= {name: primitive.colors[:, k] for k, name in enumerate(channels)}
    vertices = np.empty(len(primitive.vertices), [(name, "<f4") for name in columns])
    for name, column in columns.items():
        vertices[name] = column
    faces = np.empty(len(primitive.faces), [("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, primitive.faces
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n"
        + "".join(f"property float {name}\n" for name in columns)
        + f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    return b"".join([header.encode(), vertices.data, faces.data])
