"""Meshes: outside out, normals that interpolate, triangles that are there."""

from __future__ import annotations

import numpy as np
import pytest

from service.pack.cache import PackCache
from service.pack.geometry.geometry import Geometry
from service.pack.geometry.parallel import CHUNK
from service.pack.geometry.vertex_normals import corner_normals, encode
from tests.documents import CUBE, GREY, MIRRORED, matrix_of, mesh, packed, sphere


def decode(codes):
    """GLSL's unpackSnorm2x16, then the octahedron unfolded."""
    e = np.stack([codes & 0xFFFF, codes >> 16], axis=-1).astype(np.uint16).astype(np.int16) / 32767.0
    n = np.concatenate([e, 1 - np.abs(e).sum(axis=-1, keepdims=True)], axis=-1)
    fold = np.maximum(-n[..., 2:], 0)
    n[..., :2] -= fold * np.where(n[..., :2] >= 0, 1, -1)
    return n / np.linalg.norm(n, axis=-1, keepdims=True)


def volume(triangles):
    return np.einsum("ij,ij->i", triangles["v0"], np.cross(triangles["v1"], triangles["v2"])).sum() / 6


@pytest.mark.parametrize("transform", [None, {"scale": 2, "rotate": [1, 2, 3]}, MIRRORED])
@pytest.mark.parametrize("smooth", [True, False])
def test_mesh_stays_outside_out(transform, smooth):
    placed = {} if transform is None else {"transform": transform}
    arrays = packed(mesh(smooth=smooth, **placed)).arrays
    expected = 1.0 if transform is None else abs(np.linalg.det(matrix_of(transform)))
    assert volume(arrays.triangles) == pytest.approx(expected, rel=1e-4)
    assert len(arrays.triangle_normals) == (12 if smooth else 0)
    if smooth:
        outward = np.cross(
            arrays.triangles["v1"] - arrays.triangles["v0"], arrays.triangles["v2"] - arrays.triangles["v0"]
        )
        for name in ("n0", "n1", "n2"):
            assert np.all(np.einsum("ij,ij->i", decode(arrays.triangle_normals[name]), outward) > 0)


def test_transform_of_normals_is_the_inverse_transpose():
    vertices = [[0, 0, 0], [1, 0, -1], [0, 1, 0]]
    normals = [[1, 0, 1], [1, 0.1, 1], [1, 0, 0.9]]
    transform = {"scale": [3, 1, 1], "rotate": [0, 90, 0]}
    arrays = packed(mesh(vertices=vertices, faces=[[0, 1, 2]], normals=normals, transform=transform)).arrays
    expected = np.array(normals) @ np.linalg.inv(matrix_of(transform)[:3, :3])
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    record = arrays.triangle_normals[0]
    np.testing.assert_allclose(decode(np.array([record["n0"], record["n1"], record["n2"]])), expected, atol=1e-4)


def test_octahedral_normals_come_back():
    rng = np.random.default_rng(3)
    normals = np.concatenate([rng.normal(size=(5000, 3)), np.eye(3), -np.eye(3), [[1, 1, 0], [-1, 0, -1]]])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    cosine = np.einsum("ij,ij->i", decode(encode(normals * 7)), normals)
    assert np.degrees(np.arccos(np.clip(cosine, -1, 1))).max() < 0.005


def test_computed_normals_join_repeated_vertices_by_angle():
    """A cube, every triangle with vertices of its own: each corner's normal is the diagonal, whatever the cut."""
    points = np.array(CUBE["vertices"], float)[np.array(CUBE["faces"])].reshape(-1, 3)
    points[::2][points[::2] == 0] = -0.0  # the same place
    normals, faces = corner_normals(points, np.arange(36).reshape(12, 3))
    assert normals.shape == (8, 3)
    corners = points.reshape(12, 3, 3)
    np.testing.assert_allclose(normals[faces], (2 * corners - 1) / np.sqrt(3), atol=1e-12)


