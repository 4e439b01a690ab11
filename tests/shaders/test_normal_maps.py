"""Normal maps point where glTF says, on the base and on the coat, and neither gain light nor turn it black."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from gpu import ESTIMATORS, Renderer
from tests.marks import seldom
from tests.normal_maps import MAPS, TEXTURES
from tests.rendering import document, render
from tests.shaders.textured import BALL, BARE, BOX, QUAD, at, on_ball

WHITE = {"type": "constant", "radiance": 1, "background": False}


RECTANGLE = {
    **BARE, "vertices": [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], "faces": [[0, 1, 2], [0, 2, 3]],
    "normals": [[0, 0, 1]] * 4,
}  # fmt: skip
UPRIGHT, MIRRORED = [[0, 0], [1, 0], [1, 1], [0, 1]], [[1, 0], [0, 0], [0, 1], [1, 1]]
TURNED = [[0, 1], [0, 0], [1, 0], [1, 1]]  # u grows along +y, v along -x
P, EAST = on_ball(1, 0, 0)[0], [0, 0, -1]

DIRECTIONS = [
    # shape, place, from where, which way u and v grow there, outward
    (QUAD, [0.3, 0.2, 0], [0, 0, 3], [1, 0, 0], [0, 1, 0], [0, 0, 1]),
    (QUAD, [0.3, 0.2, 0], [0, 0, -3], [1, 0, 0], [0, 1, 0], [0, 0, 1]),  # from behind: as if turned over
    ({**QUAD, "transform": {"scale": [-1, 1, 1]}}, [0.3, 0.2, 0], [0, 0, 3], [-1, 0, 0], [0, 1, 0], [0, 0, 1]),
    (BALL, P, [2, 0, 0], EAST, [0, 1, 0], [1, 0, 0]),
    ({**BALL, "transform": {"scale": [1, 1, -1]}}, P, [2, 0, 0], [0, 0, 1], [0, 1, 0], [1, 0, 0]),
    ({**BALL, "transform": {"rotate": [0, 0, 90]}}, [0, 2, 0], [0, 2, 0.01], EAST, [-1, 0, 0], [0, 1, 0]),
    (BOX, [1, 0.5, 1], [4, 0, 0], EAST, [0, 1, 0], [1, 0, 0]),
    (BOX, [0.5, 2, 1], [0, 4, 0.01], [1, 0, 0], [0, 0, -1], [0, 1, 0]),
    ({**RECTANGLE, "uvs": UPRIGHT}, [0.3, 0.2, 0], [0, 0, 3], [1, 0, 0], [0, 1, 0], [0, 0, 1]),
    ({**RECTANGLE, "uvs": MIRRORED}, [0.3, 0.2, 0], [0, 0, 3], [-1, 0, 0], [0, 1, 0], [0, 0, 1]),
    ({**RECTANGLE, "uvs": TURNED}, [0.3, 0.2, 0], [0, 0, 3], [0, 1, 0], [-1, 0, 0], [0, 0, 1]),
]


@pytest.mark.parametrize(("shape", "place", "away", "u", "v", "n"), DIRECTIONS)
def test_red_is_along_u_and_green_along_v(
    gpu: Renderer, shape: Any, place: Any, away: Any, u: Any, v: Any, n: Any
) -> None:
    for name, along in (("right", u), ("up", v)):
        material = {"type": "diffuse", "albedo": 1, "normal_map": {"texture": name}}
        scene = document([shape], {"m": material}, textures=TEXTURES, camera=at(place, away, (0.01, 1, 0.01)))
        got = render(gpu, scene, 1, "normal", assets=MAPS, width=8, height=8).mean((0, 1))
        side = np.sign(np.dot(away, n))
        np.testing.assert_allclose(got, side * (0.8 * np.array(n) + 0.6 * np.array(along)), atol=2e-3)


@pytest.mark.parametrize(
    ("placing", "right", "up"),
    [
        ({"rotation": 90}, [0, -1], [1, 0]),  # uv' turns counter-clockwise, so the image clockwise
        ({"rotation": 30, "scale": [5, 5]}, [math.cos(math.pi / 6), -0.5], [0.5, math.cos(math.pi / 6)]),
        ({"scale": [-2, 3]}, [-1, 0], [0, 1]),
        ({"scale": [1, -1], "rotation": 90}, [0, 1], [1, 0]),  # u and v change places
    ],
)
def test_bumps_turn_with_their_image(gpu: Renderer, placing: Any, right: Any, up: Any) -> None:
    for name, along in (("right", right), ("up", up)):
        material = {"type": "diffuse", "albedo": 1, "normal_map": {"texture": name}}
        textures = {name: {"asset": name, **placing}}
        scene = document([QUAD], {"m": material}, textures=textures, camera=at([0.3, 0.2, 0], [0, 0, 3]))
        got = render(gpu, scene, 1, "normal", assets=MAPS, width=8, height=8).mean((0, 1))
        np.testing.assert_allclose(got, [*(0.6 * np.array(along)), 0.8], atol=2e-3)


def test_strength_flattens(gpu: Renderer) -> None:
    material = {"type": "diffuse", "albedo": 1, "normal_map": {"texture": "right", "scale": 0.5}}
    scene = document([QUAD], {"m": material}, textures=TEXTURES, camera=at([0, 0, 0], [0, 0, 2]))
    got = render(gpu, scene, 1, "normal", assets=MAPS, width=8, height=8).mean((0, 1))
    np.testing.assert_allclose(got, np.array([0.3, 0, 0.8]) / np.hypot(0.3, 0.8), atol=1e-3)


MATERIALS: list[dict[str, Any]] = [
    {"type": "diffuse", "albedo": 1},
    {"type": "principled", "metallic": 1, "base_color": 1, "roughness": 0},
    {"type": "principled", "metallic": 1, "base_color": 1, "roughness": 0.4},
    {"type": "principled", "transmission": 1, "base_color": 1, "roughness": 0},
    {"type": "principled", "transmission": 1, "base_color": 1, "roughness": 0.4},
]


@pytest.mark.parametrize("shape", [QUAD, BALL], ids=["quad", "ball"])
@pytest.mark.parametrize("material", seldom(MATERIALS, MATERIALS[3:4]), ids=str)
def test_a_white_furnace_stays_white_under_steep_normals(gpu: Renderer, material: Any, shape: Any) -> None:
    """60 degrees off: what a lobe sends below the surface is not lost, and nothing is added. Light that is trapped in
    glass by its facets leaves late: hence so many bounces."""
    bent = {**material, "normal_map": {"texture": "n"}}
    scene = document([shape], {"m": bent}, textures=TEXTURES, environment=WHITE,
                     camera={"position": [1, 1, 7], "target": [0, 0, 0], "vfov": 36})  # fmt: skip
    image = render(gpu, scene, 128, assets=MAPS, max_bounces=600)
    seen = image[image[..., 3] == 1][:, :3]
    error = seen.std() / np.sqrt(len(seen))
    assert seen.mean() + 3 * error > 0.99 and seen.mean() - 3 * error < 1.003, (seen.mean(), error)


COATED = {"type": "principled", "base_color": 0.8, "roughness": 0.5, "clearcoat": 1, "clearcoat_roughness": 0.2}


@pytest.mark.parametrize("maps", [(None, "c"), ("n", "c")])
def test_estimators_agree_under_maps_on_base_and_coat(gpu: Renderer, maps: Any) -> None:
    named = zip(("normal_map", "clearcoat_normal_map"), maps, strict=True)
    material = {**COATED, **{field: {"texture": name} for field, name in named if name}}
    lamp = {"type": "sphere", "center": [2, 2, 3], "radius": 0.8, "material": "lamp"}
    scene = document([QUAD, lamp], {"m": material, "lamp": {"type": "diffuse", "albedo": 0, "emission": 6}},
                     textures=TEXTURES, environment={**WHITE, "radiance": 0.3},
                     camera={"position": [1, 0, 3], "target": [0, 0, 0], "vfov": 40})  # fmt: skip
    used = ESTIMATORS if maps[0] else ("mis", "bsdf")
    means = {e: render(gpu, scene, 256, assets=MAPS, estimator=e, max_bounces=4)[..., :3].mean() for e in used}
    assert all(mean == pytest.approx(means["mis"], rel=0.015) for mean in means.values()), means


def test_a_coats_map_leaves_the_base_alone_and_the_other_way_round(gpu: Renderer) -> None:
    """A lamp mirrored in the coat moves with the coat's map only; light on a matte base with the base's only."""

    def shot(lamp: list[float], **material: Any) -> float:
        base = {**COATED, "base_color": 0, "clearcoat_roughness": 0, "specular": 0, **material}
        ball = {"type": "sphere", "center": lamp, "radius": 0.2, "material": "lamp"}
        scene = document([QUAD, ball], {"m": base, "lamp": {"type": "diffuse", "albedo": 0, "emission": 1}},
                         textures=TEXTURES, camera=at([0, 0, 0], [0, 0, 3]))  # fmt: skip
        return float(render(gpu, scene, 16, assets=MAPS, width=8, height=8)[..., :3].mean())

    mirrored = [2 * 0.96, 0, 2 * 0.28]  # where (0.6, 0, 0.8) reflects the viewer to
    assert shot(mirrored) == 0
    assert shot(mirrored, normal_map={"texture": "right"}) == 0
    assert shot(mirrored, clearcoat_normal_map={"texture": "right"}) > 0.02
    matte = {"base_color": 1, "clearcoat": 0}
    lit = [shot(mirrored, **matte, **more) for more in ({}, {"clearcoat_normal_map": {"texture": "right"}},
                                                         {"normal_map": {"texture": "right"}})]  # fmt: skip
    assert lit[0] == pytest.approx(lit[1], rel=1e-4) and lit[2] > 2 * lit[0]
