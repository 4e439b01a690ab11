"""The side of a cylinder as a light: its samples against its density, and what it gives against closed forms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from gpu import Renderer
from gpu.layout.bindings import Slot
from service.document import parse_scene
from service.pack import pack
from tests import stats
from tests.marks import BY_ESTIMATOR, seldom
from tests.probing import prober_of
from tests.rays import to_world
from tests.rendering import Images, document, render

GREY = {"type": "diffuse", "albedo": 0.8}
LAMP = {"type": "diffuse", "albedo": 0, "emission": [7, 3, 1]}
BOTH = {**LAMP, "emission_sides": "both"}
COLOR = np.array([7.0, 3.0, 1.0])
FLOOR = {"type": "quad", "origin": [-1, -1, 0], "u": [2, 0, 0], "v": [0, 2, 0], "material": "m"}
ASKEW = {"position": [-0.3, -0.4, 0.05], "target": [0, 0, 0], "vfov": 0.02}


def tube(base: Any, axis: Any, radius: float, **more: Any) -> dict[str, Any]:
    return {
        "type": "cylinder", "base": list(base), "axis": list(axis), "radius": radius, "caps": False,
        "material": "lamp", **more,
    }  # fmt: skip


# As seen from the origin, with the chance that a ray passes through: from outside, from within and past an open end.
SKEW = {"transform": {"translate": [0.4, 1.2, 0.3], "rotate": [20, -35, 50], "scale": [0.5, 1.3, -0.8]}}
VIEWS: dict[str, tuple[dict[str, Any], float]] = {
    "beside": (tube([1, -0.7, 0.2], [0.1, 2, 0.3], 0.4), 0.0),
    "close": (tube([0.41, -1.5, 0.1], [0, 3, 0], 0.4), 0.0),
    "long": (tube([0.5, -40, 0.1], [0, 90, 3], 0.01), 0.0),
    "beyond its end": (tube([0.3, 1, 0.5], [0.3, 2, 0.1], 0.4), 0.0),
    "far": (tube([40, 1, 3], [0.3, 2, 0.1], 0.4), 0.0),
    "skewed": (tube([0, -0.5, 0], [0, 1.5, 0], 0.6, **SKEW), 0.0),
    "within": (tube([0.1, -0.7, 0.2], [0.1, 2, 0.3], 0.6), 0.0),
    "within its bore": (tube([0.1, 0.7, 0.2], [0.1, 2, 0.3], 0.6), 0.0),
    "veiled": (tube([1, -0.7, 0.2], [0.1, 2, 0.3], 0.4), 0.3),
    "veiled and skewed": (tube([0, -0.5, 0], [0, 1.5, 0], 0.6, **SKEW), 0.3),
}


class Seen:
    """A tube that shines on both sides, as it is seen from the origin."""

    def __init__(self, gpu: Renderer, view: str) -> None:
        shape, self.transparency = VIEWS[view]
        self.prober = prober_of(gpu)
        packed = pack(parse_scene(document([shape], {"lamp": BOTH})), Images()).arrays
        self.boxes, self.p = packed.boxes, tuple(-x for x in packed.origin)
        m, axis = to_world(shape)[:3, :3], np.array(shape["axis"], float)
        middle = to_world(shape)[:3, 3] + m @ (np.array(shape["base"]) + axis / 2)
        rows = np.stack([packed.boxes[f"row_{name}"][0] for name in "xyz"]).astype(float)
        self.rows, self.axes, self.middle = rows, np.linalg.inv(rows), middle

    def ask(self, sample: int, asks: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        wide = np.zeros((len(asks), 4), np.float32)
        wide[:, :2] = asks
        flags = {"HAS_EMISSION", "HAS_EMISSION_BOTH", "HAS_BOXES", "HAS_CYLINDERS", "HAS_CYLINDER_LIGHTS"}
        found = self.prober.run(
            "cylinders.comp", len(asks), {Slot.SUM: wide, Slot.BOXES: self.boxes}, (Slot.OUTPUT, Slot.ALBEDO),
            {"SAMPLE": sample}, frozenset(flags), p=self.p, sides=2, transparency=self.transparency,
        )  # fmt: skip
        return found[0].astype(float), found[1].astype(float)

    def places(self, asks: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Of places on the side, by their part of a turn and their height: where they are, and their area elements
        with the normals' directions."""
        turn = 2 * np.pi * asks[:, 0]
        around = np.stack([np.sin(turn), 0 * turn, np.cos(turn)], 1)
        q = around + asks[:, 1:2] * [0, 1, 0]
        along = np.stack([np.cos(turn), 0 * turn, -np.sin(turn)], 1) @ self.axes.T
        element = np.cross(np.broadcast_to(self.axes[:, 1], along.shape), along) * 2 * np.pi
        outward = around @ self.rows
        element *= np.sign((element * outward).sum(1, keepdims=True))
        return self.middle + q @ self.axes.T, element


