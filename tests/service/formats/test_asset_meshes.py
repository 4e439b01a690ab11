"""What is read from sound mesh files."""

from __future__ import annotations

import io
import struct
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from service.formats import MeshData, MeshOddities
from service.formats.formats import sniff
from service.formats.read import obj_lines
from service.formats.read.obj_mesh import read_obj_with_materials
from service.server.assets import AssetStore
from tests import asset_files as make
from tests.asset_files import OBJ, TRIANGLE

RNG = np.random.default_rng(11)
QUAD = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[AssetStore]:
    store = AssetStore(tmp_path_factory.mktemp("data"))
    yield store
    store.close()


def mesh(store: AssetStore, data: bytes, name: str) -> MeshData:
    return store.mesh(store.add(data, filename=name).id)


def triangles(mesh: MeshData) -> np.ndarray:
    """(m, 3, 3) points, whatever the vertices' order."""
    return mesh.vertices[mesh.faces]


def test_obj_keeps_vertices_and_their_order(store: AssetStore) -> None:
    read = mesh(store, b"# a\nv 5 5 5\n" + OBJ.replace(b"1 2 3", b"2 3 4"), "m.obj")
    assert np.array_equal(read.vertices, [[5, 5, 5], *TRIANGLE]) and read.faces.tolist() == [[1, 2, 3]]
    assert read.normals is None
    assert read.vertices.dtype == np.float64 and read.faces.dtype == np.int32
    assert not read.vertices.flags.writeable


def test_obj_indexing_vertices_and_normals_apart(store: AssetStore) -> None:
    """Two faces share an edge and not its normals: each corner keeps its own."""
    text = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 2\nvn 0 -3 0\nvt 0 0\nf 1//1 2//1 3//1\nf 1/1/2 4/1/2 2/1/2\n"
    read = mesh(store, text, "m.obj")
    assert read.normals is not None
    expected = np.array([[[0, 0, 1]] * 3, [[0, -1, 0]] * 3])
    assert np.array_equal(read.normals[read.faces], expected)
    assert np.array_equal(triangles(read), np.stack([TRIANGLE, TRIANGLE[:, [0, 2, 1]][[0, 2, 1]]]))


def test_obj_with_normals_on_some_faces(store: AssetStore) -> None:
    """The others get theirs from their triangles."""
    text = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 1 0 0\nf 1//1 2//1 3//1\nf 1 4 2\n"
    read = mesh(store, text, "m.obj")
    assert read.normals is not None
    assert np.array_equal(read.normals[read.faces], [[[1, 0, 0]] * 3, [[0, 1, 0]] * 3])


@pytest.mark.parametrize(
    "face",
    [b"f -3 -2 -1", b"f\t1 \\\n 2  3  # three", b"f 1/ 2/ 3/", b"g a\nf 1 2 3 \r", b"f +1 +2 +3"],
)
def test_obj_ways_to_write_a_face(store: AssetStore, face: bytes) -> None:
    assert np.array_equal(triangles(mesh(store, OBJ[: OBJ.index(b"f")] + face, "m.obj")), [TRIANGLE])


def test_obj_texture_coordinates_and_colours(store: AssetStore) -> None:
    """Indexed apart from the vertices; three more numbers on every vertex are its colour, in sRGB."""
    text = b"v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 .5\nvt 0 0\nvt 1 .25\nvt .5\nf 1/1 2/2 3/3\nf 1/-1 3/-2 2/-3\n"
    read = mesh(store, text, "m.obj")
    assert read.uvs is not None and read.colors is not None and read.uvs_1 is None
    assert read.uvs[read.faces].tolist() == [[[0, 0], [1, 0.25], [0.5, 0]], [[0.5, 0], [1, 0.25], [0, 0]]]
    assert np.allclose(read.colors[read.faces][0], [[1, 0, 0], [0, 1, 0], [0, 0, 0.2140]], atol=1e-4)
    assert np.array_equal(triangles(read), TRIANGLE[[[0, 1, 2], [0, 2, 1]]])


def test_obj_where_every_index_counts_alike_keeps_the_file_s_vertices(store: AssetStore) -> None:
    text = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nvn 0 0 1\nvn 0 0 1\nvn 0 0 1\nf 3/3/3 1/1/1 2/2/2\n"
    read = mesh(store, text, "m.obj")
    assert np.array_equal(read.vertices, TRIANGLE) and read.faces.tolist() == [[2, 0, 1]]
    assert np.array_equal(read.uvs, TRIANGLE[:, :2]) and np.array_equal(read.normals, [[0, 0, 1]] * 3)


