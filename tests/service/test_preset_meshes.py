"""The meshes of the built-in scenes: closed where light passes, small, and with normals on their outer sides."""

from __future__ import annotations

import io

import numpy as np
import pytest
import trimesh
from trimesh.visual import ColorVisuals

from service.document.presets import computed
from service.document.presets.generated import ASSETS, asset

MESHES = [name for name in ASSETS if asset(name).startswith(b"ply")]
# Glass, wax and flames, whose inside counts.
BODIES = ("tumbler", "whisky", "water-glass", "water", "ice", "wax", "flame", "flame-foot", "perfume-bottle")


def read(content: bytes) -> trimesh.Trimesh:
    mesh = trimesh.load(io.BytesIO(content), file_type="ply", process=False)
    assert isinstance(mesh, trimesh.Trimesh)
    return mesh


def loaded(name: str, merged: bool = False) -> trimesh.Trimesh:
    """`merged`: vertices that differ only in their normals or coordinates are one."""
    mesh = read(asset(name))
    if merged:
        mesh.merge_vertices(merge_norm=True, merge_tex=True, digits_vertex=5)
    return mesh


def test_the_knot_is_closed_smooth_and_faces_outward() -> None:
    mesh = loaded("torus-knot")
    assert 10_000 <= len(mesh.faces) <= 40_000
    assert mesh.is_watertight and mesh.is_winding_consistent and mesh.volume > 0
    assert mesh.euler_number == 0, "a torus, knotted or not"
    assert mesh.bounds[0][1] == 0, "it lies on the floor"
    cosines = (mesh.vertex_normals[mesh.faces[:, 0]] * mesh.face_normals).sum(axis=1)
    assert cosines.min() > 0.95
    assert np.linalg.norm(mesh.vertex_normals, axis=1) == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize("name", ["shader-ball", "shader-ball-stand"])
def test_the_shader_ball_is_of_closed_bodies_and_has_few_triangles(name: str) -> None:
    mesh = loaded(name)
    assert len(mesh.faces) < 10_000
    facing = (mesh.vertex_normals[mesh.faces].mean(axis=1) * mesh.face_normals).sum(axis=1)
    assert facing.min() > 0.5, "vertex normals lie on their triangles' outer sides"
    corners = mesh.vertices.round(5)
    mesh.merge_vertices(merge_norm=True, merge_tex=True, digits_vertex=5)
    assert mesh.is_watertight and mesh.volume > 0, "glass has an inside"
    assert corners[:, 1].min() >= 0


@pytest.mark.parametrize("name", MESHES)
def test_meshes_are_small_and_their_normals_lie_outside(name: str) -> None:
    mesh = loaded(name)
    assert len(mesh.faces) < 25_000 and len(asset(name)) < 1e6
    facing = (mesh.vertex_normals[mesh.faces].mean(axis=1) * mesh.face_normals).sum(axis=1)
    assert np.quantile(facing, 0.01) > 0.3


@pytest.mark.parametrize("name", BODIES)
def test_what_light_passes_has_an_inside(name: str) -> None:
    mesh = loaded(name, merged=True)
    assert mesh.is_watertight and mesh.volume > 0


@pytest.mark.parametrize(("glass", "filling"), [("tumbler", "whisky"), ("water-glass", "water")])
def test_a_liquid_reaches_into_its_glass(glass: str, filling: str) -> None:
    """All but its upper surface: else a film of air would be between them, and shine."""

    def radii(mesh: trimesh.Trimesh, side: int) -> tuple[np.ndarray, np.ndarray]:
        """Heights and distances from the axis of what is steep and looks outward (1) or inward (-1)."""
        away = np.hypot(mesh.vertices[:, 0], mesh.vertices[:, 2])
        outward = (mesh.vertices * mesh.vertex_normals)[:, [0, 2]].sum(axis=1) / np.maximum(away, 1e-9)
        chosen = np.flatnonzero(side * outward > 0.7)
        order = chosen[np.argsort(mesh.vertices[chosen, 1])]
        return mesh.vertices[order, 1], away[order]

    heights, reach = radii(loaded(filling), 1)
    assert len(heights) > 100
    assert (reach > np.interp(heights, *radii(loaded(glass), -1)) + 0.001).all()
    assert (reach < np.interp(heights, *radii(loaded(glass), 1)) - 0.001).all()


def test_labels_are_read_from_the_left() -> None:
    """An L has its foot on the right of its stem."""
    mesh = read(computed.written([("L", 0, 0, 0)], 1))
    centers = mesh.vertices.reshape(-1, 4, 3).mean(axis=1)[:, :2].tolist()
    assert sorted(centers) == [[0.5, y - 2.0] for y in range(5)] + [[1.5, -2.0], [2.5, -2.0]]
    assert (mesh.face_normals[:, 2] > 0).all()


def test_the_cyclorama_is_brightest_where_the_subject_stands() -> None:
    mesh = loaded("cyclorama")
    assert isinstance(mesh.visual, ColorVisuals)
    light = mesh.visual.vertex_colors[:, 0].astype(float)
    far = np.linalg.norm(mesh.vertices, axis=1)
    assert far[light.argmax()] < 1 and light[far > 8].max() < 0.25 * light.max()
    assert np.abs(mesh.face_normals[:, 0]).max() < 1e-6 and (mesh.face_normals[:, 1:] > -1e-6).all()