@pytest.mark.parametrize("view", VIEWS)
def test_sides_are_sampled_with_their_density(gpu: Renderer, view: str) -> None:
    """Chi-square over cells of the unrolled side: samples against the density that MIS takes, in float64."""
    seen, n, cells, fine = Seen(gpu, view), 200_000, 16, 32
    drawn, arrived = seen.ask(1, np.random.default_rng(4).random((n, 2)))
    assert (drawn[:, 3] > 0).mean() > 0.999
    q = (arrived[:, :1] * drawn[:, :3] - seen.middle) @ seen.rows.T
    np.testing.assert_allclose(np.hypot(q[:, 0], q[:, 2]), 1, atol=2e-3 if "long" in view else 2e-4)
    asks = np.stack([np.arctan2(q[:, 0], q[:, 2]) / (2 * np.pi) % 1, np.clip(q[:, 1], -1, 1)], 1)
    observed = np.histogram2d(*asks.T, cells, [[0, 1], [-1, 1]])[0]
    at = (np.arange(cells * fine) + 0.5) / (cells * fine)
    grid = np.stack(np.meshgrid(at, 2 * at - 1, indexing="ij"), -1).reshape(-1, 2)
    places, element = seen.places(grid)
    d = np.linalg.norm(places, axis=1)
    density = seen.ask(0, grid)[0][:, 3] * np.abs((places * element).sum(1)) / d**3
    expected = 2 * density.reshape(cells, fine, cells, fine).sum((1, 3)) / (cells * fine) ** 2
    assert expected.sum() == pytest.approx(1, abs=6e-3)
    assert stats.chi_square(observed, expected / expected.sum() * n) > stats.sidak(1e-3, len(VIEWS))
    again = seen.ask(0, asks)[0][:, 3]  # one density, whoever asks
    close = np.abs(again / drawn[:, 3] - 1) < 5e-3
    assert close.mean() > 0.99


@pytest.mark.parametrize("view", VIEWS)
def test_a_far_half_is_seen_through_ends_and_veils(gpu: Renderer, view: str) -> None:
    """The share of a sample's light that the tube itself lets through, against a float64 ray."""
    seen = Seen(gpu, view)
    drawn, arrived = seen.ask(1, np.random.default_rng(5).random((20_000, 2)))
    f, g = -seen.rows @ seen.middle, drawn[:, :3] @ seen.rows.T
    flat = [0, 2]
    a, b = (g[:, flat] ** 2).sum(1), (g[:, flat] * f[flat]).sum(1)
    c = (f[flat] ** 2).sum() - 1
    near = (-b - np.sqrt(np.maximum(b * b - a * c, 0))) / a
    height = np.abs(f[1] + near * g[:, 1])
    behind = (near > 0) & (arrived[:, 0] > near * (1 + 1e-3))
    clear = np.abs(height - 1) > 1e-3
    expected = np.where(behind & (height < 1), seen.transparency, 1.0)
    usual = clear & (np.abs(arrived[:, 0] / near - 1) > 0.02)
    np.testing.assert_allclose(arrived[usual, 1], expected[usual], atol=1e-6)
    assert (arrived[usual, 1] < 1).any() == (view in ("beyond its end", "far") or "veiled" in view)


def _irradiance(shape: dict[str, Any], n: np.ndarray) -> float:
    """On an element at the origin with this normal, over the radiance of the outer side, by quadrature."""
    m = to_world(shape)
    axis, base = m[:3, :3] @ np.array(shape["axis"], float), m[:3, :3] @ np.array(shape["base"], float) + m[:3, 3]
    unit = axis / np.linalg.norm(axis)
    x = np.cross(unit, [0.3, 0.5, -0.8])
    x /= np.linalg.norm(x)
    turns, heights = 2000, 4000
    turn = (np.arange(turns) + 0.5) / turns * 2 * np.pi
    normal = np.cos(turn)[:, None] * x + np.sin(turn)[:, None] * np.cross(unit, x)
    p = base + (np.arange(heights)[:, None, None] + 0.5) / heights * axis + shape["radius"] * normal
    d2 = (p**2).sum(-1)
    facing = np.maximum(-(p * normal).sum(-1), 0) * np.maximum(p @ n, 0)
    return float((facing / d2**2).sum() * (2 * np.pi / turns) * shape["radius"] * np.linalg.norm(axis) / heights)


