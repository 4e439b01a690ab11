"""STL files as other programs write them."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from service.formats import MeshData
from service.formats.errors import ParseError
from service.formats.sandbox.readers import parse_mesh
from service.formats.types import AssetLimits
from tests import asset_files as make

SOUP = np.random.default_rng(3).random((4, 3, 3)).astype(np.float32)
HALF = (((16 / 31) + 0.055) / 1.055) ** 2.4  # sRGB 16 of 31, linear


def parsed(data: bytes) -> MeshData:
    return parse_mesh("stl", memoryview(data), AssetLimits())


def binary(header: bytes = b"", count: int | None = None, attributes: list[int] | None = None) -> bytes:
    made = bytearray(make.stl(SOUP))
    made[:80] = header.ljust(80, b"\0")
    if count is not None:
        made[80:84] = struct.pack("<I", count)
    for k, value in enumerate(attributes or ()):
        struct.pack_into("<H", made, 84 + 50 * k + 48, value)
    return bytes(made)


def points(mesh: MeshData) -> np.ndarray:
    return mesh.vertices[mesh.faces]


@pytest.mark.parametrize("more", [b"\0", bytes(92), b"material 7\n", bytes(50)])
@pytest.mark.parametrize("header", [b"solid part", b"solid part\r\n", b"by hand", b"SOLID \xff\xfe"])
def test_bytes_after_the_triangles_are_told(header: bytes, more: bytes) -> None:
    mesh = parsed(binary(header) + more)
    assert np.array_equal(points(mesh), SOUP)
    count = "1 byte" if len(more) == 1 else f"{len(more)} bytes"
    assert mesh.warnings == (f"{count} after the 4 triangles that the header promises are not read",)


def test_a_count_that_is_too_small_is_what_is_read() -> None:
    mesh = parsed(binary(b"solid", count=3))
    assert np.array_equal(points(mesh), SOUP[:3]) and mesh.warnings[0].startswith("50 bytes after the 3 triangles")


@pytest.mark.parametrize("count", [0, 2**32 - 1])
def test_a_count_that_a_program_did_not_know(count: int) -> None:
    mesh = parsed(binary(count=count))
    assert np.array_equal(points(mesh), SOUP)
    assert mesh.warnings == (f"the header promises {count} triangles; all 4 that follow it are read",)


@pytest.mark.parametrize("cut", [0, 1, 49])
@pytest.mark.parametrize("count", [5, 10**9])
@pytest.mark.parametrize("header", [b"", b"solid x"])
def test_a_count_that_is_too_large_costs_no_whole_triangle(header: bytes, count: int, cut: int) -> None:
    data = binary(header, count=count)
    mesh = parsed(data[: len(data) - cut])
    there = 3 if cut else 4
    assert np.array_equal(points(mesh), SOUP[:there])
    assert mesh.warnings == (
        f"the file is cut off: of {count} triangles that its header promises, {there} are whole and read",
    )


@pytest.mark.parametrize(
    "data",
    [
        binary()[:133],  # no facet is whole
        binary(count=5)[:84],
        b"<!DOCTYPE html>" + b"<p>This file was removed by its owner.</p>" * 40,
        np.random.default_rng(7).bytes(20_000),
        b"\x1f\x8b\x08\0" + np.random.default_rng(8).bytes(2_000),
    ],
)
def test_what_is_no_stl_file_is_refused(data: bytes) -> None:
    with pytest.raises(ParseError, match=rf"not an STL file: {len(data)} bytes; its header promises \d+"):
        parsed(data)


@pytest.mark.parametrize("data", [bytes(84), b"solid x\nendsolid x\n"])
def test_no_triangles(data: bytes) -> None:
    with pytest.raises(ParseError, match="it has no faces"):
        parsed(data)


RED, GREEN, GREY = 31, 31 << 5, 16 | 16 << 5 | 16 << 10
BODY = b"by Magics COLOR=\xff\x00\x00\xff,MATERIAL="


def colors(mesh: MeshData) -> np.ndarray:
    assert mesh.colors is not None
    assert np.array_equal(mesh.colors[0::3], mesh.colors[1::3])
    return np.asarray(mesh.colors[0::3])


@pytest.mark.parametrize(
    ("header", "attributes", "expected", "told"),
    [
        (BODY, [GREEN, GREY, 0x8000, 0xFFFF], [(0, 1, 0), (HALF,) * 3, (1, 0, 0), (1, 0, 0)], ()),
        (BODY, [0, 0, 0, 0], [(1, 0, 0)] * 4, ()),
        (
            b"COLOR=\xff\xff\xff\x80", [RED] * 4, [(1, 0, 0)] * 4,
            ("the transparency of the header's colour is not supported; it is shown opaque",),
        ),
        (
            b"by VisCAM", [0x8000 | GREEN, 0x8000 | RED, 0x8000 | GREY, 0x8000],
            [(0, 1, 0), (0, 0, 1), (HALF,) * 3, (0, 0, 0)], (),
        ),
        (
            b"by VisCAM", [0x8000 | 31 << 10, 0, 0, 31], [(1, 0, 0), (1, 1, 1), (1, 1, 1), (1, 1, 1)],
            ("3 triangles have no colour; they are shown white",),
        ),
    ],
)  # fmt: skip
def test_colours_of_facets(
    header: bytes, attributes: list[int], expected: list[tuple[float, ...]], told: tuple[str, ...]
) -> None:
    mesh = parsed(binary(header, attributes=attributes))
    assert np.allclose(colors(mesh), expected, atol=1e-6) and mesh.warnings == told


def test_attributes_that_are_no_colours_are_told() -> None:
    mesh = parsed(binary(attributes=[7, 0, 9, 0]))
    assert mesh.colors is None
    assert mesh.warnings == ("the attributes of 2 triangles are no colours that are known, and are not read",)


TEXT = make.stl_text(SOUP)


@pytest.mark.parametrize("junk", [b"", b"\n\n", b"\0\0", b"\x1a"])
def test_texts_whose_end_is_clean(junk: bytes) -> None:
    assert not parsed(TEXT + junk).warnings


@pytest.mark.parametrize("junk", [b"made by hand\n", b"x\n endfacet\n", b"\xff\xfe\0\0\1"])
@pytest.mark.parametrize("ending", [b"\n", b"\r\n", b"\r"])
def test_what_follows_the_last_solid_is_told(junk: bytes, ending: bytes) -> None:
    mesh = parsed((TEXT + TEXT + junk).replace(b"\n", ending))
    assert np.allclose(points(mesh), np.concatenate([SOUP, SOUP]), atol=1e-7)
    assert len(mesh.warnings) == 1 and "after the last `endsolid` are not read" in mesh.warnings[0]


@pytest.mark.parametrize("normal", ["nan nan nan", "-nan(ind) -nan(ind) -nan(ind)", "-1.#IND 0 0", "1e999 0 0", ""])
def test_normals_that_are_none_are_not_needed(normal: str) -> None:
    mesh = parsed(TEXT.replace(b"normal 0 0 0", b"normal " + normal.encode()).upper())
    assert np.allclose(points(mesh), SOUP, atol=1e-7) and not mesh.warnings


@pytest.mark.parametrize("cut", [b"endsolid", b"endfacet\nendsolid", b"endloop\nendfacet\nendsolid"])
def test_a_text_that_was_cut_is_read_as_far_as_it_goes(cut: bytes) -> None:
    mesh = parsed(TEXT[: TEXT.rindex(cut)])
    there = 3 if cut.startswith(b"endloop") else 4
    assert np.allclose(points(mesh), SOUP[:there], atol=1e-7)
    assert mesh.warnings[0] == "the file is cut off: it does not end with `endsolid`"
    assert len(mesh.warnings) == (1 if there == 4 else 2)
