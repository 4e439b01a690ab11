"""What an edit of one shape leaves as it is: the triangles and the tree of the meshes beside it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from service.document import parse_scene
from service.pack import PackCache, pack
from service.pack.geometry import assemble, scene_bvh
from tests.rendering import Images, document


def mesh_among(center: list[float], more: Sequence[dict[str, Any]] = (), **mesh: Any) -> dict[str, Any]:
    """A bumpy mesh of 200 triangles, a lamp, and a sphere at `center`."""
    side = np.linspace(-1, 1, 11)
    x, z = (axis.ravel() for axis in np.meshgrid(side, side))
    vertices = np.stack([x, np.sin(3 * x) * np.cos(2 * z), z], axis=1).tolist()
    quads = [(i, i + 1, i + 12, i + 11) for row in range(10) for i in range(11 * row, 11 * row + 10)]
    faces = [corners for a, b, c, d in quads for corners in ([a, c, b], [a, d, c])]
    lamp = {"type": "quad", "origin": [center[0], 5, 0], "u": [1, 0, 0], "v": [0, 0, 1], "material": "lamp"}
    sphere = {"type": "sphere", "center": center, "radius": 0.5, "material": "m", "visible_to_camera": False}
    bumps = {"type": "mesh", "vertices": vertices, "faces": faces, "material": "m", **mesh}
    materials = {"m": {"type": "diffuse", "albedo": 0.5}, "lamp": {"type": "diffuse", "albedo": 0, "emission": 5}}
    return document([lamp, bumps, sphere, *more], materials)


def assert_same(a: Any, b: Any) -> None:
    assert a.warnings == b.warnings
    for name, value in vars(a.arrays).items():
        other = getattr(b.arrays, name)
        assert np.array_equal(value, other) if isinstance(value, np.ndarray) else value == other, name


CROWD = [{"type": "sphere", "center": [i, 2, 0], "radius": 0.2, "material": "m"} for i in range(12)]


FIRST, FAR = mesh_among([-1.5, 2, 0]), {"transform": {"translate": [10_000, 0, 0]}}


@pytest.mark.parametrize(
    "first, change, planted",
    [
        (FIRST, mesh_among([1.5, 2, 0]), 0),
        (FIRST, mesh_among([1.5, 2, 0], CROWD[:3]), 0),
        (FIRST, mesh_among([-1.5, 2, 0], visible_to_camera=False), 1),
        (FIRST, mesh_among([-1.5, 2, 0], smooth=False), 1),
        (FIRST, mesh_among([-1.5, 2, 0], material="lamp"), 1),
        (FIRST, mesh_among([1.5, 2, 0], CROWD), 1),  # others in the tree
        (mesh_among([10_001, 2, 0], **FAR), mesh_among([9_999, 2, 0], **FAR), 0),
        (mesh_among([10_001, 2, 0], **FAR), mesh_among([1, 2, 0], **FAR), 1),  # another origin
    ],
)
def test_what_moves_beside_a_mesh_leaves_its_tree(
    monkeypatch: pytest.MonkeyPatch, first: dict[str, Any], change: dict[str, Any], planted: int
) -> None:
    calls = []
    monkeypatch.setattr(
        assemble, "build_scene_bvh", lambda *given: calls.append(given) or scene_bvh.build_scene_bvh(*given)
    )
    cache = PackCache()
    assert_same(pack(parse_scene(first), Images(), cache), pack(parse_scene(first), Images()))
    calls.clear()
    found = pack(parse_scene(change), Images(), cache)
    assert len(calls) == planted
    assert_same(found, pack(parse_scene(change), Images()))
    assert_same(pack(parse_scene(first), Images(), cache), pack(parse_scene(first), Images()))