def _spot(gpu: Renderer, lamp: dict[str, Any], shape: dict[str, Any], samples: int, **more: Any) -> np.ndarray:
    scene = document([FLOOR, shape], {"m": GREY, "lamp": lamp}, camera=ASKEW)
    return render(gpu, scene, samples // 16, width=16, height=16, **more)[..., :3].mean((0, 1))


@pytest.mark.parametrize("d", [0.011, 0.5, 30.0])
def test_a_long_tube_above_a_floor(gpu: Renderer, d: float) -> None:
    """E = pi L r / d at the distance d from the axis of an endless tube."""
    shape = tube([-1e4 * d, 0, d], [2e4 * d, 0, 0], 0.01)
    np.testing.assert_allclose(_spot(gpu, LAMP, shape, 1 << 15), 0.8 * 0.01 / d * COLOR, rtol=3e-3)


STANDING = tube([0.5, 0.2, 0.1], [0, 0, 1.3], 0.15)
LYING = tube([-0.4, 0.1, 0.6], [1.1, 0.3, 0.2], 0.2)


@pytest.mark.parametrize("estimator", BY_ESTIMATOR)
@pytest.mark.parametrize("both", [False, True])
def test_short_tubes_by_every_estimator(gpu: Renderer, estimator: str, both: bool) -> None:
    """One stands on the floor, so that its axis lies in the element's normal, and one lies above it."""
    for shape in (STANDING, LYING):
        image = _spot(gpu, BOTH if both else LAMP, shape, 1 << 17, estimator=estimator)
        within = both and shape is STANDING  # past its lower end its inside is seen, too
        expected = 0.8 / math.pi * _irradiance(shape, np.array([0, 0, 1.0]))
        if within:
            hollow = _spot(gpu, BOTH, shape, 1 << 17, estimator="mis")
            np.testing.assert_allclose(image, hollow, rtol=0.04)
            assert hollow[0] > 1.01 * expected * COLOR[0]
        else:
            np.testing.assert_allclose(image, expected * COLOR, rtol=0.04)


@pytest.mark.parametrize("estimator", BY_ESTIMATOR)
def test_a_closed_cylinder_shines_by_its_caps_too(gpu: Renderer, estimator: str) -> None:
    """E = pi L r^2 / (r^2 + d^2) under the middle of a cap, which hides the side; its inside is dark."""
    shape = {**tube([0, 0, 0.7], [0, 0, 2], 0.3), "caps": True}
    image = _spot(gpu, LAMP, shape, 1 << 16, estimator=estimator)
    np.testing.assert_allclose(image, 0.8 * 0.09 / (0.09 + 0.49) * COLOR, rtol=0.03)
    inside = {"position": [0.1, 0.1, 1.5], "target": [0.2, 0.1, 3], "vfov": 90}
    scene = document([shape], {"lamp": LAMP}, camera=inside)
    assert render(gpu, scene, 16, estimator=estimator)[..., :3].max() == 0


@pytest.mark.parametrize("transform", [{}, {"scale": [1, 1.5, 0.8], "rotate": [10, 20, 30]}])
@pytest.mark.parametrize("estimator", BY_ESTIMATOR)
def test_a_closed_cylinder_holds_its_light(gpu: Renderer, estimator: str, transform: dict[str, Any]) -> None:
    """Inside one of emission L on both sides and albedo a there is L (1 - a^(n+1)) / (1 - a) after n bounces."""
    glow = {"type": "diffuse", "albedo": 0.6, "emission": COLOR.tolist(), "emission_sides": "both"}
    shape = {**tube([0.1, -1, 0], [0.3, 2.2, -0.4], 1.2), "caps": True, "material": "glow", "transform": transform}
    camera = {"position": [0.2, 0.1, 0.3], "target": [1, 1, 0], "vfov": 90}
    image = render(gpu, document([shape], {"glow": glow}, camera=camera), 128, max_bounces=4, estimator=estimator)
    np.testing.assert_allclose(image[..., :3].mean((0, 1)), COLOR * (1 - 0.6**5) / 0.4, rtol=0.01)


@pytest.mark.parametrize("caps", seldom([False, True], [False]))
def test_a_mirror_shows_a_second_tube(gpu: Renderer, caps: bool) -> None:
    """The light that a mirror brings where the tube itself is hidden: that of its image behind the mirror, and the
    same whether it is traced from the camera or from the light."""
    shape = {**LYING, "caps": caps}
    mirror = {"type": "principled", "metallic": 1, "base_color": 1, "roughness": 0}
    materials = {"m": GREY, "lamp": LAMP, "mirror": mirror, "black": {"type": "diffuse", "albedo": 0}}
    shapes = [
        FLOOR, shape,
        {"type": "quad", "origin": [1.5, -0.8, 0], "u": [0, 1.6, 0], "v": [0, 0, 0.8], "material": "mirror"},
        {"type": "quad", "origin": [-0.6, -0.6, 0.3], "u": [1.1, 0, 0], "v": [0, 1.2, 0], "material": "black"},
    ]  # fmt: skip
    spot = document(shapes, materials, camera=ASKEW)
    if not caps:
        image = render(gpu, spot, 4096, width=16, height=16, max_bounces=2, caustics="paths")[..., :3].mean((0, 1))
        x, y, z = shape["base"]
        there = {**shape, "base": [3 - x, y, z], "axis": [-shape["axis"][0], *shape["axis"][1:]]}
        expected = 0.8 / math.pi * _irradiance(there, np.array([0, 0, 1.0])) * COLOR
        np.testing.assert_allclose(image, expected, rtol=0.04)
    wide = document(shapes, materials, camera={**ASKEW, "position": [-0.3, -0.4, 0.2], "vfov": 40})
    by = {
        way: render(gpu, wide, samples, width=16, height=16, max_bounces=2, caustics=way)[..., :3].mean((0, 1))
        for way, samples in (("light", 1024), ("paths", 1024))
    }
    np.testing.assert_allclose(by["light"], by["paths"], rtol=0.03)