def test_obj_without_some_texture_coordinates_says_so(store: AssetStore) -> None:
    read = mesh(store, OBJ + b"vt 1 1\nf 1/1 2/1 3/1\n", "m.obj")
    assert read.uvs is not None and read.uvs[read.faces].tolist() == [[[0, 0]] * 3, [[1, 1]] * 3]
    assert read.warnings[0] == "3 corners have no texture coordinate; they take 0 0"


@pytest.mark.parametrize(
    ("face", "told"),
    [
        ("f 1 2 9", "vertex 9 does not exist; there are 5 vertices"),
        ("f 1 2 3 4 99999999999", "vertex 99999999999 does not exist; there are 5 vertices"),
        ("f 1 0 2", "an index of 0 does not exist; they are counted from 1"),
        ("f -1 -2 -6", "vertex -6 does not exist; there are 4 vertices before it"),
    ],
)
def test_obj_faces_with_an_index_that_leads_nowhere_are_left_out(store: AssetStore, face: str, told: str) -> None:
    """The others are there, also one that names a vertex of a later line."""
    text = f"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvt 0 0\nf 1 2 3\n{face}\nf 2 4 5\nv 2 0 0\n"
    read = mesh(store, text.encode(), "m.obj")
    assert read.faces.tolist() == [[0, 1, 2], [1, 3, 4]]
    assert read.warnings[0] == f"1 face is left out: line 7: {told}"
    read = mesh(store, (text + face + "\n").encode(), "m.obj")
    assert len(read.faces) == 2 and read.warnings[0].startswith("2 faces are left out, the first: line 7: ")


@pytest.mark.parametrize("block", [1, obj_lines.BLOCK])
def test_what_follows_a_face_that_is_left_out(block: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Materials and smoothing groups stay with their own faces."""
    monkeypatch.setattr(obj_lines, "BLOCK", block)
    corners = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n"
    faces = b"usemtl a\ns 3\nf 1 2 9\nf 1 2 3 4\nf 9 8 7 6\nusemtl b\ns off\nf 1 2 3\nf 0 0 0\nusemtl a\nf 2 3 4\n"
    read = read_obj_with_materials(corners + faces)
    assert [read.materials[k] for k in read.of_triangle] == ["a", "a", "b", "a"]
    assert read.mesh.groups is not None and (read.mesh.groups > 0).tolist() == [True, True, False, False]
    assert read.mesh.warnings == [
        "3 faces are left out, the first: line 7: vertex 9 does not exist; there are 4 vertices"
    ]


@pytest.mark.parametrize("order", ["<", ">", "a"])
def test_ply_texture_coordinates_and_colours(store: AssetStore, order: str) -> None:
    """Colours of whole numbers are sRGB, those of floats linear."""
    uvs, bytes_ = TRIANGLE[:, :2] * 3, np.array([[255, 0, 188], [0, 55, 0], [1, 2, 3]])
    for kind, colors in (("uchar", bytes_), ("float", bytes_ / 255)):
        read = mesh(store, make.ply(TRIANGLE, [[0, 1, 2]], order, {"st": uvs, "rgb": colors}, kind), "m.ply")
        assert read.uvs is not None and np.array_equal(read.uvs, uvs)
        value = 188 / 255
        expected = ((value + 0.055) / 1.055) ** 2.4 if kind == "uchar" else value
        assert read.colors is not None and read.colors[0] == pytest.approx([1, 0, expected], rel=1e-6)


@pytest.mark.parametrize("polygon", ["convex", "arrow", "arrow turned", "comb"])
def test_polygons_are_covered_once(store: AssetStore, polygon: str) -> None:
    """The triangles' areas, each counted positive where it faces the polygon's way, add up to the polygon's."""
    angles = np.arange(7) * 2 * np.pi / 7
    arrow = np.array([[0, 0], [1, -1], [0, 2], [-1, -1]])
    outlines = {
        "convex": np.stack([np.cos(angles), np.sin(angles)], axis=1),
        "arrow": arrow,
        "arrow turned": np.roll(arrow, 1, axis=0),
        "comb": np.array([[0, 0], [7, 0], [7, 3], [6, 3], [5, 1], [4, 3], [3, 1], [2, 3], [1, 1], [0, 3]]),
    }
    flat = outlines[polygon].astype(float)
    x, y = flat.T
    area = (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2
    points = np.stack([y, 0 * x, x], axis=1)  # in the plane y = 0, counter-clockwise from above
    rows = "".join(f"v {a} {b} {c}\n" for a, b, c in points)
    read = mesh(store, f"{rows}f {' '.join(str(k + 1) for k in range(len(flat)))}\n".encode(), "m.obj")
    a, b, c = triangles(read).transpose(1, 0, 2)
    areas = np.cross(b - a, c - a)[:, 1] / 2
    assert len(areas) == len(flat) - 2 and areas.min() >= 0 and areas.sum() == pytest.approx(area)


@pytest.mark.parametrize("order", ["<", ">", "a"])
def test_ply_of_mixed_polygons(store: AssetStore, order: str) -> None:
    read = mesh(store, make.ply(QUAD, [[0, 1, 2], [0, 1, 2, 3]], order), "m.ply")
    assert np.array_equal(read.vertices, QUAD) and read.faces.tolist() == [[0, 1, 2], [0, 1, 2], [0, 2, 3]]


def test_ply_agrees_with_trimesh(store: AssetStore) -> None:
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=2)
    for encoding in ("binary", "ascii"):
        data = ball.export(file_type="ply", encoding=encoding, vertex_normal=True)
        read = mesh(store, data, "m.ply")
        assert read.normals is not None and np.array_equal(read.faces, ball.faces)
        assert np.allclose(read.vertices, ball.vertices, atol=1e-6)
        assert np.allclose(read.normals, ball.vertex_normals, atol=1e-5)


@pytest.mark.parametrize("encoding", ["stl", "stl_ascii"])
def test_stl_agrees_with_trimesh(store: AssetStore, encoding: str) -> None:
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=2)
    exported = ball.export(file_type=encoding)
    data = exported.encode() if isinstance(exported, str) else exported
    again = trimesh.load(io.BytesIO(data), "stl", process=False)
    assert np.array_equal(triangles(mesh(store, data, "m.stl")), again.triangles)


