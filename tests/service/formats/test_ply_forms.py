"""PLY files as other programs write them."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from service.formats import MeshData
from service.formats.sandbox.readers import parse_mesh
from service.formats.types import AssetLimits

VERTICES = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 2, 0]]


def parsed(data: bytes) -> MeshData:
    return parse_mesh("ply", memoryview(data), AssetLimits())


def header(*lines: str, format: str = "ascii", vertex: str = "float") -> str:
    axes = [f"property {vertex} {axis}" for axis in "xyz"]
    whole = ["ply", f"format {format} 1.0", f"element vertex {len(VERTICES)}", *axes, *lines, "end_header", ""]
    return "\n".join(whole)


BODY = "".join(" ".join(map(str, row)) + "\n" for row in VERTICES)


def test_strips_are_triangles_that_all_face_one_way() -> None:
    """Two strips in one list; the repeated vertex turns a corner and makes no triangle."""
    text = header("element tristrips 1", "property list int int vertex_indices") + BODY + "9 0 1 2 3 3 -1 2 3 4\n"
    mesh = parsed(text.encode())
    assert mesh.faces.tolist() == [[0, 1, 2], [2, 1, 3], [2, 3, 4]]
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()


def test_binary_strips_and_faces_together() -> None:
    lines = ("element tristrips 2", "property list int int vertex_indices")
    lines += ("element face 1", "property list uchar int vertex_indices")
    body = np.array(VERTICES, "<f4").tobytes() + struct.pack("<4i5i", 3, 0, 1, 2, 4, 1, 3, 2, 4)
    body += struct.pack("<B3i", 3, 2, 3, 4)
    mesh = parsed(header(*lines, format="binary_little_endian").encode() + body)
    assert mesh.faces.tolist() == [[0, 1, 2], [1, 3, 2], [2, 3, 4], [2, 3, 4]]


def test_a_strip_without_triangles_is_refused() -> None:
    from service.formats.errors import ParseError

    text = header("element tristrips 1", "property list int int vertex_indices") + BODY + "2 0 1\n"
    with pytest.raises(ParseError, match="no faces"):
        parsed(text.encode())


@pytest.mark.parametrize("ending", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("name", ["vertex_indices", "vertex_index", "indices"])
@pytest.mark.parametrize("kinds", ["uchar int", "uint8 uint32", "int int", "uint16 int16", "float64 float"])
def test_types_names_and_line_ends(ending: str, name: str, kinds: str) -> None:
    lines = ("element face 2", "property float32 quality", f"property list {kinds} {name}", "property uint8 flags")
    text = header(*lines, vertex="float64") + BODY + "0.5 3 0 1 2 7\n0.25 4 1 3 4 2 7\n"
    mesh = parsed(text.replace("\n", ending).encode())
    assert sorted(map(sorted, mesh.faces.tolist()))[0] == [0, 1, 2] and len(mesh.faces) == 3


@pytest.mark.parametrize("kind", ["uchar", "int", "uint16"])
def test_colours_up_to_255_whatever_their_type(kind: str) -> None:
    colors = [f"property {kind} {name}" for name in ("red", "green", "blue")]
    body = BODY.replace("\n", " 255 0 128\n")
    mesh = parsed(
        (header(*colors, "element face 1", "property list uchar int vertex_indices") + body + "3 0 1 2\n").encode()
    )
    assert mesh.colors is not None and np.allclose(mesh.colors[0], [1, 0, 0.2159], atol=1e-3)


def test_elements_that_nobody_knows_are_passed_over() -> None:
    lines = ("element material 1", "property list uchar uchar name", "property float shine")
    lines += ("element face 1", "property list uchar int vertex_indices", "element edge 1", "property int vertex1")
    text = header(*lines) + BODY + "3 97 98 99 0.5\n3 0 1 2\n0\n"
    assert parsed(text.encode()).faces.tolist() == [[0, 1, 2]]


@pytest.mark.parametrize("near", ["1 0.5", "2 0.5 9"])
def test_lists_and_numbers_beside_what_is_known(near: str) -> None:
    """Of vertices, whose lists may differ in length, and of elements without properties or rows."""
    beside = ("property list uint8 float32 near", "property uint8 red", "property uint8 green", "property uint8 blue")
    lines = (*beside, "element nothing 0", "element face 1", "property list uchar int vertex_indices")
    first, *rest = BODY.splitlines()
    body = "\n".join([f"{first} {near} 255 0 0", *(f"{row} 1 7 0 255 0" for row in rest), "3 0 1 2", ""])
    mesh = parsed((header(*lines) + body).encode())
    assert mesh.vertices.tolist() == VERTICES and mesh.faces.tolist() == [[0, 1, 2]]
    assert mesh.colors is not None and mesh.colors[:2].tolist() == [[1, 0, 0], [0, 1, 0]]
