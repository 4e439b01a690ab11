"""Every kind of light against a closed form, by every estimator that can find it; quads against their density."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from gpu import ESTIMATORS, Renderer
from gpu.layout.bindings import Slot
from service.document import parse_scene
from service.pack import pack
from tests import stats
from tests.marks import BY_ESTIMATOR
from tests.probing import prober_of
from tests.rendering import Images, assert_estimators_agree, document, render

FLOOR = {"type": "quad", "origin": [-1, -1, 0], "u": [2, 0, 0], "v": [0, 2, 0], "material": "m"}
ASKEW = {"position": [-1, -1, 1], "target": [0, 0, 0], "vfov": 0.02}  # looks at the origin, past what hangs above it
GREY = {"type": "diffuse", "albedo": 0.8}
LAMP = {"type": "diffuse", "albedo": 0, "emission": [7, 3, 1]}
BOTH = {**LAMP, "emission_sides": "both"}
COLOR = np.array([7.0, 3.0, 1.0])
BEAM = np.array([0.3, -0.2, -1.0])
PLACE = np.array([-0.5, 0.4, 1.5])


def _spot(gpu: Renderer, scene: dict[str, Any], samples: int = 4096, **more: Any) -> np.ndarray:
    """Mean colour of a 16 x 16 picture, all of whose pixels look at the same point."""
    return render(gpu, scene, samples // 16, width=16, height=16, **more)[..., :3].mean((0, 1))


def _lit(*shapes: dict[str, Any], lamp: dict[str, Any] = LAMP, **more: Any) -> dict[str, Any]:
    materials = {"m": GREY, "lamp": lamp}
    return document([FLOOR, *shapes], materials, **{"camera": ASKEW, **more})


def _beam(inner: float, outer: float, **more: Any) -> dict[str, Any]:
    return {
        "type": "spot", "position": PLACE.tolist(), "direction": (5 * BEAM).tolist(), "intensity": [3, 7, 0.4],
        "inner_angle": inner, "outer_angle": outer, **more,
    }  # fmt: skip


def _beam_irradiance(inner: float, outer: float, at: np.ndarray) -> np.ndarray:
    """On the plane z = 0, for an intensity of 1."""
    to = PLACE - at
    d = np.linalg.norm(to, axis=-1)
    cos = -(to @ BEAM) / d / np.linalg.norm(BEAM)
    high, low = math.cos(math.radians(inner)), math.cos(math.radians(outer))
    t = np.clip((cos - low) / (high - low), 0, 1) if high > low else (cos >= low) * 1.0
    return np.asarray(t * t * (3 - 2 * t) * to[..., 2] / d**3)


@pytest.mark.parametrize(("inner", "outer"), [(12, 31), (0, 90), (25, 25), (90, 90), (0, 30), (2, 2.001)])
def test_spot(gpu: Renderer, inner: float, outer: float) -> None:
    camera = {"position": [0, 0, 4], "target": [0, 0, 0], "vfov": 24}
    image = render(gpu, document([FLOOR], {"m": GREY}, lights=[_beam(inner, outer)], camera=camera), 256)[..., :3]
    k = math.tan(math.radians(12)) * 4
    n = 64
    at = ((np.arange(32 * n) + 0.5) / (32 * n) * 2 - 1) * k
    x, y = np.meshgrid(at, -at)
    cells = _beam_irradiance(inner, outer, np.stack([x, y, 0 * x], -1)).reshape(32, n, 32, n)
    expected = cells.mean((1, 3))[..., None] * 0.8 / math.pi * np.array([3, 7, 0.4])
    # A pixel that the rim cuts is known to a few of its 256 samples.
    error = np.abs(image - expected) / np.array([3, 7, 0.4])
    assert (error <= 4e-3 * cells.mean((1, 3))[..., None] + 0.05 * cells.std((1, 3))[..., None] + 1e-7).all()
    dark = cells.max((1, 3)) == 0
    if dark.any():
        dark[1:] &= dark[:-1]
        dark[:, 1:] &= dark[:, :-1]
        dark[:-1] &= dark[1:]
        dark[:, :-1] &= dark[:, 1:]
        assert (image[dark] == 0).all()


def test_a_spot_of_no_angle_is_dark(gpu: Renderer) -> None:
    assert render(gpu, document([FLOOR], {"m": GREY}, lights=[_beam(0, 0)]), 4)[..., :3].max() == 0


@pytest.mark.parametrize("estimator", BY_ESTIMATOR)
@pytest.mark.parametrize("diameter", [0.0, 1e-5, 0.53, 40.0, 90.0])
def test_directional(gpu: Renderer, diameter: float, estimator: str) -> None:
    """E = irradiance * cos, exactly, while the disk is above the horizon."""
    if diameter == 0.53 and estimator in ("bsdf", "uniform"):
        pytest.skip("one direction in 100 000 finds it")
    tilt = math.radians(40)
    light = {"type": "directional", "direction": [-3 * math.sin(tilt), 0, -3 * math.cos(tilt)],
             "irradiance": [2, 0.7, 9], "angular_diameter": diameter}  # fmt: skip
    image = _spot(gpu, document([FLOOR], {"m": GREY}, lights=[light], camera=ASKEW), 1 << 16, estimator=estimator)
    expected = 0.8 / math.pi * math.cos(tilt) * np.array([2, 0.7, 9])
    np.testing.assert_allclose(image, expected, rtol=3e-4 if estimator in ("mis", "light") else 0.02)


def test_a_disk_below_the_horizon_in_part(gpu: Renderer) -> None:
    """At the horizon half of it shines: E = L integral over the upper half disk of cos."""
    half = math.radians(20)
    light = {"type": "directional", "direction": [-1, 0, 0], "irradiance": 3, "angular_diameter": 40}
    image = _spot(gpu, document([FLOOR], {"m": GREY}, lights=[light], camera=ASKEW), 1 << 16)
    theta = (np.arange(4000) + 0.5) / 4000 * half  # from the middle; heights sin(theta) sin(phi), phi in 0..pi
    e = 3 / (math.pi * math.sin(half) ** 2) * 2 * (np.sin(theta) ** 2).sum() * half / 4000
    np.testing.assert_allclose(image, 0.8 / math.pi * e, rtol=3e-3)


MIRROR = {"type": "disney", "metallic": 1, "roughness": 0.05, "base_color": 1}


@pytest.mark.parametrize("estimator", BY_ESTIMATOR)
def test_disks_are_seen_in_reflections_but_by_no_camera(gpu: Renderer, estimator: str) -> None:
    light = {"type": "directional", "direction": [0, 0, 1], "irradiance": 3, "angular_diameter": 30}
    assert render(gpu, document([], lights=[light]), 4).max() == 0  # the camera looks right into it
    sun = {**light, "direction": [0, 0, -1]}
    straight = {"position": [0, 0, 4], "target": [0, 0, 0], "vfov": 0.02}
    samples = 1 << (19 if estimator == "uniform" else 15)  # few of its directions are the mirror's
    image = _spot(gpu, document([FLOOR], {"m": MIRROR}, lights=[sun], camera=straight), samples, estimator=estimator)
    radiance = 3 / (math.pi * math.sin(math.radians(15)) ** 2)
    np.testing.assert_allclose(image, radiance, rtol=0.02 if estimator != "uniform" else 0.3)


def test_suns_and_skies_add_up(gpu: Renderer) -> None:
    """Two disks, one inside the other, a bare direction and a sky, found by rays and by direct sampling alike."""
    suns = [
        {"type": "directional", "direction": [0, 0.1, -1], "irradiance": [4, 0, 0], "angular_diameter": 60},
        {"type": "directional", "direction": [0, 0, -1], "irradiance": [0, 2, 0]},
        {"type": "directional", "direction": [0, 0.1, -1], "irradiance": [0, 0, 1], "angular_diameter": 20},
    ]
    lamp = {"type": "point", "position": [0, 0, 2], "intensity": [1, 1, 1]}
    sky = {"type": "constant", "radiance": 0.5}
    scene = document([FLOOR], {"m": GREY}, lights=[*suns, lamp], environment=sky, camera=ASKEW)
    cos = 1 / math.hypot(1, 0.1)
    expected = 0.8 / math.pi * (np.array([4 * cos, 2, cos]) + 0.25 + 0.5 * math.pi)
    for estimator in ESTIMATORS:
        image = _spot(gpu, scene, 1 << 16, estimator=estimator)
        np.testing.assert_allclose(image, expected, rtol=0.02)


def _rectangle_factor(a: float, b: float, c: float) -> float:
    """Form factor of a small surface to a parallel rectangle a x b at height c above it, one corner overhead."""
    x, y = a / c, b / c
    p, q = math.sqrt(1 + x * x), math.sqrt(1 + y * y)
    return (x / p * math.atan(y / p) + y / q * math.atan(x / q)) / (2 * math.pi)


def _quad(c: float, a: float, b: float, front: bool = True) -> dict[str, Any]:
    u, v = [0, b, 0], [a, 0, 0]
    return {"type": "quad", "origin": [0, 0, c], "u": u if front else v, "v": v if front else u, "material": "lamp"}


# Close and far, small and large as seen: sampled by solid angle, by area, and about where one takes over.
SIZES = [(1.1, 0.9, 0.7), (0.05, 0.9, 0.7), (0.01, 3.0, 0.02), (30.0, 1.3, 1.0), (8.0, 0.4, 0.3), (1.0, 300.0, 400.0)]


@pytest.mark.parametrize(("c", "a", "b"), SIZES)
def test_rectangles_near_and_far(gpu: Renderer, c: float, a: float, b: float) -> None:
    scene = _lit(_quad(c, a, b), camera={"position": [-0.01, -0.01, 0.005], "target": [0, 0, 0], "vfov": 0.02})
    for estimator in ("mis", "light"):
        image = _spot(gpu, scene, 1 << 14, estimator=estimator)
        np.testing.assert_allclose(image, 0.8 * _rectangle_factor(a, b, c) * COLOR, rtol=3e-3)


def _parallelogram_factor(shape: dict[str, Any]) -> float:
    """Form factor of a small surface facing +z to a polygon above it [Lambert 1760]."""
    o, u, v = (np.array(shape[k], float) for k in ("origin", "u", "v"))
    corners = [o, o + u, o + u + v, o + v]
    total = 0.0
    for i in range(4):
        r, s = (p / np.linalg.norm(p) for p in (corners[i], corners[(i + 1) % 4]))
        cross = np.cross(r, s)
        total += math.acos(float(r @ s)) * cross[2] / np.linalg.norm(cross)
    return abs(total) / (2 * math.pi)


@pytest.mark.parametrize("d", [0.02, 0.7, 30.0])
@pytest.mark.parametrize("sides", ["front", "both"])
def test_disk_overhead(gpu: Renderer, d: float, sides: str) -> None:
    """E = pi L r^2 / (r^2 + d^2) under the middle of a disk; behind one whose front alone shines it is dark."""
    r = 0.4
    disk = {"type": "disk", "center": [0, 0, d], "normal": [0, 0, -3], "radius": r, "material": "lamp"}
    camera = {"position": [-0.01, -0.01, 0.005], "target": [0, 0, 0], "vfov": 0.02}
    for estimator in ESTIMATORS if d == 0.7 else ("mis",):
        lamp = LAMP if sides == "front" else BOTH
        image = _spot(gpu, _lit(disk, lamp=lamp, camera=camera), 1 << 16, estimator=estimator)
        np.testing.assert_allclose(image, 0.8 * r * r / (r * r + d * d) * COLOR, rtol=0.03)
        away = _spot(gpu, _lit({**disk, "normal": [0, 0, 1]}, lamp=lamp, camera=camera), 1 << 14, estimator=estimator)
        assert away.max() == 0 if sides == "front" else np.allclose(away, image, rtol=0.06)


SHEARED = {"type": "quad", "origin": [0, 0, 1.1], "u": [0.6, 0.7, 0], "v": [0.9, 0, 0.1], "material": "lamp"}


@pytest.mark.parametrize("estimator", BY_ESTIMATOR)
def test_parallelogram_light(gpu: Renderer, estimator: str) -> None:
    image = _spot(gpu, _lit(SHEARED), 1 << 16, estimator=estimator)
    np.testing.assert_allclose(image, 0.8 * _parallelogram_factor(SHEARED) * COLOR, rtol=0.03)


TURNED_MESH = {
    "type": "mesh", "vertices": [[0, 0, 1.1], [0, 0.7, 1.1], [0.9, 0.7, 1.1], [0.9, 0, 1.1]],
    "faces": [[0, 2, 1], [0, 3, 2]], "material": "lamp",
}  # fmt: skip


@pytest.mark.parametrize("estimator", BY_ESTIMATOR)
@pytest.mark.parametrize("shape", [_quad(1.1, 0.9, 0.7, False), _quad(1.1, 0.9, 0.7), TURNED_MESH],
                         ids=["behind", "front", "mesh"])  # fmt: skip
def test_both_sides_shine(gpu: Renderer, shape: dict[str, Any], estimator: str) -> None:
    image = _spot(gpu, _lit(shape, lamp=BOTH), 1 << 16, estimator=estimator)
    np.testing.assert_allclose(image, 0.8 * _rectangle_factor(0.9, 0.7, 1.1) * COLOR, rtol=0.03)
    if shape is TURNED_MESH:
        hollow = _spot(gpu, _lit({**shape, "double_sided": False}, lamp=BOTH), 256, estimator=estimator)
        assert hollow.max() == 0  # from behind it is not there


@pytest.mark.parametrize("scale", [1, [1, 1.5, 0.8]])
@pytest.mark.parametrize("sides", ["both", "front"])
def test_the_inside_of_a_ball_shines_if_it_is_told_to(gpu: Renderer, sides: str, scale: Any) -> None:
    """A ball of emission L and albedo a holds L (1 - a^(n+1)) / (1 - a) after n bounces; the camera is inside."""
    glow = {"type": "diffuse", "albedo": 0.6, "emission": COLOR.tolist(), "emission_sides": sides}
    ball = {"type": "sphere", "center": [0, 0, 0], "radius": 2, "material": "glow", "transform": {"scale": scale}}
    camera = {"position": [0.2, 0.5, 0.4], "target": [1, 1, 0], "vfov": 70}
    for estimator in ESTIMATORS:
        scene = document([ball], {"glow": glow}, camera=camera)
        image = render(gpu, scene, 128, max_bounces=4, estimator=estimator)[..., :3]
        expected = COLOR * ((1 - 0.6**5) / 0.4 if sides == "both" else 0)
        np.testing.assert_allclose(image.mean((0, 1)), expected, rtol=0.01)


@pytest.mark.parametrize("both", [False, True])
@pytest.mark.parametrize("estimator", BY_ESTIMATOR)
def test_a_ball_that_shines_on_both_sides_looks_the_same_from_outside(
    gpu: Renderer, estimator: str, both: bool
) -> None:
    r, d, tilt = 0.3, 1.2, math.radians(40)
    ball = {"type": "sphere", "center": [d * math.sin(tilt), 0, d * math.cos(tilt)], "radius": r, "material": "lamp"}
    image = _spot(gpu, _lit(ball, lamp=BOTH if both else LAMP), 1 << 16, estimator=estimator)
    np.testing.assert_allclose(image, 0.8 * (r / d) ** 2 * math.cos(tilt) * COLOR, rtol=0.03)


VIEWS = {
    "overhead": ([0.1, 0.2, 1.0], [1.5, 0, 0], [0, 0.8, 0]),
    "close": ([0.1, 0.2, 0.05], [1.5, 0, 0], [0, 0.8, 0]),
    "aside": ([1.0, 2.0, 0.1], [1.5, 0, 0], [0, 0.8, 0]),
    "turned": ([0.5, -0.3, 0.4], [0.6, 0.6, 0.3], [-0.5, 0.5, 0.0]),
    "long": ([-5.0, 0.1, 0.3], [10, 0, 0], [0, 0.1, 0]),
    "small": ([0.3, 0.2, 3.0], [0.3, 0, 0], [0, 0.3, 0]),
    "sheared": ([0.3, 0.2, 0.5], [0.9, 0, 0], [0.5, 0.8, 0]),
    "far": ([0.3, 0.2, 40.0], [0.3, 0, 0], [0, 0.3, 0]),
}


def _flat(kind: str, origin: np.ndarray, u: np.ndarray, v: np.ndarray) -> dict[str, Any]:
    if kind == "triangle":
        corners = [origin.tolist(), (origin + u).tolist(), (origin + v).tolist()]
        return {"type": "mesh", "vertices": corners, "faces": [[0, 1, 2]], "smooth": False}
    if kind == "disk":  # one that is stretched to touch the edges of the quad
        axes = np.stack([u / 2, v / 2, np.cross(u, v), origin + (u + v) / 2], 1)
        matrix = [*axes.ravel().tolist(), 0, 0, 0, 1]
        return {
            "type": "disk",
            "center": [0, 0, 0],
            "normal": [0, 0, 1],
            "radius": 1,
            "transform": {"matrix": matrix},
        }
    return {"type": "quad", "origin": origin.tolist(), "u": u.tolist(), "v": v.tolist()}


def _inside(kind: str, grid: np.ndarray) -> np.ndarray:
    """The share of each place of the unit square's grid that the lamp covers."""
    if kind == "triangle":
        return np.where(np.isclose(grid.sum(1), 1), 0.5, grid.sum(1) < 1)  # half cells on its edge
    return np.hypot(*(2 * grid - 1).T) <= 1 if kind == "disk" else np.ones(len(grid))