def test_stl_texts_are_read_by_words_and_not_by_lines(store: AssetStore) -> None:
    soup = RNG.random((3, 3, 3)).astype(np.float32)
    text = make.stl_text(soup)
    for data in (
        text.replace(b"outer loop\n", b"outer loop "),
        text.replace(b"\nvertex", b" vertex"),
        text.replace(b"endloop", b"end loop").upper(),
        text.replace(b"solid thing", b"solid vertex of a facet", 1),
    ):
        assert np.array_equal(triangles(mesh(store, data, "m.stl")), soup)


def test_oddities_come_along_and_are_no_warning(store: AssetStore) -> None:
    """Whether they matter is for the material to say."""
    info = store.add(OBJ + b"v 0 0 1\nf 2 3 1\nf 2 1 4\n", filename="m.obj")
    assert info.warnings is None
    assert store.mesh(info.id).oddities == MeshOddities(coinciding=1, crowded=1, turned=2, rim=2)


def test_stl_binary_and_text(store: AssetStore) -> None:
    soup = RNG.random((5, 3, 3)).astype(np.float32)
    latin = make.stl_text(soup).replace(b"thing", "größe".encode("latin-1"))
    text = make.stl_text(soup)
    ends = [text.replace(b"\n", end) for end in (b"\r\n", b"\r")]
    for data in (make.stl(soup), text, text + make.stl_text(soup[:0]), latin, *ends):
        read = mesh(store, data, "m.stl")
        assert read.normals is None and np.allclose(triangles(read), soup, atol=1e-7)


def test_a_binary_stl_may_call_itself_solid(store: AssetStore) -> None:
    """Many programs begin the header so, as a text does."""
    soup = RNG.random((5, 3, 3)).astype(np.float32)
    read = mesh(store, b"solid by some program".ljust(80) + make.stl(soup)[80:], "m.stl")
    assert np.array_equal(triangles(read), soup)


def test_glb_and_gltf_are_the_same(store: AssetStore) -> None:
    for data in (make.glb(make.gltf()), make.embedded(make.gltf())):
        read = mesh(store, data, "")
        assert read.normals is not None
        assert np.array_equal(triangles(read), [TRIANGLE]) and np.array_equal(read.normals, [[0, 0, 1]] * 3)


def test_glb_nodes_move_and_mirror(store: AssetStore) -> None:
    """A parent that moves, a child that mirrors x and one that turns about y; a mesh standing twice."""
    half = np.sqrt(0.5)
    nodes: list[dict[str, Any]] = [
        {"children": [1, 2], "translation": [0, 0, 5]},
        {"mesh": 0, "matrix": [-1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1, 0, 1, 0, 0, 1]},
        {"mesh": 0, "rotation": [0, half, 0, half]},
    ]
    read = mesh(store, make.glb(make.gltf(nodes)), "m.glb")
    assert read.normals is not None
    mirrored = TRIANGLE * [-1, 2, 1] + [1, 0, 5]
    turned = np.stack([TRIANGLE[:, 2], TRIANGLE[:, 1], 5 - TRIANGLE[:, 0]], axis=1)
    assert np.allclose(triangles(read)[0], mirrored[::-1])
    assert np.allclose(triangles(read)[1], turned, atol=1e-7)
    assert np.allclose(read.normals[read.faces][0], [[0, 0, 1]] * 3)  # and the winding agrees with it
    a, b, c = triangles(read)[0]
    assert np.cross(b - a, c - a)[2] > 0
    assert np.allclose(read.normals[read.faces][1], [[1, 0, 0]] * 3, atol=1e-7)


