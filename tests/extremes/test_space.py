"""Small and large, near and far: the same picture, sample by sample, wherever float32 can hold it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from gpu import Renderer
from service.pack.geometry.rebase import LOST, VAST
from tests.extremes.scenes import Seen, ball, everything, icosphere, moved, packed, quad, rows, scaled


@pytest.fixture(scope="module")
def seen(gpu: Renderer) -> Seen:
    return Seen(gpu, everything())


@pytest.fixture(scope="module")
def small_balls(gpu: Renderer) -> dict[str, Seen]:
    return {place: Seen(gpu, _with_ball(1e-5, center)) for place, center in AWAY.items()}


@pytest.fixture(scope="module")
def ball_of_1(gpu: Renderer) -> Seen:
    return Seen(gpu, _with_ball(1.0, [0, 0, 0]))


@pytest.fixture(scope="module")
def flat(gpu: Renderer) -> Seen:
    return Seen(gpu, _standing(FLOOR))


SCALES = rows({"1e-4": 1e-4, "2^10": 2.0**10, "1e5": 1e5}, {"2^-13": 2.0**-13, "0.01": 0.01, "100": 100.0})


@pytest.mark.parametrize("row", SCALES)
def test_scaled_with_its_lights_it_looks_the_same(gpu: Renderer, seen: Seen, row: str) -> None:
    other = Seen(gpu, scaled(everything(), SCALES[row]))
    assert all("caustics" in line for line in other.warnings)
    assert other.alike(seen) > 0.995  # paths that a rounding sends elsewhere
    assert other.deviation(seen) < 0.05
    if row.startswith("2^"):
        assert (other.color == seen.color).all()  # nothing hangs on an absolute length


PLACES: dict[str, float | Sequence[float]] = rows(
    {"2^0": 1.0, "2^4": 16.0, "2^17": 2.0**17, "1e6": [1e6, -1e6, 3e5]},
    {f"2^{k}": 2.0**k for k in (*range(1, 4), *range(5, 17))} | {"-1e6": -1e6},
)


@pytest.mark.parametrize("row", PLACES)
def test_moved_it_looks_the_same(gpu: Renderer, seen: Seen, row: str) -> None:
    other = Seen(gpu, moved(everything(), PLACES[row]))
    assert all("caustics" in line for line in other.warnings)
    assert other.alike(seen) > 0.99
    assert other.deviation(seen) < 0.05


RADII = {"1e-6": 1e-6, "1e-3": 1e-3, "1": 1.0, "1e4": 1e4, "1e7": 1e7}
AWAY = {"at 0": [0, 0, 0], "at (0.3, 0.5, -7)": [0.3, 0.5, -7]}


def _with_ball(radius: float, center: list[float]) -> dict[str, Any]:
    """Over a floor, where there is room beneath it."""
    x, y, z = center
    camera = {"position": [x, y + radius, z + 4 * radius], "target": center, "vfov": 40}
    shapes = [ball("metal", center, radius), quad("white", (-90, -1, 90), (180, 0, 0), (0, 0, -180))]
    return everything(shapes=shapes[: 2 if radius < 1 else 1], camera=camera, lights=[])


@pytest.mark.parametrize("place", AWAY)
@pytest.mark.parametrize("row", RADII)
def test_a_ball_of_any_radius_looks_the_same(
    gpu: Renderer, small_balls: dict[str, Seen], ball_of_1: Seen, row: str, place: str
) -> None:
    one = small_balls[place] if RADII[row] < 1 else ball_of_1
    other = Seen(gpu, _with_ball(RADII[row], AWAY[place]))
    assert all("caustics" in line for line in other.warnings)
    assert other.alike(one) > 0.97
    assert other.deviation(one) < 0.1


def _standing(*ground: dict[str, Any]) -> dict[str, Any]:
    """Things on a floor that touches the origin, or on what passes for one there."""
    camera = {"position": [0, 1.6, 6], "target": [0, 0.2, 0], "vfov": 30}
    box = {"type": "box", "min": [0.6, 0, 0], "max": [1.6, 1, 1], "material": "gltf"}
    sun = {"type": "directional", "direction": [-0.5, -1, -0.3], "irradiance": 3}
    return everything(shapes=[*ground, box, ball("metal", (-1.2, 1, 0))], lights=[sun], camera=camera)


FLOOR = quad("white", (-300, 0, 300), (600, 0, 0), (0, 0, -600))
GROUNDS = {
    "ball 1e5": ball("white", (0, -1e5, 0), 1e5),
    "ball 1e6": ball("white", (0, -1e6, 0), 1e6),
    "ball 1e7": ball("white", (0, -1e7, 0), 1e7),
    "quad 1e7": quad("white", (-1e7, 0, 1e7), (2e7, 0, 0), (0, 0, -2e7)),
    "box 1e6": {"type": "box", "min": [-1e6, -9, -1e6], "max": [1e6, 0, 1e6], "material": "white"},
}


@pytest.mark.parametrize("row", GROUNDS)
def test_things_stand_on_vast_ground(gpu: Renderer, flat: Seen, row: str) -> None:
    """Below the horizon a globe looks like a floor, its shadows where they belong."""
    other = Seen(gpu, _standing(GROUNDS[row]))
    assert all("caustics" in line for line in other.warnings)
    below = slice(24, None)
    assert np.mean(np.abs(flat.color - other.color)[below] < 0.01 * flat.color[below]) > 0.95
    assert other.color[below].mean() == pytest.approx(flat.color[below].mean(), rel=3e-3)


def test_what_float32_does_not_hold_is_said() -> None:
    def warned(*shapes: dict[str, Any]) -> list[str]:
        return packed(everything(shapes=list(shapes))).warnings

    far = 2 * LOST
    assert warned(icosphere("white", 1, translate=[far / 4, 0, 0]), ball("white", (-far / 4, 0, 0))) == []
    lost = warned(icosphere("white", 1, translate=[1.5 * far, 0, 0]), ball("white", (-1.5 * far, 0, 0)))
    assert [line.split(":")[0] for line in lost] == ["/shapes/0", "/shapes/1"]
    assert "place is known to 0.1%" in lost[0]
    tilted = quad("white", (-VAST, -VAST, VAST), (2 * VAST, 2 * VAST, 0), (0, 0, -2 * VAST))
    (line,) = warned(tilted, ball("white", radius=0.5))
    assert line.startswith("/shapes/0: is 2.62e+05 m across beside shapes of 1 m")
    assert warned(tilted, ball("white", radius=5)) == []
