"""Writers of the plainest OpenEXR and PLY files. Their bytes depend on the numbers alone: assets are named by their
hash, and a library would change that with its version.
"""

from __future__ import annotations

import struct

import numpy as np

HALF = 1  # the pixel type of 16-bit floats
MAGIC, VERSION = 20000630, 2


def encode_exr(pixels: np.ndarray) -> bytes:
    """(height, width, 3) radiance, row 0 at the top -> a scan-line EXR file: half floats, no compression.

    [OpenEXR File Layout: magic and version, attributes, line offset table, a block per scan line with its channels in
    the order of the alphabet.]
    """
    height, width, _ = pixels.shape
    header = struct.pack("<ii", MAGIC, VERSION) + b"".join(_attributes(width, height)) + b"\0"
    line_bytes = width * 3 * 2
    starts = len(header) + 8 * height + np.arange(height, dtype="<u8") * (8 + line_bytes)
    lines = np.zeros(height, np.dtype([("y", "<i4"), ("bytes", "<i4"), ("bgr", "<f2", (3, width))]))
    lines["y"], lines["bytes"] = np.arange(height), line_bytes
    lines["bgr"] = pixels[:, :, ::-1].transpose(0, 2, 1)
    return b"".join((header, starts.tobytes(), lines.tobytes()))


def _attributes(width: int, height: int) -> list[bytes]:
    channels = b"".join(name + b"\0" + struct.pack("<iB3xii", HALF, 0, 1, 1) for name in (b"B", b"G", b"R")) + b"\0"
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    return [
        _attribute(b"channels", b"chlist", channels),
        _attribute(b"compression", b"compression", b"\0"),
        _attribute(b"dataWindow", b"box2i", window),
        _attribute(b"displayWindow", b"box2i", window),
        _attribute(b"lineOrder", b"lineOrder", b"\0"),
        _attribute(b"pixelAspectRatio", b"float", struct.pack("<f", 1.0)),
        _attribute(b"screenWindowCenter", b"v2f", struct.pack("<2f", 0.0, 0.0)),
        _attribute(b"screenWindowWidth", b"float", struct.pack("<f", 1.0)),
    ]


def _attribute(name: bytes, kind: bytes, value: bytes) -> bytes:
    return name + b"\0" + kind + b"\0" + struct.pack("<i", len(value)) + value


def encode_ply(columns: dict[str, np.ndarray], faces: np.ndarray) -> bytes:
    """A binary, little-endian PLY file: an attribute (n,) of the vertices for each name, and triangles (m, 3)."""
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
