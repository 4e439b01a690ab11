"""What a ray meets does not depend on whether it went through the tree or through the loops."""

from __future__ import annotations

import numpy as np
import pytest

from gpu import Renderer, RenderSettings
from service.document import parse_scene
from service.pack import pack
from service.pack.geometry import scene_bvh
from tests.documents import Shelf, box, document, mesh, quad, sphere


def crowd():
    """Some of every kind of shape, strewn about, seen from among them."""
    rng = np.random.default_rng(5)

    def placed(scale):
        return {
            "translate": (rng.random(3) * 4 - 2).tolist(),
            "rotate": (rng.random(3) * 360).tolist(),
            "scale": scale,
        }

    shapes = [quad(origin=[-50, -1, 50], u=[100, 0, 0], v=[0, 0, -100])]
    shapes += [sphere(transform=placed(0.2)) for _ in range(20)]
    shapes += [sphere(transform=placed([0.3, -0.25, 0.18])) for _ in range(14)]
    shapes += [box(transform=placed([0.1, -0.05, 0.08])) for _ in range(20)]
    shapes += [quad(transform=placed(0.5)) for _ in range(30)]
    shapes += [mesh(transform=placed(0.4), double_sided=i % 2 == 0) for i in range(10)]
    return document(*shapes)


@pytest.mark.llvmpipe
def test_the_tree_finds_what_the_loops_find(gpu: Renderer, monkeypatch) -> None:
    seen = []
    for few, whole in ((0, 4096), (0, 0), (1, 4096), (10**6, 4096)):  # in treelets, too, and with some in the loop
        monkeypatch.setattr("gpu.accel.bvh.WHOLE", whole)
        monkeypatch.setattr(scene_bvh, "LARGE_SHARE", 1e-5 if few == 1 else 1.0)
        monkeypatch.setattr(scene_bvh, "LINEAR", dict.fromkeys(scene_bvh.LINEAR, few))
        arrays = pack(parse_scene(crowd()), Shelf()).arrays
        assert len(arrays.bvh_kinds) == (0 if few > 1 else 5)
        assert any(arrays.large.values()) == (few == 1)
        scene = gpu.load(arrays)
        picture = gpu.picture(scene, RenderSettings(64, 64, max_bounces=1))
        picture.trace(60.0, 4)
        seen.append((picture.read("depth"), picture.read("normal")))
        picture.release()
        scene.release()
    for depth, normal in seen[1:]:
        assert np.array_equal(depth, seen[0][0]) and np.array_equal(normal, seen[0][1])
    assert np.ptp(depth) > 0
