"""Meshes: outside out, normals that interpolate, triangles that are there."""

from __future__ import annotations

import numpy as np
import pytest

from service.pack.normals import corner_normals, encode
from tests.documents import CUBE, MIRRORED, matrix_of, mesh, packed, sphere


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


def test_flat_and_missing_normals():
    cancelled = mesh(vertices=[[0, 0, 0], [1, 0, 0], [0, 1, 0]], faces=[[0, 1, 2], [0, 2, 1]])
    arrays = packed(cancelled, mesh(smooth=False)).arrays
    normals = arrays.triangle_normals[np.argsort(arrays.triangles["shape"], kind="stable")]
    assert normals["smoothed"].tolist() == [1, 1] + 12 * [0]
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
