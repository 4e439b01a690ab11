"""Files written and read byte by byte, independent of the libraries under test: sound ones, and ones that lie."""

from __future__ import annotations

import base64
import json
import struct
import zlib
from typing import Any

import numpy as np

OBJ = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
TRIANGLE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4")


def gltf(nodes: list[dict[str, Any]] | None = None, **changes: Any) -> dict[str, Any]:
    """One triangle in the plane z = 0, seen from +z, indexed, with normals; 36 + 36 + 12 bytes of buffer."""
    tree = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": nodes or [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 2, "componentType": 5125, "count": 3, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 36},
            {"buffer": 0, "byteOffset": 36, "byteLength": 36},
            {"buffer": 0, "byteOffset": 72, "byteLength": 12},
        ],
        "buffers": [{"byteLength": 84}],
    }
    return tree | changes


def gltf_buffer() -> bytes:
    normals = np.tile(np.array([0, 0, 1], "<f4"), (3, 1))
    return TRIANGLE.tobytes() + normals.tobytes() + np.arange(3, dtype="<u4").tobytes()


def glb(tree: dict[str, Any], buffer: bytes | None = None) -> bytes:
    binary = gltf_buffer() if buffer is None else buffer
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    body = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(binary), 0x004E4942) + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def draco_glb(vertices: np.ndarray, faces: np.ndarray, normals: np.ndarray) -> bytes:
    import DracoPy

    blob = DracoPy.encode(vertices, faces=faces, normals=normals, quantization_bits=14)
    ids = {a["attribute_type"]: a["unique_id"] for a in DracoPy.decode(blob).attributes}
    extension = {"bufferView": 0, "attributes": {"POSITION": ids[0], "NORMAL": ids[1]}}
    primitive = {
        "attributes": {"POSITION": 0, "NORMAL": 1},
        "indices": 2,
        "extensions": {"KHR_draco_mesh_compression": extension},
    }
    count = {"componentType": 5126, "count": len(vertices), "type": "VEC3"}
    accessors = [count, count, {"componentType": 5125, "count": faces.size, "type": "SCALAR"}]
    return glb(
        gltf(
            accessors=accessors,
            bufferViews=[{"buffer": 0, "byteLength": len(blob)}],
            buffers=[{"byteLength": len(blob)}],
            meshes=[{"primitives": [primitive]}],
            extensionsRequired=["KHR_draco_mesh_compression"],
        ),
        blob,
    )


def embedded(tree: dict[str, Any]) -> bytes:
    uri = "data:application/octet-stream;base64," + base64.b64encode(gltf_buffer()).decode()
    return json.dumps(tree | {"buffers": [{"byteLength": 84, "uri": uri}]}).encode()


def ply(
    vertices: np.ndarray,
    faces: list[list[int]],
    order: str = "<",
    more: dict[str, np.ndarray] | None = None,
    kind: str = "float",
) -> bytes:
    """Binary in the byte order `<` or `>`, or text for `a`; a scalar stands before each face's list.

    `more`: columns by `st` or `rgb`, the latter of type `kind`.
    """
    encodings = {"<": "binary_little_endian", ">": "binary_big_endian", "a": "ascii"}
    columns = [(name, "float", vertices[:, k]) for k, name in enumerate("xyz")]
    for names, values in (more or {}).items():
        long = {"r": "red", "g": "green", "b": "blue"}
        columns += [(long.get(n, n), kind if n in long else "float", values[:, k]) for k, n in enumerate(names)]
    header = (
        f"ply\nformat {encodings[order]} 1.0\ncomment made by hand\nelement vertex {len(vertices)}\n"
        + "".join(f"property {kind} {name}\n" for name, kind, _ in columns)
        + f"element face {len(faces)}\nproperty uchar flags\nproperty list uchar int vertex_indices\nend_header\n"
    ).encode()
    if order == "a":
        rows = [*zip(*(column.tolist() for _, _, column in columns), strict=True), *([7, len(f), *f] for f in faces)]
        return header + "\n".join(" ".join(map(str, row)) for row in rows).encode() + b"\n"
    packed = np.zeros(len(vertices), [(n, order + {"float": "f4", "uchar": "u1"}[t]) for n, t, _ in columns])
    for name, _, column in columns:
        packed[name] = column
    body = b"".join(struct.pack(f"{order}BB{len(f)}i", 7, len(f), *f) for f in faces)
    return header + packed.tobytes() + body


def stl(triangles: np.ndarray) -> bytes:
    rows = np.zeros(len(triangles), [("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")])
    rows["v"] = triangles
    return b"\0" * 80 + struct.pack("<I", len(triangles)) + rows.tobytes()