@pytest.mark.parametrize("kind", ["quad", "disk", "triangle"])
@pytest.mark.parametrize("view", VIEWS)
def test_flat_lamps_are_sampled_with_their_density(gpu: Renderer, view: str, kind: str) -> None:
    """Chi-square over cells of the lamp: samples against the density that MIS takes, integrated in float64."""
    origin, u, v = (np.array(a, float) for a in VIEWS[view])
    triangle, shape = kind == "triangle", _flat(kind, origin, u, v)
    packed = pack(parse_scene(document([{**shape, "material": "lamp"}], {"lamp": BOTH})), Images()).arrays
    prober, n, cells, fine = prober_of(gpu), 200_000, 16, 32 if kind == "disk" else 16
    flags = frozenset({"HAS_EMISSION", "HAS_EMISSION_BOTH", "HAS_QUAD_LIGHTS", "HAS_TRIANGLE_LIGHTS"})
    flags |= {"HAS_DISKS"} if kind == "disk" else set()
    records = {Slot.TRIANGLES: packed.triangles} if triangle else {Slot.QUADS: packed.quads}

    def ask(sample: int, asks: np.ndarray) -> np.ndarray:
        wide = np.zeros((len(asks), 4), np.float32)
        wide[:, :2] = asks
        entry = "triangles.comp" if triangle else "quads.comp"
        return prober.run(
            entry, len(asks), {Slot.SUM: wide, **records}, (Slot.OUTPUT,), {"SAMPLE": sample},
            flags, p=tuple(-x for x in packed.origin), sides=2,
        )[0].astype(float)  # fmt: skip

    drawn = ask(1, np.random.default_rng(4).random((n, 2)))
    normal = np.cross(u, v)
    t = (origin @ normal) / (drawn[:, :3] @ normal)
    place = (drawn[:, :3] * t[:, None] - origin) @ np.linalg.pinv(np.stack([u, v], 1)).T
    observed = np.histogram2d(*np.clip(place, 0, 1).T, cells, [[0, 1], [0, 1]])[0]
    at = (np.arange(cells * fine) + 0.5) / (cells * fine)
    grid = np.stack(np.meshgrid(at, at, indexing="ij"), -1).reshape(-1, 2)
    p = origin + grid @ np.stack([u, v])
    d = np.linalg.norm(p, axis=1)
    density = ask(0, grid)[:, 3] * np.abs(p @ normal) / d**3 * _inside(kind, grid)  # per area of the unit square
    expected = density.reshape(cells, fine, cells, fine).sum((1, 3)) / (cells * fine) ** 2
    assert expected.sum() == pytest.approx(1, abs=3e-3)
    assert place.min() > -1e-3 and place.max() < 1.001 and (not triangle or place.sum(1).max() < 1.001)
    assert kind != "disk" or np.hypot(*(2 * place - 1).T).max() < 1.001
    assert stats.chi_square(observed, expected / expected.sum() * n) > stats.sidak(1e-3, 3 * len(VIEWS))
    again = ask(0, place)[:, 3]  # one density, whoever asks
    np.testing.assert_allclose(again, drawn[:, 3], rtol=2e-3)


