"""The lamps that distances in media are drawn towards, and whether anything comes through fog from infinity."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from gpu.arrays import SceneArrays
from gpu.device import lamps
from gpu.layout import LightKind
from service.document import parse_scene
from service.pack import pack
from tests.rendering import Images, document

FOG = {"type": "constant", "radiance": 1, "medium": {"scattering": 0.1}}


def _packed(shapes: list[Any], lights: list[Any], **more: Any) -> SceneArrays:
    made = {"lamp": {"type": "diffuse", "albedo": 0, "emission": 2}}
    return pack(parse_scene(document(shapes, made, lights=lights, **more)), Images()).arrays


def test_the_brightest_come_first() -> None:
    turned = {"scale": [1, 2, 0.5], "translate": [0, 0, 5]}
    shapes = [
        {"type": "sphere", "center": [1, 2, 3], "radius": 0.5, "material": "lamp"},
        {"type": "quad", "origin": [-1, 4, -1], "u": [2, 0, 0], "v": [0, 0, 3], "material": "lamp"},
        {"type": "sphere", "center": [0, 0, 0], "radius": 0.1, "transform": turned, "material": "lamp"},
    ]
    lights = [
        {"type": "directional", "direction": [0, -1, 0], "irradiance": 1e6},
        {"type": "point", "position": [7, 8, 9], "intensity": 5},
        {"type": "point", "position": [7, 8, -9], "intensity": 0.01},
    ]
    found = lamps.brightest(_packed(shapes, lights))
    expected = [(0, 4, 0.5, 12), (7, 8, 9, 5), (1, 2, 3, 0.5 * math.pi), (0, 0, 5, 0.02 * math.pi)]
    np.testing.assert_allclose(found.T, expected, rtol=1e-3, atol=1e-6)
    few = lamps.brightest(_packed([], lights[1:2]))
    np.testing.assert_allclose(few.T, [(7, 8, 9, 5), *[(0, 0, 0, 0)] * 3], rtol=1e-6)


@pytest.mark.parametrize(("scattering", "sampled"), [([0.1, 0.2, 0.3], False), ([0.1, 0, 0.3], True)])
def test_no_sky_is_sampled_through_fog_that_takes_all_of_it(scattering: Any, sampled: bool) -> None:
    fog = FOG | {"medium": {"scattering": scattering}}
    lights = _packed([], [{"type": "point", "position": [0, 0, 1], "intensity": 1}], environment=fog).lights
    assert (lights["kind"] == LightKind.ENVIRONMENT).any() == sampled
