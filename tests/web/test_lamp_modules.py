"""Functions of the page's modules, called in the page: lamps as a photographer sets them, and their outlines."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Page

from service.colorimetry import LUMINANCE, planck_color
from tests.web.modules import call

LIGHT = "document/lamp-light.js"
CAMERA = {"type": "perspective", "position": [0, 1, 5], "target": [0, 1, 0], "up": [0, 1, 0], "vfov": 40}
QUAD = {"type": "quad", "origin": [-1, 2, 2], "u": [2, 0, 0], "v": [0, -1, 0], "material": "lamp"}
LAMPS: dict[str, dict[str, Any]] = {
    "quad": QUAD,
    "turned quad": QUAD | {"transform": {"rotate": [0, 30, 0], "scale": 2}},
    "disk": {"type": "disk", "center": [0, 2, 2], "normal": [0, -1, -2], "radius": 0.5, "material": "lamp"},
    "cylinder": {"type": "cylinder", "base": [-1, 2, 2], "axis": [2, 0, 0], "radius": 0.1, "material": "lamp"},
    "sphere": {"type": "sphere", "center": [0, 2, 2], "radius": 0.5, "material": "lamp"},
}
THING = "/shapes/1"


def scene(lamp: dict[str, Any], **material: Any) -> dict[str, Any]:
    ball = {"type": "sphere", "center": [0, 1, 0], "radius": 1, "material": "ball"}
    lit = {"type": "diffuse", "albedo": 0, "emission": [8, 6, 4]} | material
    return {"shapes": [ball, lamp], "materials": {"ball": {"type": "diffuse"}, "lamp": lit}, "camera": CAMERA}


def sizes(page: Page, lamp: dict[str, Any]) -> dict[str, float]:
    return {size["name"]: size["value"] for size in call(page, LIGHT, "sizesOf", lamp)}


def area(lamp: dict[str, Any], measures: dict[str, float]) -> float:
    """What is seen of it from the front."""
    if lamp["type"] == "quad":
        return measures["width"] * measures["height"]
    if lamp["type"] == "cylinder":
        return 2 * measures["radius"] * measures["length"]
    return math.pi * measures["radius"] ** 2


def middle(page: Page, lamp: dict[str, Any]) -> list[float]:
    found: list[float] = call(page, "document/lamps.js", "positionOf", lamp)
    return found


@pytest.mark.parametrize("name", LAMPS)
def test_a_larger_lamp_shines_as_before_and_stays_where_it_is(page: Page, name: str) -> None:
    before = scene(LAMPS[name])
    lamp = before["shapes"][1]
    measures = sizes(page, lamp)
    for measure, value in measures.items():
        after = call(page, LIGHT, "withSize", before, THING, measure, 1.5 * value)
        grown = after["shapes"][1]
        now = sizes(page, grown)
        assert now[measure] == pytest.approx(1.5 * value, rel=1e-4)
        others = {each: length for each, length in measures.items() if each != measure}
        assert {each: now[each] for each in others} == pytest.approx(others, rel=1e-4)
        assert middle(page, grown) == pytest.approx(middle(page, lamp), abs=1e-4)
        given = np.multiply(after["materials"]["lamp"]["emission"], area(grown, now))
        assert given == pytest.approx(np.multiply([8, 6, 4], area(lamp, measures)), rel=1e-3)


def test_others_that_shine_with_a_material_are_left_alone(page: Page) -> None:
    shared = scene(LAMPS["quad"])
    shared["shapes"].append(LAMPS["disk"])
    after = call(page, LIGHT, "withSize", shared, THING, "width", 4)
    assert after["materials"] == shared["materials"] and after["shapes"][2] == shared["shapes"][2]
    assert sizes(page, after["shapes"][1])["width"] == pytest.approx(4)


@pytest.mark.parametrize("name", LAMPS)
def test_softness_is_size_over_distance(page: Page, name: str) -> None:
    before = scene(LAMPS[name])
    stand = call(page, LIGHT, "standing", before, before["shapes"][1], CAMERA)
    assert stand["target"] == [0, 1, 0] and stand["distance"] == pytest.approx(
        math.dist(middle(page, before["shapes"][1]), [0, 1, 0])
    )
    after = call(page, LIGHT, "withSoftness", before, THING, stand, 0.8)
    grown = after["shapes"][1]
    assert math.sqrt(area(grown, sizes(page, grown))) / stand["distance"] == pytest.approx(0.8, rel=1e-3)
    nearer = call(page, LIGHT, "withDistance", before, THING, stand, 3)
    assert math.dist(middle(page, nearer["shapes"][1]), [0, 1, 0]) == pytest.approx(3, rel=1e-4)
    assert nearer["materials"] == before["materials"], "nearer is brighter: nothing makes up for it"


def test_another_colour_is_as_bright(page: Page) -> None:
    rgb = call(page, LIGHT, "tinted", [8, 6, 4], list(planck_color(2700)))
    assert LUMINANCE @ rgb == pytest.approx(LUMINANCE @ [8, 6, 4])
    assert np.divide(rgb, max(rgb)) == pytest.approx(np.divide(planck_color(2700), max(planck_color(2700))))
    assert LUMINANCE @ call(page, LIGHT, "tinted", [0, 0, 0], [1, 0, 0]) == pytest.approx(1), "what was off comes on"


def test_the_strength_stands_where_the_model_has_it(page: Page) -> None:
    after = call(page, LIGHT, "withLight", scene(QUAD), THING, [1.23456789, 0, 3e-17])
    assert after["materials"]["lamp"]["emission"] == [1.2346, 0, 3e-17]
    open_pbr = scene(QUAD)
    open_pbr["materials"]["lamp"] = {"type": "openpbr", "emission_luminance": 683}
    assert call(page, LIGHT, "lightOf", open_pbr, QUAD) == pytest.approx([1, 1, 1])
    after = call(page, LIGHT, "withLight", open_pbr, THING, [2, 1, 0.5])
    lamp = after["materials"]["lamp"]
    assert lamp["emission_luminance"] == 1366 and lamp["emission_color"] == [1, 0.5, 0.25]
    spot = {"type": "spot", "intensity": {"candela": 683}, "inner_angle": 60, "outer_angle": 60}
    assert call(page, LIGHT, "lightOf", scene(QUAD), spot) == pytest.approx([1, 1, 1])
    units = call(page, LIGHT, "photometry", scene(QUAD), spot)
    assert units == pytest.approx({"lm": 683 * math.pi, "cd": 683}), "half of what a whole hemisphere takes"
    units = call(page, LIGHT, "photometry", scene(QUAD), QUAD)
    assert units == pytest.approx({"lm": 683 * math.pi * 2, "nt": 683})


@pytest.mark.parametrize("kelvin", [1850, 2700, 3200, 5600, 6500, 10000])
def test_a_temperature_is_found_again(page: Page, kelvin: int) -> None:
    rgb = [0.3 * x for x in planck_color(kelvin)]
    assert call(page, "lib/temperature.js", "temperatureOf", rgb) == pytest.approx(kelvin, rel=0.015)
    own = call(page, "lib/color.js", "linear", {"kelvin": kelvin})
    assert call(page, "lib/temperature.js", "temperatureOf", own) == pytest.approx(kelvin, rel=0.004)


def test_other_colours_have_no_temperature(page: Page) -> None:
    assert call(page, "lib/temperature.js", "temperatureOf", [1, 1, 1]) == pytest.approx(6500, rel=0.03)
    for rgb in ([0, 1, 0], [1, 0, 1], [0.2, 0.9, 0.3], [0, 0, 0]):
        assert call(page, "lib/temperature.js", "temperatureOf", rgb) is None
    for text, light in (("2700K", 2700), ("2 700 K", 2700), ("5600", 5600), ("900", None), ("50000 K", None)):
        assert call(page, "lib/temperature.js", "parseLight", text) == light
    assert call(page, "lib/temperature.js", "parseLight", "#ff0000") == [1, 0, 0]


def test_outlines_of_lamps(page: Page) -> None:
    view = {"camera": CAMERA, "aspect": 1.5, "height": 600}
    for name in ("quad", "disk", "cylinder"):
        path = call(page, "picture/lamp-outlines.js", "outlinePath", LAMPS[name], view)
        points = np.array([point.split() for point in path.strip("MZ").split("L")], float)
        assert len(points) >= 4 and path.endswith("Z")
        assert 0 < points[:, 1].max() - points[:, 1].min() < 600
    # A wall beside the eye, half of which is behind it: what is before it, cut off.
    wall = {"type": "quad", "origin": [1, 0, 0], "u": [0, 0, 20], "v": [0, 2, 0], "material": "lamp"}
    assert call(page, "picture/lamp-outlines.js", "outlinePath", wall, view).count("L") == 3
    behind = wall | {"origin": [1, 0, 6]}
    assert call(page, "picture/lamp-outlines.js", "outlinePath", behind, view) == ""
    assert len(call(page, "picture/lamp-outlines.js", "hull", [[0, 0], [2, 0], [1, 1], [2, 2], [0, 2]])) == 4


def test_arrows_stay_clear_of_what_lies_over_the_picture(page: Page) -> None:
    room = {"left": 0, "top": 0, "right": 800, "bottom": 600}
    bar = {"left": 100, "top": 10, "right": 700, "bottom": 50}
    size = 20

    def clear(x: float, y: float, boxes: list[dict[str, float]]) -> dict[str, float]:
        found: dict[str, float] = call(
            page, "picture/lamp-outlines.js", "clearOf", {"x": x, "y": y}, size, boxes, room
        )
        return found

    assert clear(400, 300, [bar]) == {"x": 400, "y": 300}
    assert clear(400, 5, [bar]) == {"x": 400, "y": 70}, "under the bar"
    assert clear(90, 20, [bar]) == {"x": 80, "y": 20}, "beside it, where that is nearer"
    assert clear(-50, 700, [bar]) == {"x": 20, "y": 580}, "all of it in the picture"
    other = {"left": 380, "top": 50, "right": 420, "bottom": 90}
    beside = clear(400, 5, [bar, other])
    assert beside["y"] == 70 and abs(beside["x"] - 400) == 40, "no two on one another"
    above = call(page, "picture/lamp-outlines.js", "spot", CAMERA, [0, 9, 0], 1.5)
    assert not above["isInside"] and above["way"] == pytest.approx(-math.pi / 2)
