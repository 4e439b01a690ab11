"""Meshes that are odd and rendered all the same."""

from __future__ import annotations

import numpy as np
import pytest

from service.formats import MeshOddities
from service.formats.read import mesh_checks as oddities_module
from service.formats.read.mesh_checks import mesh_oddities

POINTS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
CUBE = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4],
     [1, 5, 7], [1, 7, 3]], np.int32)  # fmt: skip
SEAMED = POINTS[CUBE].reshape(-1, 3), np.arange(36, dtype=np.int32).reshape(-1, 3)  # every corner a vertex of its own
FIN = np.array([[0, 1, 4]], np.int32)


NONE = MeshOddities()


@pytest.mark.parametrize(
    ("vertices", "faces", "expected"),
    [
        (POINTS, CUBE, NONE),
        (*SEAMED, NONE),
        (POINTS, CUBE[:-1], MeshOddities(rim=3)),
        (POINTS, CUBE[:, ::-1], MeshOddities(inwards=True)),
        (SEAMED[0], SEAMED[1][:, ::-1], MeshOddities(inwards=True)),
        (POINTS - 1e6, CUBE[:, ::-1], MeshOddities(inwards=True)),
        (POINTS, np.concatenate([CUBE[:1, ::-1], CUBE[1:]]), MeshOddities(turned=3)),
        (POINTS, np.concatenate([CUBE, CUBE[3:5, [1, 2, 0]]]), MeshOddities(coinciding=2, crowded=5)),
        (POINTS, np.concatenate([CUBE, FIN]), MeshOddities(crowded=2, rim=1)),
        (POINTS, np.concatenate([CUBE[:1], CUBE[:1]]), MeshOddities(coinciding=1, turned=3)),
        (POINTS, np.array([[0, 1, 2], [0, 1, 4]], np.int32), MeshOddities(turned=1, rim=4)),
        (POINTS, np.array([[0, 1, 2], [1, 0, 4], [0, 1, 7]], np.int32), MeshOddities(crowded=1, rim=6)),
        (POINTS, np.array([[0, 0, 1], [1, 1, 1]], np.int32), NONE),
    ],
)
@pytest.mark.parametrize("share", [oddities_module.SHARE, 4])
def test_oddities(
    vertices: np.ndarray, faces: np.ndarray, expected: MeshOddities, share: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(oddities_module, "SHARE", share)
    assert mesh_oddities(vertices, np.ascontiguousarray(faces)) == expected


def test_triangles_that_coincide_and_look_different() -> None:
    """Of four copies of a triangle one has another colour at a corner, and one is turned round."""
    vertices, faces = np.tile(POINTS[:3], (4, 1)), np.arange(12, dtype=np.int32).reshape(-1, 3)
    faces[3] = faces[3, ::-1]
    colors = np.ones((12, 3), np.float32)
    uvs = vertices[:, :2].astype(np.float32)
    assert mesh_oddities(vertices, faces, uvs, colors).differing == 0
    colors[7] = 0
    found = mesh_oddities(vertices, faces, uvs, colors)
    assert (found.coinciding, found.differing) == (3, 1)
    assert mesh_oddities(vertices, faces, uvs).differing == 0