def test_computed_normals_are_weighted_by_angles():
    """Vertices of one place are looked for only where there are some."""
    rng = np.random.default_rng(1)
    points = rng.normal(size=(1000, 3))
    faces = rng.integers(0, len(points), (9 * CHUNK + 3, 3))
    normals, joined = corner_normals(points, faces)
    np.testing.assert_array_equal(joined, faces)
    expected = np.zeros_like(points)
    for k in range(3):
        a, b, c = (points[faces[:, (k + j) % 3]] for j in range(3))
        cross = np.cross(b - a, c - a)
        size = np.linalg.norm(cross, axis=1)
        angle = np.arctan2(size, ((b - a) * (c - a)).sum(axis=1))
        np.add.at(
            expected, faces[:, k], cross * np.divide(angle, size, out=np.zeros_like(size), where=size > 0)[:, None]
        )
    np.testing.assert_allclose(normals, expected / np.linalg.norm(expected, axis=1, keepdims=True), atol=1e-9)
    twice, again = corner_normals(np.tile(points, (2, 1)), faces + 1000 * (np.arange(len(faces))[:, None] % 2))
    assert len(twice) == len(points)
    np.testing.assert_allclose(twice[again], normals[joined], atol=1e-12)


def test_flat_and_missing_normals():
    cancelled = mesh(vertices=[[0, 0, 0], [1, 0, 0], [0, 1, 0]], faces=[[0, 1, 2], [0, 2, 1]])
    arrays = packed(cancelled, mesh(smooth=False)).arrays
    normals = arrays.triangle_normals[np.argsort(arrays.triangles["shape"], kind="stable")]
    assert normals["bits"].tolist() == [1, 1] + 12 * [0]
    np.testing.assert_allclose(np.abs(decode(normals["n0"][:2])), [[0, 0, 1], [0, 0, 1]], atol=1e-4)


def test_normals_that_point_inwards_are_turned_round():
    inwards = [[0, 0, -1]] * 3
    triangle = {"vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "faces": [[0, 1, 2]], "normals": inwards}
    record = packed(mesh(**triangle)).arrays.triangle_normals[0]
    np.testing.assert_allclose(decode(np.array([record["n0"]])), [[0, 0, 1]], atol=1e-4)


def test_degenerate_triangles_are_skipped_and_counted():
    vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0], [1, 1e-9, 0]]
    faces = [[0, 1, 2], [0, 1, 3], [0, 0, 1], [0, 3, 4]]
    result = packed(sphere(), mesh(vertices=vertices, faces=faces))
    assert len(result.arrays.triangles) == len(result.arrays.triangle_normals) == 1
    assert result.warnings == ["/shapes/1: 3 degenerate triangles skipped"]


def test_equal_warnings_about_shapes_are_one_with_a_count():
    vertices = [[0, 0, 0], [0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, 0, 0]]
    fan, flat = [[0, 1, 2], [0, 1, 3], [0, 1, 4]], [0, 0, 1]
    fans = [mesh(vertices=vertices, faces=[*fan, *[flat] * count], material="glass") for count in (2, 2, 3)]
    crowded = "1 edge belongs to more than two triangles: light that passes through it may be wrong"
    assert packed(sphere(), *fans, materials=MATERIALS).warnings == [
        f"/shapes/1: {crowded} (here and in 2 more shapes)",
        "/shapes/1: 2 degenerate triangles skipped (with other counts also in 2 more shapes)",
    ]


MATERIALS = {
    "grey": GREY,
    "glass": {"type": "principled", "transmission": 1},
    "lamp": {**GREY, "emission": 1},
    "both": {**GREY, "emission": 1, "emission_sides": "both"},
    "veil": {**GREY, "alpha": 0.5},
    "leaf": {**GREY, "alpha": 0.9, "alpha_cutoff": 0.5},
}
ODD = {
    "coinciding": [*CUBE["faces"], CUBE["faces"][0]],
    "crowded": [*CUBE["faces"], [0, 1, 4]],
    "turned": [CUBE["faces"][0][::-1], *CUBE["faces"][1:]],
    "inwards": [face[::-1] for face in CUBE["faces"]],
}
SEEN = {
    ("coinciding", "glass"): "1 triangle coincides with another and 3 edges belong to more than two triangles: "
    "light that passes through it may be wrong",
    ("coinciding", "lamp"): "1 triangle coincides with another: light that it emits may be wrong",
    ("coinciding", "both"): "1 triangle coincides with another: light that it emits may be wrong",
    ("coinciding", "veil"): "1 triangle coincides with another: it is more opaque there",
    ("crowded", "glass"): "2 edges belong to more than two triangles: light that passes through it may be wrong",
    ("turned", "glass"): "3 edges join triangles that face opposite ways: light that passes through it may be wrong",
    ("turned", "lamp"): "3 edges join triangles that face opposite ways: light that it emits may be wrong",
    ("inwards", "glass"): "the mesh is closed and faces inwards: light that passes through it may be wrong",
    ("inwards", "lamp"): "the mesh is closed and faces inwards: light that it emits may be wrong",
}


