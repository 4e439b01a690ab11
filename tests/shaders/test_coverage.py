"""Coverage of pixels by shapes and materials, over the rays of the picture's own samples."""

from __future__ import annotations

from typing import Any

import numpy as np

from gpu import Renderer
from gpu.layout.pixel_layers import COVER_RANKS
from tests.rendering import document, picture

MATERIALS = {"a": {"type": "diffuse", "albedo": 0.2}, "veil": {"type": "diffuse", "albedo": 0.5, "alpha": 0.25}}
BACK = {"type": "quad", "origin": [-9, -9, 0], "u": [18, 0, 0], "v": [0, 18, 0], "material": "a"}
VEIL = {**BACK, "origin": [-9, -9, 1], "material": "veil"}


def coverage(gpu: Renderer, shapes: list[dict[str, Any]], samples: int) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Pairs (height, width, ranks, 2) of both layers, and the picture's alpha."""
    made = picture(gpu, document(shapes, MATERIALS), samples, width=24, height=16)
    found = {aov: made.read(aov).reshape(16, 24, -1, 2) for aov in ("shape_coverage", "material_coverage")}
    alpha = made.read()[..., 3]
    made.release()
    made.scene.release()
    return found, alpha


def test_shares_are_what_the_rays_meet(gpu: Renderer) -> None:
    """A veil of opacity 1/4 takes a quarter of the rays; the wall behind it has the rest."""
    found, alpha = coverage(gpu, [BACK, VEIL], 256)
    assert (alpha == 1).all()
    for pairs in found.values():
        assert (pairs[..., :2, 0] == [1, 2]).all() and not pairs[..., 2:, :].any()
        np.testing.assert_allclose(pairs[..., 1].sum(-1), 1, atol=1e-6)
        np.testing.assert_allclose(pairs[..., 1, 1], 0.25, atol=0.13)  # 4.8 deviations of 256 independent rays
        assert abs(pairs[..., 1, 1].mean() - 0.25) < 0.01


def test_shares_add_up_where_there_are_more_things_than_ranks(gpu: Renderer) -> None:
    """Each pixel sees some of 4 000 small quads, which leave gaps; shares are of all its rays, and fall."""
    step = 0.05
    things = [
        {"type": "quad", "origin": [step * (k % 80 - 40), step * (k // 80 - 25), 0], "u": [0.8 * step, 0, 0],
         "v": [0, 0.8 * step, 0], "material": "a"}
        for k in range(4000)
    ]  # fmt: skip
    found, alpha = coverage(gpu, things, 64)
    shares = found["shape_coverage"][..., 1]
    np.testing.assert_allclose(shares.sum(-1), 1, atol=1e-5)
    assert (np.diff(shares, axis=-1) <= 0).all() and ((shares > 0).sum(-1) == COVER_RANKS).any()
    single = found["material_coverage"]
    np.testing.assert_allclose(np.where(single[..., 0] == 1, single[..., 1], 0).sum(-1), alpha, atol=1e-5)
    np.testing.assert_allclose(np.where(single[..., 0] == -1, single[..., 1], 0).sum(-1), 1 - alpha, atol=1e-5)


def test_materials_have_the_numbers_of_the_document(gpu: Renderer) -> None:
    """Not those of their records, which stand in the order of shapes."""
    found, _ = coverage(gpu, [{**BACK, "material": "veil"}, {**VEIL, "material": "a"}], 8)
    assert (found["material_coverage"][..., 0, 0] == 1).all(), "the wall in front is `a`, the first one"
    assert (found["shape_coverage"][..., 0, 0] == 2).all()
