"""Noise and ramps are what the schema says: against the same formulas in float64, at extremes, and on shapes."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from gpu import Renderer, RenderSettings
from gpu.kernels.cache import KernelCache
from gpu.kernels.source import SHADERS
from gpu.layout.bindings import Slot
from service.document import parse_scene
from service.pack import pack
from service.problems import InvalidDocument
from tests.documents import Few
from tests.probing import PROBES
from tests.rendering import Images, document, render
from tests.shaders.textured import BALL, BARE, QUAD, at

Doc = dict[str, Any]
RNG = np.random.default_rng(8)
PERIOD = 2**20
TURN = np.array([[4, -20, 22], [28, 10, 4], [-10, 20, 20]]) / 30
SHIFT = np.array([0.19, 0.47, 0.73])
IMAGES = Images(grey=RNG.integers(0, 256, (4, 4, 1)).astype(np.uint8))


def hashed(x: np.ndarray) -> np.ndarray:
    with np.errstate(over="ignore"):
        x = (x ^ (x >> np.uint32(16))) * np.uint32(0x7FEB352D)
        x = (x ^ (x >> np.uint32(15))) * np.uint32(0x846CA68B)
    return np.asarray(x ^ (x >> np.uint32(16)))


EDGES = np.array([
    [1, 1, 0], [-1, 1, 0], [1, -1, 0], [-1, -1, 0], [1, 0, 1], [-1, 0, 1], [1, 0, -1], [-1, 0, -1],
    [0, 1, 1], [0, -1, 1], [0, 1, -1], [0, -1, -1], [1, 1, 0], [0, -1, 1], [-1, 1, 0], [0, -1, -1],
])  # fmt: skip


def octave(p: np.ndarray, seed: np.ndarray) -> np.ndarray:
    """Perlin's noise of 2002 in float64, with the renderer's hash of cells."""
    low, out = np.floor(p), 0.0
    t = p - low
    with np.errstate(over="ignore"):
        for corner in np.ndindex(2, 2, 2):
            cell = ((low + corner) % PERIOD).astype(np.uint32)
            h = hashed(hashed(hashed(cell[:, 0] ^ seed) + cell[:, 1]) + cell[:, 2]) >> np.uint32(28)
            fade = np.prod(
                np.where(corner, t**3 * (t * (6 * t - 15) + 10), 1 - t**3 * (t * (6 * t - 15) + 10)), axis=1
            )
            out = out + fade * (EDGES[h] * (t - corner)).sum(axis=1)
    return np.asarray(out)


def expected_t(noise: Doc, p: np.ndarray) -> np.ndarray:
    p = p * noise.get("scale", [4, 4, 4]) + noise.get("offset", [0, 0, 0])
    octaves, gain, turbulent = noise.get("octaves", 4), noise.get("gain", 0.5), noise.get("turbulence", False)
    total = np.zeros(len(p))
    for i in range(octaves):
        p = p @ TURN.T + SHIFT
        n = octave(p, hashed(np.array([(noise.get("seed", 0) + i) % 2**32], np.uint32)))
        total += gain**i * (np.abs(n) if turbulent else n)
        p = p * noise.get("lacunarity", 2)
    n = noise.get("contrast", 2) * total / sum(gain**i for i in range(octaves))
    return np.clip(n if turbulent else 0.5 + 0.5 * n, 0, 1)


def scene_of(textures: Doc, material: Doc, *shapes: Doc, **more: Any) -> Doc:
    return document(
        list(shapes or [QUAD]), {"m": {"type": "diffuse", "albedo": 0, **material}}, textures=textures, **more
    )


def emitted(gpu: Renderer, textures: Doc, places: np.ndarray, **reference: Any) -> np.ndarray:
    """(n, 3): the emission of a shape with the texture "t" at places of its own space, which are its uv as well."""
    shown = {"emission": {"texture": "t", **reference}}
    loaded = gpu.load(pack(parse_scene(scene_of(textures, shown, {**BALL, "radius": 1})), IMAGES).arrays)
    asks = np.zeros((-(-len(places) // 64) * 64, 4), np.float32)
    asks[: len(places), :3] = places
    kernels = KernelCache(gpu.context, (PROBES, SHADERS))
    kernel = kernels.get("solid.comp", loaded.defines(RenderSettings(8, 8)))
    ask, answer = gpu.context.buffer(asks.tobytes()), gpu.context.buffer(reserve=asks.nbytes)
    loaded.bind()
    ask.bind_to_storage_buffer(int(Slot.SUM))
    answer.bind_to_storage_buffer(int(Slot.OUTPUT))
    kernel["count"].value = len(asks)
    kernel.run(len(asks) // 64)
    got = np.frombuffer(answer.read(), np.float32).reshape(-1, 4)[: len(places), :3].copy()
    for thing in (ask, answer, loaded, kernels):
        thing.release()
    return got


NOISES: list[Doc] = [
    {},
    {"octaves": 1, "contrast": 1, "seed": 7},
    {"octaves": 6, "gain": 0.8, "lacunarity": 2.7, "turbulence": True, "seed": 2**32 - 1},
    {"scale": [0.5, 20, 3], "offset": [100.5, -7, 0.25], "a": 2, "b": [0, 1, 0.5]},
    {"space": "uv", "scale": [8, 2, 1], "octaves": 2},
]


@pytest.mark.parametrize("noise", NOISES, ids=str)
def test_noise_is_perlin_s(gpu: Renderer, noise: Doc) -> None:
    places = RNG.uniform(-3, 3, (512, 3)).astype(np.float32)
    got = emitted(gpu, {"t": {"type": "noise", **noise}}, places)
    p = places.astype(float) * ([1, 1, 0] if noise.get("space") == "uv" else 1)
    t = expected_t(noise, p)[:, None]
    a, b = (np.broadcast_to(noise.get(name, value), 3) for name, value in (("a", 0), ("b", 1)))
    # A float32 place has an error of 2^-24 of it, which the finest octave's slope, at most 6, and the contrast raise.
    np.testing.assert_allclose(got, a + (b - a) * t, atol=4e-4 * np.max(b + a))


def test_noise_fills_the_range_evenly_and_has_no_direction(gpu: Renderer) -> None:
    """Its mean is the middle, its deviation is as documented, and it varies alike along each axis and diagonal."""
    places = RNG.uniform(-500, 500, (20_000, 3)).astype(np.float32)
    step = np.array([[0, 0, 0], [0.02, 0, 0], [0, 0.02, 0], [0, 0, 0.02], [0.0115, 0.0115, 0.0115]])
    noise = {"t": {"type": "noise", "scale": [1, 1, 1], "octaves": 1, "contrast": 1}}
    first, *moved = (2 * emitted(gpu, noise, places + by)[:, 0] - 1 for by in step)
    assert abs(first.mean()) < 0.01 and 0.23 < first.std() < 0.30
    slopes = [np.sqrt(np.mean((other - first) ** 2)) for other in moved]
    assert max(slopes) < 1.06 * min(slopes), slopes


@pytest.mark.parametrize("far", [1e3, 2.0**20 * 30, 1e6, 3e8, 1e9, -1e9])
def test_noise_is_whole_at_the_ends_of_the_range(gpu: Renderer, far: float) -> None:
    """Wherever float32 still tells places apart it goes on smoothly, over the seam of its period, too; beyond, it is
    a colour of its range."""
    noise = {"type": "noise", "scale": [1, 1, 1], "octaves": 10, "lacunarity": 4, "contrast": 1}
    along = np.full((2048, 3), far)
    along[:, 0] += np.linspace(-8, 8, 2048)
    got = emitted(gpu, {"t": noise}, along)[:, 0]
    assert np.isfinite(got).all() and (got >= 0).all() and (got <= 1).all()
    if abs(far) <= 1e6:
        coarse = emitted(gpu, {"t": {**noise, "octaves": 1}}, along)[:, 0]
        ulp = float(np.spacing(np.float32(abs(far) * 1.6)))
        assert np.abs(np.diff(coarse)).max() < 1.6 * (16 / 2048 + 3 * ulp), "no jump"


def test_extreme_parameters_are_finite(gpu: Renderer) -> None:
    for noise in (
        {"scale": [1e9, -1e9, 1e9], "offset": [1e9, 0, -1e9], "octaves": 10, "lacunarity": 4, "gain": 1},
        {"scale": [0, 0, 0], "contrast": 1000}, {"gain": 0, "octaves": 10, "lacunarity": 1},
    ):  # fmt: skip
        got = emitted(gpu, {"t": {"type": "noise", **noise}}, RNG.uniform(-1e9, 1e9, (256, 3)))
        assert np.isfinite(got).all() and (got >= 0).all() and (got <= 1).all()


def expected_ramp(ramp: Doc, x: np.ndarray) -> np.ndarray:
    """(n, 3), by the words of the schema."""
    t = ramp.get("offset", 0) + ramp.get("scale", 1) * x
    wrap = ramp.get("wrap", "clamp")
    t = {"clamp": np.clip(t, 0, 1), "repeat": t % 1, "mirror": 1 - np.abs(t % 2 - 1)}[wrap]
    stops = sorted(ramp["stops"], key=lambda stop: stop["position"])
    out = np.tile(np.broadcast_to(stops[0]["color"], 3).astype(float), (len(t), 1))
    for last, stop in pairwise(stops):
        low, high = (np.broadcast_to(each["color"], 3) for each in (last, stop))
        inside = (t >= last["position"]) & (t < stop["position"])
        w = (t[inside] - last["position"]) / max(stop["position"] - last["position"], 1e-9)
        w = {"linear": w, "smooth": 3 * w**2 - 2 * w**3, "constant": 0 * w}[ramp.get("interpolation", "linear")]
        out[inside] = low + w[:, None] * (high - low)
        out[t >= stop["position"]] = high
    return out


STOPS = [
    {"position": 0.7, "color": [1, 0, 3]},
    {"position": 0.2, "color": 0.5},
    {"position": 0.9, "color": [0, 1, 0]},
]
EDGE = [{"position": 0.5, "color": 0}, {"position": 0.5, "color": 1}, {"position": 1, "color": 0.25}]
RAMPS: list[Doc] = [
    {"stops": STOPS},
    {"stops": STOPS, "interpolation": "smooth", "input": "v", "wrap": "repeat", "scale": 1.7, "offset": -0.3},
    {"stops": STOPS, "interpolation": "constant", "wrap": "mirror", "scale": -2.3},
    {"stops": EDGE},
    {"stops": [{"position": i / 15, "color": i % 3} for i in range(16)], "wrap": "mirror", "offset": 0.1},
]


@pytest.mark.parametrize("ramp", RAMPS, ids=str)
def test_ramps_go_through_their_stops(gpu: Renderer, ramp: Doc) -> None:
    places = RNG.uniform(-3, 3, (512, 3)).astype(np.float32)
    got = emitted(gpu, {"t": {"type": "ramp", **ramp}}, places)
    x = places[:, 1 if ramp.get("input") == "v" else 0].astype(float)
    wrong = np.abs(got - expected_ramp(ramp, x)).max(axis=1) > 1e-4
    assert wrong.sum() <= 1, "one place may round to the other side of an edge"


def test_ramps_read_other_textures(gpu: Renderer) -> None:
    places = RNG.uniform(-3, 3, (512, 3)).astype(np.float32)
    ramp = {"type": "ramp", "stops": STOPS, "interpolation": "smooth"}
    noise = {"type": "noise", "octaves": 2}
    got = emitted(gpu, {"n": noise, "t": {**ramp, "input": {"texture": "n"}}}, places)
    np.testing.assert_allclose(got, expected_ramp(ramp, expected_t(noise, places.astype(float))), atol=5e-3)
    checker = {"type": "checker", "a": [0, 0.45, 0], "b": [1, 0.8, 1], "scale": [1, 1]}
    got = emitted(gpu, {"n": checker, "t": {**ramp, "input": {"texture": "n", "channel": "g"}}}, places)
    even = np.floor(places[:, :2]).sum(axis=1) % 2 == 0
    np.testing.assert_allclose(got, expected_ramp(ramp, np.where(even, 0.45, 0.8)), atol=1e-5)
    image = {"asset": "grey"}
    plain = emitted(gpu, {"t": {**image, "color_space": "linear"}}, places)[:, 0]
    got = emitted(gpu, {"n": image, "t": {**ramp, "input": {"texture": "n"}}}, places)
    np.testing.assert_allclose(got, expected_ramp(ramp, plain), atol=1e-5)


def test_solid_noise_belongs_to_the_shape(gpu: Renderer) -> None:
    """It comes along where a shape is moved, turned or scaled by its transform, or a ball by its centre."""
    textures = {"t": {"type": "noise", "scale": [2, 3, 4]}}

    def seen(shape: Doc, point: list[float], away: list[float]) -> float:
        scene = scene_of(
            textures,
            {"albedo": {"texture": "t"}},
            shape,
            camera=at(point, away),
            environment={"type": "constant", "radiance": 1},
        )
        return float(render(gpu, scene, 1, "albedo")[4, 4, 0])

    want = float(expected_t(textures["t"], np.array([[0.0, 0.0, 2.0]]))[0])
    assert seen(BALL, [0, 0, 2], [0, 0, 4]) == pytest.approx(want, abs=2e-3)
    assert seen({**BALL, "center": [5, 1, 0]}, [5, 1, 2], [0, 0, 4]) == pytest.approx(want, abs=2e-3)
    placed = {**BALL, "transform": {"translate": [0, 7, 0], "rotate": [0, 90, 0], "scale": [2, 2, 3]}}
    assert seen(placed, [6, 7, 0], [4, 0, 0]) == pytest.approx(want, abs=2e-3)
    want = float(expected_t(textures["t"], np.array([[0.25, 0.25, 0.0]]))[0])
    assert seen(BARE, [0.25, 0.25, 0], [0, 0, 4]) == pytest.approx(want, abs=2e-3), "it needs no coordinates"
    placed = {**BARE, "transform": {"translate": [9, 0, 0], "scale": 2}}
    assert seen(placed, [9.5, 0.5, 0], [0, 0, 4]) == pytest.approx(want, abs=2e-3)


def refused(textures: Doc) -> list[tuple[str, str]]:
    with pytest.raises(InvalidDocument) as error:
        pack(parse_scene(scene_of(textures, {"albedo": {"texture": "t"}})), Few())
    return [(each.pointer, each.detail) for each in error.value.errors]


def test_one_level_only() -> None:
    inner, outer = {"type": "ramp", "stops": EDGE}, {"type": "ramp", "stops": EDGE, "input": {"texture": "r"}}
    ((pointer, detail),) = refused({"t": outer, "r": inner})
    assert pointer == "/textures/t/input/texture" and "is a ramp" in detail
    ((pointer, detail),) = refused({"t": outer})
    assert pointer == "/textures/t/input/texture" and "no texture named 'r'" in detail
    ((pointer, detail),) = refused(
        {"t": {**outer, "input": {"texture": "r", "channel": "a"}}, "r": {"type": "noise"}}
    )
    assert pointer == "/textures/t/input/channel" and "alpha" in detail
    ((pointer, _),) = refused({"t": {"type": "ramp", "stops": EDGE[:1]}})
    assert pointer == "/textures/t/stops"