@pytest.mark.parametrize("material", MATERIALS)
@pytest.mark.parametrize("oddity", ODD)
def test_odd_meshes_are_warned_about_where_the_picture_shows_it(oddity, material):
    shape = mesh(vertices=CUBE["vertices"], faces=ODD[oddity], material=material, smooth=False)
    expected = SEEN.get((oddity, material))
    assert packed(shape, materials=MATERIALS).warnings == ([f"/shapes/0: {expected}"] if expected else [])


def test_smooth_shading_shows_triangles_that_face_opposite_ways():
    """Their normals cancel, unless the file has its own."""
    shape = {"vertices": CUBE["vertices"], "faces": ODD["turned"]}
    told = "3 edges join triangles that face opposite ways: its smooth shading may be wrong there"
    assert packed(mesh(**shape)).warnings == [f"/shapes/0: {told}"]
    assert packed(mesh(**shape, normals=[[0, 0, 1]] * 8)).warnings == []


def test_which_of_two_colours_is_seen_is_arbitrary():
    """Of a leaf with a front and a back each side shows its own."""
    leaf = {
        "vertices": CUBE["vertices"][:3] * 2,
        "faces": [[0, 1, 2], [5, 4, 3]],
        "colors": [[1, 0, 0]] * 3 + [[0, 1, 0]] * 3,
    }
    told = "1 triangle coincides with one of other colours or texture coordinates: which of them is seen is arbitrary"
    assert packed(mesh(**leaf)).warnings == [f"/shapes/0: {told}"]
    assert packed(mesh(**leaf, double_sided=False)).warnings == []


def test_a_warning_follows_the_material_and_not_the_mesh():
    """The geometry is packed once."""
    cache, shape = PackCache(), mesh(vertices=CUBE["vertices"], faces=ODD["crowded"])
    for name, count in (("grey", 0), ("glass", 1)):
        assert len(packed(shape, cache=cache, materials={"grey": MATERIALS[name]}).warnings) == count
    assert len(cache.gather(Geometry)) == 1


def grid(size):
    """A bumpy one of 2 size^2 triangles, some of them degenerate: (vertices, faces, uvs)."""
    u, v = np.meshgrid(np.linspace(0, 1, size + 1), np.linspace(0, 1, size + 1), indexing="ij")
    vertices = np.stack([u, 0.1 * np.sin(9 * u) * np.cos(7 * v), v], axis=-1).reshape(-1, 3)
    place = np.arange(len(vertices)).reshape(size + 1, size + 1)
    a, b, c, d = (p.reshape(-1) for p in (place[:-1, :-1], place[:-1, 1:], place[1:, 1:], place[1:, :-1]))
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    faces[:: CHUNK // 3, 2] = faces[:: CHUNK // 3, 1]
    return vertices, faces, np.stack([u, v], axis=-1).reshape(-1, 2)


def test_triangles_of_a_large_mesh_are_all_there_with_what_is_theirs():
    vertices, faces, uvs = grid(120)
    assert len(faces) > CHUNK
    large = mesh(vertices=vertices.tolist(), faces=faces.tolist(), uvs=uvs.tolist(), material="checked")
    checked = {"type": "diffuse", "albedo": {"texture": "checks"}}
    textures = {"checks": {"type": "checker", "a": 0.2, "b": 0.8}}
    arrays = packed(large, mesh(), materials={"checked": checked, "grey": GREY}, textures=textures).arrays
    standing = np.flatnonzero(faces[:, 2] != faces[:, 1])
    of_large = arrays.triangles["shape"] == 0
    found = np.stack([arrays.triangles[name][of_large] for name in ("v0", "v1", "v2")], axis=1)
    assert len(arrays.triangles) == len(standing) + 12 and len(found) == len(standing)
    # uv 0..1 over x and z: by them each triangle is known
    np.testing.assert_allclose(arrays.triangle_uvs[of_large], found[:, :, [0, 2]], atol=1e-6)
    expected = vertices[faces[standing]].astype(np.float32).reshape(-1, 9)
    found = found.reshape(-1, 9)
    assert np.array_equal(found[np.lexsort(found.T)], expected[np.lexsort(expected.T)])
    cross = np.cross(found[:, 3:6] - found[:, :3], found[:, 6:] - found[:, :3])
    for name in ("n0", "n1", "n2"):
        assert (np.einsum("ij,ij->i", decode(arrays.triangle_normals[name][of_large]), cross) > 0).all()
