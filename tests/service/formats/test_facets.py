"""Facets where a file says flat, smooth groups where it says so, and the document's word above both."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from service.document import parse_scene
from service.formats import MeshData
from service.formats.read.zips.importer import read_zip
from service.formats.sandbox.readers import parse_mesh
from service.formats.types import AssetLimits
from service.pack import pack
from tests import asset_files as make
from tests.obj_files import zipped

ROOF = "v 0 0 0\nv 1 0 0\nv 1 1 1\nv 0 1 1\nv 1 2 0\nv 0 2 0\n"  # two slopes that meet in a ridge
SLOPES = ("f 1 2 3 4\n", "f 4 3 5 6\n")
LIMITS = AssetLimits()
LEFT, RIGHT = np.array([0, -1, 1]) / np.sqrt(2), np.array([0, 1, 1]) / np.sqrt(2)


def parsed(text: str, format: str = "obj") -> MeshData:
    return parse_mesh(format, memoryview(text.encode()), LIMITS)


class One:
    """An asset store with one mesh in it."""

    def __init__(self, mesh: MeshData) -> None:
        self._mesh = mesh

    def mesh(self, ref: str) -> MeshData:
        return self._mesh

    def image(self, ref: str, layer: str = "") -> Any:
        raise AssertionError(ref)

    def measured(self, ref: str) -> Any:
        raise AssertionError(ref)


def ridge(mesh: MeshData, **shape: Any) -> np.ndarray | None:
    """(2, 3): the packed normals of the two slopes at the ridge; None where there are facets only."""
    document = {
        "version": 1,
        "camera": {"position": [0, 0, 4], "target": [0, 0, 0]},
        "materials": {"m": {"type": "diffuse", "albedo": 0.5}},
        "shapes": [{"type": "mesh", "asset": "x", "material": "m"} | shape],
    }
    arrays = pack(parse_scene(document), One(mesh)).arrays
    if not len(arrays.triangle_normals):
        return None
    from service.pack.geometry.vertex_normals import decode

    found = {}
    for triangle, normals in zip(arrays.triangles, arrays.triangle_normals, strict=True):
        for corner, code in (("v0", "n0"), ("v1", "n1"), ("v2", "n2")):
            across = np.cross(triangle["v1"] - triangle["v0"], triangle["v2"] - triangle["v0"])
            if triangle[corner][2] + arrays.origin[2] > 0.9:
                found[across[1] > 0] = decode(np.array([normals[code]]))[0][0]
    return np.stack([found[False], found[True]])


UP = np.array([0.0, 0.0, 1.0])
CASES = {
    "no word": (ROOF + "".join(SLOPES), None),
    "off": (ROOF + "s off\n" + "".join(SLOPES), None),
    "zero": (ROOF + "s 0\n" + "".join(SLOPES), None),
    "one group": (ROOF + "s 1\n" + "".join(SLOPES), (UP, UP)),
    "two groups": (ROOF + "s 1\n" + SLOPES[0] + "s 2\n" + SLOPES[1], (LEFT, RIGHT)),
    "off again": (ROOF + "s 1\n" + SLOPES[0] + "s off\n" + SLOPES[1], (LEFT, RIGHT)),
    "indented": (ROOF + "  s 1\n" + "".join(SLOPES), (UP, UP)),
}


@pytest.mark.parametrize("name", CASES)
def test_an_obj_is_as_smooth_as_it_says(name: str) -> None:
    text, expected = CASES[name]
    found = ridge(parsed(text))
    if expected is None:
        assert found is None
    else:
        assert found is not None and np.allclose(found, expected, atol=1e-3)


@pytest.mark.parametrize("name", CASES)
def test_the_document_has_the_last_word(name: str) -> None:
    mesh = parsed(CASES[name][0])
    smooth = ridge(mesh, smooth=True)
    assert smooth is not None and np.allclose(smooth, UP, atol=1e-3)
    assert ridge(mesh, smooth=False) is None


@pytest.mark.parametrize("name", CASES)
def test_an_imported_obj_is_shaded_as_the_mesh_alone(name: str) -> None:
    text, expected = CASES[name]
    scene = read_zip(zipped({"m.obj": text}), LIMITS)
    (shape,) = scene.document["shapes"]
    own = {"smooth": shape["smooth"]} if "smooth" in shape else {}
    found = ridge(parse_mesh("ply", memoryview(bytes(scene.parts[0].data)), LIMITS), **own)
    assert (found is None) == (expected is None)
    assert expected is None or np.allclose(found, expected, atol=1e-3)


def test_normals_of_the_file_count_more_than_groups() -> None:
    text = ROOF + "vn 0 0 1\ns off\n" + "f 1//1 2//1 3//1 4//1\nf 4//1 3//1 5//1 6//1\n"
    found = ridge(parsed(text))
    assert found is not None and np.allclose(found, UP, atol=1e-3)


def test_an_stl_has_facets() -> None:
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 1], [0, 1, 1], [1, 2, 0], [0, 2, 0]], float)
    triangles = corners[[[0, 1, 2], [0, 2, 3], [3, 2, 4], [3, 4, 5]]]
    mesh = parse_mesh("stl", memoryview(make.stl(triangles)), LIMITS)
    assert ridge(mesh) is None
    smooth = ridge(mesh, smooth=True)
    assert smooth is not None and np.allclose(smooth, UP, atol=1e-3)


def test_a_gltf_mesh_without_normals_has_facets() -> None:
    tree = make.gltf(meshes=[{"primitives": [{"attributes": {"POSITION": 0}, "indices": 2}]}])
    assert not np.any(parse_mesh("glb", memoryview(make.glb(tree)), LIMITS).smoothing)
    assert parse_mesh("glb", memoryview(make.glb(make.gltf())), LIMITS).normals is not None


def test_a_ply_and_a_written_mesh_stay_smooth() -> None:
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 1], [0, 1, 1], [1, 2, 0], [0, 2, 0]], np.float32)
    found = ridge(parse_mesh("ply", memoryview(make.ply(corners, [[0, 1, 2, 3], [3, 2, 4, 5]])), LIMITS))
    assert found is not None and np.allclose(found, UP, atol=1e-3)


def test_coordinates_follow_the_vertices_of_their_group() -> None:
    """Vertices are split between groups: what they carry comes along."""
    text = ROOF + "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\ns 1\nf 1/1 2/2 3/3 4/4\ns 2\nf 4/4 3/3 5/2 6/1\n"
    mesh = parsed(text)
    document = {
        "version": 1,
        "camera": {"position": [0, 0, 4], "target": [0, 0, 0]},
        "textures": {"t": {"type": "checker", "a": 0, "b": 1}},
        "materials": {"m": {"type": "diffuse", "albedo": {"texture": "t"}}},
        "shapes": [{"type": "mesh", "asset": "x", "material": "m"}],
    }
    arrays = pack(parse_scene(document), One(mesh)).arrays
    for triangle, uvs in zip(arrays.triangles, arrays.triangle_uvs, strict=True):
        for corner, uv in zip(("v0", "v1", "v2"), uvs, strict=True):
            x, _, z = triangle[corner] + arrays.origin
            assert tuple(uv) == (x, z)
