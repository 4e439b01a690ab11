"""The shadow terminator: on coarse meshes with smooth normals the edge of the light is that of the smooth surface."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gpu import Renderer
from service.pack.geometry import instances
from tests.extremes.scenes import icosphere
from tests.normal_maps import facing
from tests.rendering import Images, assert_estimators_agree, document, render

SIZE = 96
CAMERA = {"position": [0, 0, 40], "target": [0, 0, 0], "vfov": 3}
BALL = {"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "m"}
MESH = icosphere("m", 2) | {"normals": icosphere("m", 2)["vertices"]}  # 320 triangles
SUN = {"type": "directional", "direction": [-1, -0.3, -0.1], "irradiance": 1}
LAMP = {"type": "point", "position": [8, 2.4, 0.8], "intensity": 70}
AWAY = {"translate": [50, 0, 0]}
# The same ball under a transform that mirrors and stretches.
OTHER = MESH | {"vertices": [[2 * x, y / 3, -z] for x, y, z in MESH["vertices"]],
                "normals": [[x / 2, y * 3, -z] for x, y, z in MESH["vertices"]],
                "transform": {"scale": [0.5, 3, -1]}}  # fmt: skip
PLACES: dict[str, list[dict[str, Any]]] = {
    "as it is": [MESH],
    "mirrored and stretched": [OTHER],
    "an instance": [MESH, {**MESH, "transform": AWAY}],
    "an instance, mirrored and stretched": [OTHER, {**OTHER, "transform": {"scale": [0.5, 3, -1], **AWAY}}],
}


def _seen(gpu: Renderer, shapes: list[dict[str, Any]], lights: list[dict[str, Any]], **more: Any) -> np.ndarray:
    """The red channel of a white matte thing."""
    scene = document(shapes, {"m": {"type": "diffuse", "albedo": 1}}, lights=lights, camera=CAMERA)
    return render(gpu, scene, 16, width=SIZE, height=SIZE, **more)[..., 0]


def _edge(light: dict[str, Any]) -> np.ndarray:
    """The pixels of a unit ball that are about the edge of the light and seen from no steeper than 64 degrees."""
    y, x = (np.mgrid[:SIZE, :SIZE] + 0.5) * 2 / SIZE - 1
    x, y = x * 40 * np.tan(np.radians(1.5)), -y * 40 * np.tan(np.radians(1.5))
    z = np.sqrt(np.maximum(1 - x * x - y * y, 0))
    p = np.stack([x, y, z], -1)
    to = np.array(light["position"]) - p if light["type"] == "point" else -np.array(light["direction"], float)
    cos = (p * to).sum(-1) / np.linalg.norm(to, axis=-1)
    out: np.ndarray = (np.hypot(x, y) < 0.9) & (abs(cos) < 0.25)
    return out


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("light", [SUN, LAMP], ids=["sun", "lamp"])
def test_a_coarse_ball_is_lit_like_a_ball(
    gpu: Renderer, monkeypatch: pytest.MonkeyPatch, light: dict[str, Any], place: str
) -> None:
    """With rays from the facets themselves these are 0.0031 and 0.028 in the sun, 0.0033 and 0.032 by the lamp."""
    monkeypatch.setattr(instances, "WORTH", 0)
    off = abs(_seen(gpu, PLACES[place], [light]) - _seen(gpu, [BALL], [light]))[_edge(light)]
    assert np.sqrt((off**2).mean()) < 0.001
    assert off.max() < 0.003


def test_a_normal_map_does_not_bring_the_facets_back(gpu: Renderer) -> None:
    """One that bends nothing is no different from none."""
    scene = document(
        [{**MESH, "uvs": [[x, y] for x, y, _ in MESH["vertices"]]}],
        {"m": {"type": "diffuse", "albedo": 1, "normal_map": {"texture": "flat"}}},
        lights=[SUN], camera=CAMERA, textures={"flat": {"asset": "flat"}},
    )  # fmt: skip
    mapped = render(gpu, scene, 16, width=SIZE, height=SIZE, assets=Images(flat=facing(0, 0, 1)))[..., 0]
    off = abs(mapped - _seen(gpu, [BALL], [SUN]))[_edge(SUN)]
    assert np.sqrt((off**2).mean()) < 0.001


def test_hollow_sides_and_flat_ones_stay_as_they_are(gpu: Renderer) -> None:
    """Light from beneath a dish does not come through it, and a facet whose normals are its own lifts nothing."""
    faces = [f for f in MESH["faces"] if max(MESH["vertices"][i][2] for i in f) <= 0]
    behind = {"type": "directional", "direction": [-0.3, -0.2, 1], "irradiance": 1}
    below = {"type": "directional", "direction": [-1, 0, 0.2], "irradiance": 1}
    dish = [{**MESH, "faces": faces}]
    for light in (behind, below):
        assert _seen(gpu, dish, [light]).max() == 0
    flat = {**MESH, "smooth": False}
    corners = [i for f in MESH["faces"] for i in f]
    v = np.array([MESH["vertices"][i] for i in corners])
    n = np.repeat(np.cross(v[1::3] - v[::3], v[2::3] - v[::3]), 3, 0)
    own = {**MESH, "vertices": v.tolist(), "normals": n.tolist(), "faces": np.arange(len(v)).reshape(-1, 3).tolist()}
    flat.pop("normals")
    np.testing.assert_allclose(_seen(gpu, [own], [SUN]), _seen(gpu, [flat], [SUN]), atol=1e-4)


WHITE = {"type": "constant", "radiance": 1, "background": False}
FURNACES: dict[str, dict[str, Any]] = {
    "matte": {"type": "diffuse", "albedo": 1},
    "metal": {"type": "principled", "base_color": 1, "metallic": 1, "roughness": 0.3},
    "mirror": {"type": "principled", "base_color": 1, "metallic": 1, "roughness": 0},
}


@pytest.mark.parametrize("material", FURNACES)
def test_a_white_coarse_ball_loses_no_light(gpu: Renderer, material: str) -> None:
    """A matte one of 80 triangles shows 0.992 where directions below the facets end."""
    scene = document([icosphere("m", 1)], {"m": FURNACES[material]}, environment=WHITE, camera=CAMERA)
    made = render(gpu, scene, 64, width=SIZE, height=SIZE, max_bounces=16)[..., 0]
    within = made[SIZE // 4 : -SIZE // 4, SIZE // 4 : -SIZE // 4]
    assert within.mean() == pytest.approx(1, abs=1e-3)


def test_estimators_agree_on_a_coarse_ball(gpu: Renderer) -> None:
    lamp = {"type": "quad", "origin": [1.6, -1, -1], "u": [0, 0, 2], "v": [0, 2, 0], "material": "lamp"}
    materials = {
        "m": {"type": "principled", "base_color": 0.8, "roughness": 0.4},
        "lamp": {"type": "diffuse", "albedo": 0, "emission": 3},
    }
    assert_estimators_agree(gpu, document([icosphere("m", 1), lamp], materials, environment=WHITE))
