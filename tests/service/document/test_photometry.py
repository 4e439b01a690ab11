"""Colours by temperature, and strengths in photometric units."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from gpu import Renderer
from service.colorimetry import LUMINANCE, planck_color
from service.document import parse_scene
from service.problems import InvalidDocument
from tests.rendering import document, render

WARM = {"kelvin": 2700}
POINT = {"type": "point", "position": [0, 2, 0]}
SPOT = POINT | {"type": "spot", "direction": [0, -1, 0]}


def light(light: dict[str, Any]) -> Any:
    return parse_scene(document([], lights=[light])).lights[0]


def refused(pointer: str, **more: Any) -> str:
    with pytest.raises(InvalidDocument) as refused:
        parse_scene(document([], **more))
    assert refused.value.errors[0].pointer == pointer
    return refused.value.errors[0].detail


# x, y of the Planckian locus [CIE 15:2018; Wyszecki and Stiles, table 1(3.11)].
@pytest.mark.parametrize(
    ("kelvin", "x", "y"), [(2700, 0.4599, 0.4106), (5000, 0.3451, 0.3516), (10000, 0.2807, 0.2884)]
)
def test_temperatures_lie_on_the_locus(kelvin: float, x: float, y: float) -> None:
    xyz_of_rec709 = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    xyz = xyz_of_rec709 @ planck_color(kelvin)
    assert xyz[1] == pytest.approx(1, abs=1e-3)
    assert xyz[0] / xyz.sum() == pytest.approx(x, abs=4e-4) and xyz[1] / xyz.sum() == pytest.approx(y, abs=4e-4)


@pytest.mark.parametrize("kelvin", [1000, 1900, 40000])
def test_what_no_screen_shows_is_cut_off_and_luminance_stays(kelvin: float) -> None:
    color = planck_color(kelvin)
    assert min(color) >= 0 and float(LUMINANCE @ color) == pytest.approx(1)


def test_units_become_watts() -> None:
    assert light(POINT | {"intensity": {"candela": 683}}).intensity == (1, 1, 1)
    assert light(POINT | {"intensity": {"lumen": 683}}).intensity == pytest.approx([1 / (4 * math.pi)] * 3)
    sun = {"type": "directional", "direction": [0, -1, 0], "irradiance": {"lux": 1366}}
    assert light(sun).irradiance == (2, 2, 2)
    scene = document([], {"m": {"type": "principled", "emission": {"nit": 683, "color": WARM}}})
    emission = parse_scene(scene | {"environment": {"type": "constant", "radiance": {"nit": 683}}})
    assert emission.materials["m"].emission == pytest.approx(planck_color(2700))  # type: ignore[union-attr]
    assert emission.environment.radiance == (1, 1, 1)  # type: ignore[union-attr]


def test_a_color_beside_a_unit_says_nothing_of_the_strength() -> None:
    dim, bright = (light(POINT | {"intensity": {"candela": 100, "color": [x, x / 2, 0]}}) for x in (0.1, 7))
    assert dim.intensity == pytest.approx(bright.intensity)
    assert float(LUMINANCE @ dim.intensity) == pytest.approx(100 / 683)
    assert light(POINT | {"intensity": WARM}).intensity == planck_color(2700)


@pytest.mark.parametrize(("inner", "outer"), [(0, 30), (20, 40), (60, 60), (90, 90)])
def test_a_beam_holds_its_flux(gpu: Renderer, inner: float, outer: float) -> None:
    """What the spot sends through a ball around it, as the ball shows it from inside."""
    spot = SPOT | {"position": [0, 0, 0], "inner_angle": inner, "outer_angle": outer, "intensity": {"lumen": 683}}
    ball = {"type": "sphere", "center": [0, 0, 0], "radius": 2, "material": "m"}
    camera = {"type": "panorama", "position": [0, 0, 0], "target": [1, 0, 0]}
    scene = document([ball], {"m": {"type": "diffuse", "albedo": 1}}, lights=[spot], camera=camera)
    shown = render(gpu, scene, 64, max_bounces=1, width=128, height=64)[..., 0]
    rows = math.pi * (np.arange(64) + 0.5) / 64
    solid = np.sin(rows)[:, None] * (math.pi / 64) * (2 * math.pi / 128)
    flux = float((shown * solid).sum()) * math.pi * 2**2
    assert flux == pytest.approx(1, rel=0.01)


def test_what_is_no_such_strength_is_refused() -> None:
    def lamp(intensity: Any) -> dict[str, Any]:
        return {"lights": [POINT | {"intensity": intensity}]}

    at = "/lights/0/intensity"
    assert "candela" in refused(at, **lamp({"candela": 1, "lumen": 2})) and "lumen" in refused(at, **lamp({"nit": 3}))
    assert "-1" in refused(at, **lamp({"candela": -1}))
    assert "luminance" in refused(at + "/color", **lamp({"candela": 1, "color": 0}))
    assert "1000" in refused(at, **lamp({"kelvin": 999}))
    narrow = SPOT | {"inner_angle": 0, "outer_angle": 0, "intensity": {"lumen": 1}}
    assert "candela" in refused(at, lights=[narrow])
    too_much = {"m": {"type": "principled", "base_color": WARM}}
    assert "at most 1" in refused("/materials/m/base_color", materials=too_much)
    assert "nit" in refused("/materials/m/emission", materials={"m": {"type": "principled", "emission": {"lux": 1}}})
