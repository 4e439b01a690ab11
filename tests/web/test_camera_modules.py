"""Functions of the page's modules, called in the page: how cameras project, and colours by temperature and unit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Page

from service.colorimetry import planck_color
from tests.web.modules import call

CAMERA: dict[str, Any] = {"position": [1.0, 2.0, 5.0], "target": [0.0, 1.0, 0.0], "up": [0.0, 1.0, 0.0], "vfov": 40}
LENSES = ({"type": "perspective"}, {"type": "orthographic", "height": 3}, {"type": "panorama"})


@pytest.mark.parametrize("lens", LENSES, ids=[lens["type"] for lens in LENSES])
@pytest.mark.parametrize("position", [[0.0, 1.0, 5.0], [3.0, 4.0, -2.0]])
def test_a_point_is_seen_where_its_ray_goes(page: Page, position: list[float], lens: dict[str, Any]) -> None:
    camera = CAMERA | {"position": position} | lens
    for x, y in [(0.5, 0.5), (0.1, 0.8), (0.9, 0.25)]:
        origin, direction = (call(page, "document/camera.js", part, camera, x, y, 1.5) for part in ("eye", "ray"))
        place = np.add(origin, np.multiply(direction, 3)).tolist()
        seen = call(page, "document/camera.js", "project", camera, place, 1.5)
        assert (seen["x"], seen["y"]) == pytest.approx((x, y))
        assert seen["z"] > 0
        assert call(page, "picture/lamp-outlines.js", "spot", camera, np.add(origin, direction).tolist(), 1.5)[
            "isInside"
        ]
    if lens["type"] != "perspective":
        return
    behind = np.add(position, np.subtract(position, camera["target"])).tolist()
    above = np.add(behind, [0, 0.5, 0]).tolist()
    mark = call(page, "picture/lamp-outlines.js", "spot", camera, above, 1.5)
    assert not mark["isInside"] and mark["y"] == pytest.approx(0.04), "at the upper edge"


def test_temperatures_and_units_have_a_swatch(page: Page) -> None:
    for kelvin in (1500, 2700, 6500, 20000):
        assert np.allclose(call(page, "lib/color.js", "linear", {"kelvin": kelvin}), planck_color(kelvin), atol=0.02)
    shown = call(page, "lib/color.js", "linear", {"candela": 683, "color": {"kelvin": 2700}})
    assert np.allclose(shown, planck_color(2700), atol=0.02)
    assert call(page, "lib/color.js", "measureWords", {"lumen": 800, "color": "#ff8800"}) == "800 lm"
    assert call(page, "lib/color.js", "measureWords", [1, 1, 1]) is None
    typed = call(page, "lib/color.js", "parseColor", "2700 K")
    assert max(typed) == 1 and np.allclose(
        np.divide(typed, typed[0]), np.divide(planck_color(2700), planck_color(2700)[0]), atol=0.02
    )