@pytest.mark.parametrize(
    ("mode", "indices", "expected"),
    [
        (4, [0, 1, 2, 0, 2, 3], [[0, 1, 2], [0, 2, 3]]),
        (5, [0, 1, 3, 2], [[0, 1, 3], [1, 2, 3]]),
        (6, [0, 1, 2, 3], [[1, 2, 0], [2, 3, 0]]),
    ],
)
def test_glb_lists_strips_and_fans(
    store: AssetStore, mode: int, indices: list[int], expected: list[list[int]]
) -> None:
    accessors = [
        {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
        {"bufferView": 1, "componentType": 5121, "count": len(indices), "type": "SCALAR"},
    ]
    views = [
        {"buffer": 0, "byteLength": 48},
        {"buffer": 0, "byteOffset": 48, "byteLength": len(indices)},
    ]
    meshes = [
        {"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "mode": mode}, {"attributes": {}, "mode": 1}]}
    ]
    tree = make.gltf(
        accessors=accessors, bufferViews=views, meshes=meshes, buffers=[{"byteLength": 48 + len(indices)}]
    )
    read = mesh(store, make.glb(tree, QUAD.astype("<f4").tobytes() + bytes(indices)), "m.glb")
    assert read.normals is None and read.faces.tolist() == expected


def test_glb_strided_sparse_and_normalised(store: AssetStore) -> None:
    """Positions as normalised bytes, eight bytes apart, one replaced by a sparse accessor."""
    rows = b"".join(struct.pack("<3b5x", *p) for p in ((0, 0, 0), (127, 0, 0), (1, 2, 3)))
    buffer = rows + struct.pack("<B3x", 2) + struct.pack("<3bx", 0, -127, 0)
    accessor = {
        **{"bufferView": 0, "componentType": 5120, "count": 3, "type": "VEC3", "normalized": True},
        "sparse": {
            "count": 1,
            "indices": {"bufferView": 1, "componentType": 5121},
            "values": {"bufferView": 1, "byteOffset": 4},
        },
    }
    views = [
        {"buffer": 0, "byteLength": 24, "byteStride": 8},
        {"buffer": 0, "byteOffset": 24, "byteLength": 8},
    ]
    meshes = [{"primitives": [{"attributes": {"POSITION": 0}}]}]
    tree = make.gltf(accessors=[accessor], bufferViews=views, meshes=meshes, buffers=[{"byteLength": 32}])
    assert np.array_equal(
        triangles(mesh(store, make.glb(tree, buffer), "m.glb")), [[[0, 0, 0], [1, 0, 0], [0, -1, 0]]]
    )


def test_draco_is_no_placeholder(store: AssetStore) -> None:
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=2)
    data = make.draco_glb(np.array(ball.vertices), np.array(ball.faces), np.array(ball.vertex_normals))
    read = mesh(store, data, "m.glb")
    assert len(read.faces) == len(ball.faces) and read.normals is not None
    assert np.abs(np.linalg.norm(read.vertices, axis=1) - 1).max() < 1e-3
    assert (np.einsum("ij,ij->i", read.vertices, read.normals)).min() > 0.99
    a, b, c = triangles(read).transpose(1, 0, 2)
    assert (np.cross(b - a, c - a) * (a + b + c)).sum(axis=1).min() > 0  # still outward


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
@pytest.mark.parametrize("name", ["m.obj", "m.stl"])
def test_texts_as_windows_writes_them(store: AssetStore, name: str, encoding: str) -> None:
    """A byte order mark before the first vertex must not cost it: faces would name the wrong ones."""
    obj = "v 5 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 9\nf 1 2 3\n"
    corners = "vertex 5 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
    stl = f"solid a\nfacet normal 0 0 1\nouter loop\n{corners}endloop\nendfacet\nendsolid\n"
    data = (obj if name == "m.obj" else stl).encode(encoding)
    assert sniff(data) == name[2:]
    info = store.add(data)
    mesh = store.mesh(info.id)
    assert mesh.vertices[mesh.faces[0]].tolist() == [[5, 0, 0], [1, 0, 0], [0, 1, 0]]
