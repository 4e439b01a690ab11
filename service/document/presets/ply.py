"""A writer of the plainest PLY files. Its bytes depend on the numbers alone, as assets are named by their hash."""

from __future__ import annotations

import numpy as np


def encode(columns: dict[str, np.ndarray], faces: np.ndarray) -> bytes:
    """A binary, little-endian file: an attribute (n,) of the vertices for each name, and triangles (m, 3)."""
    vertices = np.stack(list(columns.values()), axis=1).astype("<f4")
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(vertices)}\n"
        + "".join(f"property float {name}\n" for name in columns)
        + f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    records = np.zeros(len(faces), np.dtype([("count", "u1"), ("indices", "<i4", 3)]))
    records["count"], records["indices"] = 3, faces
    return header.encode() + vertices.tobytes() + records.tobytes()