def _crowd() -> dict[str, Any]:
    """Every kind of light in one room, on two sides, through veils and hidden from the camera."""
    shapes = [
        {"type": "quad", "origin": [-3, -1, 3], "u": [6, 0, 0], "v": [0, 0, -6], "material": "floor"},
        {"type": "sphere", "center": [0, -0.3, 0], "radius": 0.7, "material": "metal"},
        {"type": "quad", "origin": [-1, 2.5, -1], "u": [2, 0, 0], "v": [0, 0, 2], "material": "lamp"},
        {"type": "quad", "origin": [-2, -0.5, -1], "u": [0, 1, 0], "v": [0.3, 0, 1.4], "material": "panel"},
        {"type": "disk", "center": [1.5, 1.2, 1.4], "normal": [-1, -1, -1], "radius": 0.5, "material": "panel"},
        {"type": "sphere", "center": [1.3, 0.2, 0.4], "radius": 0.3, "material": "bulb"},
        {"type": "sphere", "center": [0, 0, 0], "radius": 0.3, "material": "bulb", "visible_to_camera": False,
         "transform": {"translate": [-1, 0.6, 0.8], "scale": [1, 0.5, 1.4]}},
        {"type": "box", "min": [0.4, -1, 0.9], "max": [0.8, -0.4, 1.3], "material": "veil"},
        {"type": "cylinder", "base": [-2.2, -0.8, 1], "axis": [0.5, 1.4, -0.3], "radius": 0.2, "material": "bulb"},
        {"type": "cylinder", "base": [1, 1.6, -1], "axis": [1, 0.2, 0.4], "radius": 0.15, "caps": False,
         "material": "panel"},
        {**TURNED_MESH, "material": "panel", "transform": {"translate": [-0.5, -0.6, 0], "scale": 0.5}},
    ]  # fmt: skip
    materials = {
        "floor": {"type": "diffuse", "albedo": [0.7, 0.6, 0.5]},
        "metal": {"type": "disney", "metallic": 1, "roughness": 0.4, "base_color": 0.9},
        "veil": {"type": "diffuse", "albedo": 0.8, "alpha": 0.4},
        "lamp": {**LAMP, "emission": 2},
        "panel": {**BOTH, "albedo": 0.5, "emission": [1, 2, 3], "alpha": 0.7},
        "bulb": {**BOTH, "emission": [5, 2, 1], "alpha": 0.5},
    }
    lights = [
        {"type": "directional", "direction": [-1, -2, -1], "irradiance": 2, "angular_diameter": 30},
        {"type": "directional", "direction": [1, -1, -1], "irradiance": [0.1, 0.2, 0.5]},
        {"type": "spot", "position": [0, 2, 2], "direction": [0, -1, -0.7], "intensity": [4, 1, 1], "inner_angle": 20,
         "outer_angle": 40},
        {"type": "point", "position": [2, 2, 2], "intensity": 1},
    ]  # fmt: skip
    return document(shapes, materials, lights=lights, environment={"type": "constant", "radiance": 0.2})


@pytest.mark.slow
def test_all_estimators_agree_on_all_lights(gpu: Renderer) -> None:
    assert_estimators_agree(gpu, _crowd())
