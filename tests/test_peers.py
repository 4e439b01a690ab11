"""The comparison with another renderer compares like with like: same camera, same places, same light."""

from __future__ import annotations

import numpy as np
import pytest

from service.bench import peer_scenes, peers
from service.pack import pack
from service.scene import parse_scene


@pytest.mark.parametrize("case", peer_scenes.cases(), ids=lambda case: case.name)
def test_every_scene_is_described_for_both(case: peer_scenes.PeerCase) -> None:
    assert pack(parse_scene(case.scene), peer_scenes.BenchAssets()).warnings == []
    scene, arrays = peer_scenes.for_mitsuba(case, 64)
    assert sum(key.startswith("shape") for key in scene) == len(case.scene["shapes"])
    assert scene["integrator"]["max_depth"] == case.max_bounces + 1
    assert ("environment" in scene) == ("environment" in case.scene) == ("environment" in arrays)


def test_a_parallelogram_stands_where_ours_does() -> None:
    quad = {"type": "quad", "origin": [1, 2, 3], "u": [2, 0, 0], "v": [0, 0, -4], "material": "m"}
    matrix = np.reshape(peer_scenes._shape(quad, {})["to_world"]["matrix"], (4, 4))
    corners = [matrix @ [x, y, 0, 1] for x, y in ((-1, -1), (1, -1), (-1, 1))]
    assert np.allclose([c[:3] for c in corners], [[1, 2, 3], [3, 2, 3], [1, 2, -1]])
    assert np.allclose(matrix[:3, 2], [0, 1, 0])  # the outward side is the one that shines


def test_error_is_relative_where_it_is_bright_and_absolute_where_it_is_dark() -> None:
    reference = np.array([[[0.0, 10.0, 0.1]]])
    assert peers.rel_mse(reference * 1.1, reference) == pytest.approx((1 / 100.01 + 1e-4 / 0.02) / 3)


def test_runs_are_scaled_to_the_moment() -> None:
    picture = np.full((2, 2, 3), 1.1)
    course = peers.Course(np.array([1.25, 10.5]), np.array([4, 40]), np.stack([picture, picture]))
    summary = peers._summary([course], np.ones((2, 2, 3)), 2)
    assert summary["rel_mse"] == pytest.approx([1.25 * 0.01 / 1.01, 1.05 * 0.01 / 1.01])
    assert summary["mpaths_per_s"] == pytest.approx(40 / 10.5 * 4 / 1e6)
