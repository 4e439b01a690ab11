"""Meshes that are odd and rendered all the same: what is told of them."""

from __future__ import annotations

import re

import numpy as np
import pytest

from service.assets.readers import mesh_checks as oddities_module
from service.assets.readers.mesh_checks import mesh_warnings

POINTS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
CUBE = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4],
     [1, 5, 7], [1, 7, 3]], np.int32)  # fmt: skip
SEAMED = POINTS[CUBE].reshape(-1, 3), np.arange(36, dtype=np.int32).reshape(-1, 3)  # every corner a vertex of its own
FIN = np.array([[0, 1, 4]], np.int32)


@pytest.mark.parametrize(
    ("vertices", "faces", "told"),
    [
        (POINTS, CUBE, []),
        (*SEAMED, []),
        (POINTS, CUBE[:-1], []),
        (POINTS, CUBE[:, ::-1], ["faces inwards"]),
        (SEAMED[0], SEAMED[1][:, ::-1], ["faces inwards"]),
        (POINTS - 1e6, CUBE[:, ::-1], ["faces inwards"]),
        (
            POINTS,
            np.concatenate([CUBE[:1, ::-1], CUBE[1:]]),
            ["3 edges join triangles that face opposite ways"],
        ),
        (POINTS, np.concatenate([CUBE, CUBE[3:5, [1, 2, 0]]]), ["5 edges belong to more"]),
        (POINTS, np.concatenate([CUBE, FIN]), []),
        (POINTS, np.concatenate([CUBE[:1], CUBE[:1]]), ["3 edges join"]),
        (POINTS, np.array([[0, 1, 2], [0, 1, 4]], np.int32), ["^1 edge joins"]),
        (POINTS, np.array([[0, 1, 2], [1, 0, 4], [0, 1, 7]], np.int32), []),
        (POINTS, np.array([[0, 0, 1], [1, 1, 1]], np.int32), []),
    ],
)
@pytest.mark.parametrize("share", [oddities_module.SHARE, 4])
def test_oddities(
    vertices: np.ndarray, faces: np.ndarray, told: list[str], share: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(oddities_module, "SHARE", share)
    found = mesh_warnings(vertices, np.ascontiguousarray(faces))
    assert len(found) == len(told) and all(re.search(a, b) for a, b in zip(told, found, strict=True)), found


@pytest.mark.parametrize(
    ("faces", "told"),
    [
        (np.concatenate([CUBE, CUBE[3:5, [1, 2, 0]]]), "^2 triangles coincide"),
        (np.concatenate([CUBE[:-1], CUBE[:1]]), "^1 triangle coincides"),
    ],
)
def test_repeated_triangles_matter_where_they_carry_something(faces: np.ndarray, told: str) -> None:
    found = mesh_warnings(POINTS, np.ascontiguousarray(faces), varied=True)
    assert re.search(told, found[0]) and not any("belong" in line for line in found), found