def stl_text(triangles: np.ndarray) -> bytes:
    facets = "".join(
        "facet normal 0 0 0\nouter loop\n" + "".join(f"vertex {x} {y} {z}\n" for x, y, z in t) + "endloop\nendfacet\n"
        for t in triangles
    )
    return f"solid thing\n{facets}endsolid thing\n".encode()


def png(pixels: np.ndarray, width: int | None = None, height: int | None = None) -> bytes:
    """8 or 16 bits after the dtype; the header may claim another size."""
    h, w, c = pixels.shape
    bits = pixels.dtype.itemsize * 8
    colour = {1: 0, 2: 4, 3: 2, 4: 6}[c]
    rows = b"".join(b"\0" + row.astype(f">u{bits // 8}").tobytes() for row in pixels)
    return (
        b"\x89PNG\r\n\x1a\n"
        + _chunk(b"IHDR", struct.pack(">IIBBBBB", width or w, height or h, bits, colour, 0, 0, 0))
        + _chunk(b"IDAT", zlib.compress(rows, 9))
        + _chunk(b"IEND", b"")
    )


def low_png(rows: list[int], width: int, bits: int, gamma: float | None = None) -> bytes:
    """One line of grey, its bytes as given, of so many bits a texel."""
    header = struct.pack(">IIBBBBB", width, 1, bits, 0, 0, 0, 0)
    gammas = b"" if gamma is None else _chunk(b"gAMA", struct.pack(">I", round(gamma * 100000)))
    body = _chunk(b"IDAT", zlib.compress(b"\0" + bytes(rows)))
    return b"\x89PNG\r\n\x1a\n" + _chunk(b"IHDR", header) + gammas + body + _chunk(b"IEND", b"")


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def read_png(data: bytes) -> np.ndarray:
    """(h, w, channels) uint8 or uint16, not interlaced; every filter."""
    at, packed, header = 8, b"", (0, 0, 0, 0, 0, 0, 0)
    while at < len(data):
        size, kind = struct.unpack_from(">I4s", data, at)
        body = data[at + 8 : at + 8 + size]
        assert zlib.crc32(kind + body) == struct.unpack_from(">I", data, at + 8 + size)[0]
        header = struct.unpack(">IIBBBBB", body) if kind == b"IHDR" else header
        packed += body if kind == b"IDAT" else b""
        at += 12 + size
    w, h, bits, colour = header[:4]
    c = {0: 1, 2: 3, 4: 2, 6: 4}[colour]
    step = c * bits // 8
    raw = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(h, 1 + w * step).astype(int)
    out = np.zeros((h + 1, (w + 1) * step), int)  # a row above and a pixel to the left, both zero
    for y in range(h):
        for i in range(step, (w + 1) * step):
            a, b, corner = out[y + 1, i - step], out[y, i], out[y, i - step]
            estimate = a + b - corner
            nearest = min((abs(estimate - a), 0, a), (abs(estimate - b), 1, b), (abs(estimate - corner), 2, corner))
            guess = (0, a, b, (a + b) // 2, nearest[2])[raw[y, 0]]
            out[y + 1, i] = (raw[y, 1 + i - step] + guess) & 255
    bytes_ = out[1:, step:].astype(np.uint8)
    return bytes_.reshape(-1).view(f">u{bits // 8}").reshape(h, w, c)


def exr(
    pixels: np.ndarray,
    window: tuple[int, int, int, int] | None = None,
    more: tuple[tuple[bytes, bytes, bytes], ...] = (),
) -> bytes:
    """Float, uncompressed, channels R G B; the data window may lie or lie elsewhere in the display window. `more` are
    attributes: name, type and value."""
    h, w, _ = pixels.shape
    left, top, right, bottom = window or (0, 0, w - 1, h - 1)
    channels = b"".join(n + b"\0" + struct.pack("<IBBBBII", 2, 0, 0, 0, 0, 1, 1) for n in (b"B", b"G", b"R")) + b"\0"
    header = struct.pack("<II", 20000630, 2) + b"".join(
        name + b"\0" + kind + b"\0" + struct.pack("<I", len(value)) + value
        for name, kind, value in (
            (b"channels", b"chlist", channels),
            (b"compression", b"compression", b"\0"),
            (b"dataWindow", b"box2i", struct.pack("<iiii", left, top, right, bottom)),
            (b"displayWindow", b"box2i", struct.pack("<iiii", 0, 0, w - 1, h - 1)),
            (b"lineOrder", b"lineOrder", b"\0"),
            (b"pixelAspectRatio", b"float", struct.pack("<f", 1)),
            (b"screenWindowCenter", b"v2f", struct.pack("<ff", 0, 0)),
            (b"screenWindowWidth", b"float", struct.pack("<f", 1)),
            *more,
        )
    )
    start = len(header) + 1 + 8 * h
    table = b"".join(struct.pack("<Q", start + y * (8 + 12 * w)) for y in range(h))
    rows = b"".join(
        struct.pack("<iI", top + y, 12 * w) + pixels[y, :, ::-1].T.astype("<f4").tobytes() for y in range(h)
    )
    return header + b"\0" + table + rows


def read_exr(data: bytes) -> dict[str, np.ndarray]:
    """Channels by name, of a file with float channels and ZIP compression in blocks of 16 scan lines."""
    assert struct.unpack_from("<II", data) == (20000630, 2)
    at, found = 8, {}
    while data[at]:
        name, kind, rest = data[at:].split(b"\0", 2)
        (size,) = struct.unpack_from("<I", rest)
        at += len(name) + len(kind) + 6
        found[name] = data[at : at + size]
        at += size
    names, listed = [], found[b"channels"]
    while listed[:1] != b"\0":
        name, _, rest = listed.partition(b"\0")
        assert struct.unpack_from("<I", rest) == (2,)
        names.append(name.decode())
        listed = rest[16:]
    assert found[b"compression"] == b"\3"
    left, top, right, bottom = struct.unpack("<iiii", found[b"dataWindow"])
    w, h = right - left + 1, bottom - top + 1
    planes = np.zeros((h, len(names), w), "<f4")
    for block in range(-(-h // 16)):
        (offset,) = struct.unpack_from("<Q", data, at + 1 + 8 * block)
        y, size = struct.unpack_from("<iI", data, offset)
        rows = min(16, h - y)
        body = data[offset + 8 : offset + 8 + size]
        planes[y : y + rows] = _unzipped(body, rows * len(names) * w * 4).view("<f4").reshape(rows, len(names), w)
    return {name: planes[:, k] for k, name in enumerate(names)}


def _unzipped(body: bytes, size: int) -> np.ndarray:
    if len(body) == size:  # stored as it is where deflating gained nothing
        return np.frombuffer(body, np.uint8)
    deltas = np.frombuffer(zlib.decompress(body), np.uint8).astype(np.int64)
    deltas[1:] -= 128
    halves = (np.cumsum(deltas) & 255).astype(np.uint8)
    out = np.empty(size, np.uint8)
    out[0::2], out[1::2] = halves[: (size + 1) // 2], halves[(size + 1) // 2 :]
    return out


def hdr(pixels: np.ndarray, size: str | None = None) -> bytes:
    """Radiance, flat scan lines."""
    peak = pixels.max(axis=2)
    exponent = np.floor(np.log2(np.maximum(peak, 1e-30))).astype(int) + 1
    mantissa = np.clip(np.round(pixels / 2.0 ** (exponent[..., None] - 8)), 0, 255)
    rgbe = np.concatenate([mantissa, exponent[..., None] + 128], axis=2).astype(np.uint8)
    h, w, _ = pixels.shape
    return f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{size or f'-Y {h} +X {w}'}\n".encode() + rgbe.tobytes()


def read_hdr(data: bytes) -> np.ndarray:
    """Flat or run-length scan lines, rows from the top."""
    head, _, body = data.partition(b"\n\n")
    assert head.startswith(b"#?RADIANCE") and b"FORMAT=32-bit_rle_rgbe" in head
    line, _, body = body.partition(b"\n")
    h, w = (int(n) for n in line.split()[1::2])
    values, at = [], 0
    for _ in range(h):
        if body[at : at + 4] != struct.pack(">BBH", 2, 2, w):
            values.append(np.frombuffer(body, np.uint8, 4 * w, at).reshape(w, 4))
            at += 4 * w
            continue
        row, at = bytearray(), at + 4
        while len(row) < 4 * w:
            n = body[at]
            row += body[at + 1 : at + 2] * (n - 128) if n > 128 else body[at + 1 : at + 1 + n]
            at += 2 if n > 128 else 1 + n
        values.append(np.frombuffer(bytes(row), np.uint8).reshape(4, w).T)
    rgbe = np.stack(values).astype(float)
    return np.where(rgbe[..., 3:] > 0, (rgbe[..., :3] + 0.5) * 2.0 ** (rgbe[..., 3:] - 136), 0)
