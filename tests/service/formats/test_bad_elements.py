"""One bad element refuses no file, whatever its format and kind: what can be shown is, and the rest is told once."""

from __future__ import annotations

import json
import struct
from base64 import b64encode
from collections.abc import Callable
from functools import partial
from itertools import product
from typing import Any

import numpy as np
import pytest

from service.formats import MeshData
from service.formats.errors import ParseError
from service.formats.sandbox.readers import parse_mesh
from service.formats.types import AssetLimits
from tests import asset_files as make

PLACES: list[list[float]] = [[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
SOUND = [[0, 1, 2], [0, 2, 3]]
NAN, INF = float("nan"), float("inf")
Faces = list[list[int]]
Rows = list[list[float]]


def obj(places: Rows, faces: Faces, normals: Rows | None = None, uvs: Rows | None = None) -> bytes:
    lines = [f"v {x} {y} {z}" for x, y, z in places]
    lines += [f"vn {x} {y} {z}" for x, y, z in normals or ()] + [f"vt {u} {v}" for u, v in uvs or ()]
    corner = "{0}/{0}/{0}" if normals and uvs else "{0}//{0}" if normals else "{0}/{0}" if uvs else "{0}"
    # An index below 0 would count back here: 0 is the one that no file has.
    lines += ["f " + " ".join(corner.format(max(k + 1, 0)) for k in face) for face in faces]
    return "\n".join([*lines, ""]).encode()


def ply(places: Rows, faces: Faces, normals: Rows | None = None, uvs: Rows | None = None, order: str = "a") -> bytes:
    encoding = {"a": "ascii", "<": "binary_little_endian", ">": "binary_big_endian"}[order]
    names = ["x", "y", "z", *(["nx", "ny", "nz"] if normals else []), *(["s", "t"] if uvs else [])]
    columns = [np.array(each, "f8") for each in (places, normals, uvs) if each]
    lines = ["ply", f"format {encoding} 1.0", f"element vertex {len(places)}"]
    lines += [f"property float {name}" for name in names]
    lines += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header", ""]
    head = "\n".join(lines).encode()
    rows = np.column_stack(columns)
    if order == "a":
        body = [*(" ".join(map(str, row)) for row in rows), *(" ".join(map(str, [len(f), *f])) for f in faces), ""]
        return head + "\n".join(body).encode()
    packed = b"".join(struct.pack(f"{order}B{len(face)}i", len(face), *face) for face in faces)
    return head + rows.astype(order + "f4").tobytes() + packed


def soup(places: Rows, faces: Faces) -> np.ndarray:
    return np.array([[places[k] for k in face] for face in faces])


def gltf(places: Rows, faces: Faces, normals: Rows | None = None, uvs: Rows | None = None) -> bytes:
    """The bounds are those of numbers that are finite."""
    buffers = [np.array(faces, "<u4").tobytes()]
    members = {"POSITION": (places, "VEC3"), "NORMAL": (normals, "VEC3"), "TEXCOORD_0": (uvs, "VEC2")}
    accessors: list[dict[str, Any]] = [
        {"bufferView": 0, "componentType": 5125, "type": "SCALAR", "count": 3 * len(faces)}
    ]
    attributes = {}
    for name, (rows, kind) in members.items():
        if rows:
            attributes[name] = len(accessors)
            accessors.append({"bufferView": len(buffers), "componentType": 5126, "type": kind, "count": len(rows)})
            buffers.append(np.array(rows, "<f4").tobytes())
    views = [{"buffer": k, "byteLength": len(each)} for k, each in enumerate(buffers)]
    uris = [f"data:application/octet-stream;base64,{b64encode(each).decode()}" for each in buffers]
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "scene": 0,
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": attributes, "indices": 0}]}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"uri": u, "byteLength": len(b)} for u, b in zip(uris, buffers, strict=True)],
    }
    return json.dumps(document).encode()


def parsed(format: str, data: bytes) -> MeshData:
    return parse_mesh(format, memoryview(data), AssetLimits())


INDEXED: dict[str, tuple[str, Callable[..., bytes]]] = {
    "OBJ": ("obj", obj),
    "PLY text": ("ply", ply),
    "PLY little-endian": ("ply", partial(ply, order="<")),
    "PLY big-endian": ("ply", partial(ply, order=">")),
}
SOUPS: dict[str, tuple[str, Callable[[np.ndarray], bytes]]] = {
    "STL": ("stl", make.stl),
    "STL text": ("stl", make.stl_text),
}
BAD_FACES: dict[str, list[int]] = {
    "no corner": [],
    "one corner": [1],
    "two corners": [0, 1],
    "an index beyond": [0, 1, 9],
    "an index below": [0, 1, -1],
    "indices beyond in a polygon": [0, 1, 2, 99, 98],
}
BAD_PLACES: dict[str, list[float]] = {"NaN": [0, NAN, 0], "infinity": [0, 0, -INF], "too far": [2e9, 0, 0]}


def check(mesh: MeshData, count: int) -> None:
    """The sound triangles are there, in their order, and one warning counts the others."""
    assert mesh.vertices[mesh.faces].tolist() == soup(PLACES, SOUND).tolist()
    assert len(mesh.warnings) == 1 and mesh.warnings[0].startswith("1 " if count == 1 else f"{count} ")


@pytest.mark.parametrize("format", INDEXED)
@pytest.mark.parametrize("bad", BAD_FACES)
@pytest.mark.parametrize(("count", "at"), [*product([1, 3], [0, 1, 2])])
def test_faces(format: str, bad: str, count: int, at: int) -> None:
    name, write = INDEXED[format]
    faces = [*SOUND[:at], *[BAD_FACES[bad]] * count, *SOUND[at:]]
    mesh = parsed(name, write(PLACES, faces))
    check(mesh, count)
    where = f"line {5 + at}: " if name == "obj" else f"face {at} (counted from 0)"
    assert where in mesh.warnings[0]


@pytest.mark.parametrize("format", INDEXED)
@pytest.mark.parametrize("bad", BAD_PLACES)
@pytest.mark.parametrize("count", [1, 3])
def test_vertices(format: str, bad: str, count: int) -> None:
    """A face that has one is left out; one that no face has is told."""
    name, write = INDEXED[format]
    places = [*PLACES, *[BAD_PLACES[bad]] * count]
    check(parsed(name, write(places, [*SOUND, *([0, 1, 4 + k] for k in range(count))])), count)
    mesh = parsed(name, write(places, SOUND))
    assert mesh.vertices[mesh.faces].tolist() == soup(PLACES, SOUND).tolist() and np.isfinite(mesh.vertices).all()
    assert len(mesh.warnings) == 1 and "no face uses" in mesh.warnings[0]


@pytest.mark.parametrize("format", SOUPS)
@pytest.mark.parametrize("bad", BAD_PLACES)
@pytest.mark.parametrize(("count", "at"), [*product([1, 3], [0, 1, 2])])
def test_facets(format: str, bad: str, count: int, at: int) -> None:
    name, write = SOUPS[format]
    lost = soup([PLACES[0], PLACES[1], BAD_PLACES[bad]], [[0, 1, 2]])
    triangles = np.concatenate(
        [soup(PLACES, SOUND[:at]).reshape(-1, 3, 3), *[lost] * count, soup(PLACES, SOUND[at:]).reshape(-1, 3, 3)]
    )
    mesh = parsed(name, write(triangles))
    check(mesh, count)
    assert f"triangle {at} (counted from 0)" in mesh.warnings[0]


@pytest.mark.parametrize("format", [*INDEXED, "glTF"])
@pytest.mark.parametrize("bad", [NAN, INF])
@pytest.mark.parametrize("member", ["normals", "uvs"])
def test_normals_and_texture_coordinates(format: str, bad: float, member: str) -> None:
    """A normal becomes the one of its triangles, and texture coordinates 0 0 in the file."""
    name, write = {**INDEXED, "glTF": ("gltf", gltf)}[format]
    rows = {"normals": [[1.0, 0, 0]] * 4, "uvs": [[0.5, 0.5]] * 4}
    rows[member][1] = [bad, *rows[member][1][1:]]
    mesh = parsed(name, write(PLACES, SOUND, rows["normals"], rows["uvs"]))
    assert mesh.normals is not None and mesh.uvs is not None and len(mesh.faces) == 2
    assert mesh.normals[mesh.faces[0, 1]].tolist() == ([0, 0, 1] if member == "normals" else [1, 0, 0])
    origin = [0, 1] if name == "gltf" else [0, 0]  # glTF's v points down
    assert mesh.uvs[mesh.faces[0, 1]].tolist() == (origin if member == "uvs" else [0.5, 0.5])
    assert mesh.normals[mesh.faces[1]].tolist() == [[1, 0, 0]] * 3 and len(mesh.warnings) == 1


@pytest.mark.parametrize("format", INDEXED)
@pytest.mark.parametrize("bad", BAD_FACES)
def test_a_file_of_which_nothing_remains(format: str, bad: str) -> None:
    """It is refused, with the reason for the first."""
    name, write = INDEXED[format]
    with pytest.raises(ParseError, match=r"line 5|face 0 \(counted from 0\)"):
        parsed(name, write(PLACES, [BAD_FACES[bad]] * 2))


@pytest.mark.parametrize("format", SOUPS)
@pytest.mark.parametrize("bad", BAD_PLACES)
def test_an_stl_file_of_which_nothing_remains(format: str, bad: str) -> None:
    name, write = SOUPS[format]
    with pytest.raises(ParseError, match=r"triangle 0 \(counted from 0\)"):
        parsed(name, write(soup([PLACES[0], PLACES[1], BAD_PLACES[bad]], [[0, 1, 2]] * 2)))


@pytest.mark.parametrize("format", [*INDEXED, *SOUPS, "glTF"])
def test_sound_files_have_nothing_to_tell(format: str) -> None:
    if format in SOUPS:
        name, written = SOUPS[format][0], SOUPS[format][1](soup(PLACES, SOUND))
    else:
        name, write = {**INDEXED, "glTF": ("gltf", gltf)}[format]
        written = write(PLACES, SOUND, [[0, 0, 1]] * 4, [[0, 0]] * 4)
    mesh = parsed(name, written)
    assert mesh.vertices[mesh.faces].tolist() == soup(PLACES, SOUND).tolist() and not mesh.warnings
