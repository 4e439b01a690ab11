"""A metal of `principled` with a complex index: its reflectance, its furnace, and the bits of those without."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gpu import Renderer
from gpu.kernels.features import flags
from gpu.layout import ABSENT
from gpu.layout.bindings import Slot
from gpu.layout.models import NUMBERS
from service.config import Config
from service.document import parse_scene
from service.pack import pack
from service.problems import InvalidDocument
from tests.gpu.flag_scenes import IMAGES, made_of
from tests.probing import PRINCIPLED_FLAGS, Prober, materials, prober_of
from tests.rendering import document, render

GOLD = {"conductor_eta": (0.18, 0.42, 1.37), "conductor_k": (3.42, 2.35, 1.77)}
FLAGS = PRINCIPLED_FLAGS | {"HAS_CONDUCTOR"}


@pytest.fixture(scope="module")
def prober(gpu: Renderer) -> Prober:
    return prober_of(gpu)


def _fresnel(eta: Any, k: Any, c: float) -> np.ndarray:
    """By complex numbers, of each channel."""
    n = np.asarray(eta, float) + 1j * np.asarray(k, float)
    t = np.sqrt(n * n - 1 + c * c)
    s, p = (c - t) / (c + t), (n * n * c - t) / (n * n * c + t)
    out: np.ndarray = (abs(s) ** 2 + abs(p) ** 2) / 2
    return out


def _albedo(prober: Prober, m: np.ndarray, cosines: Any, samples: int, flags: frozenset[str] = FLAGS) -> np.ndarray:
    """Of the brightest channel, and its standard error."""
    asks = np.zeros((len(cosines), 4), np.float32)
    asks[:, 0] = cosines
    inputs = {Slot.SUM: asks, Slot.MATERIALS: np.repeat(m, len(cosines))}
    out = prober.run("albedo.comp", len(cosines), inputs, (Slot.OUTPUT,), {}, flags, samples=samples)[0].astype(float)
    assert (out[:, 2] == 1).all()
    return np.stack([out[:, 0], np.sqrt(np.maximum(out[:, 1] - out[:, 0] ** 2, 0) / samples)])


def _metal(**members: Any) -> np.ndarray:
    return materials(**{"model": NUMBERS["principled"], "metallic": 1, **members})


@pytest.mark.parametrize("index", [(0.05, 4.2), (1.4, 1.6), (0.6, 0), (2.9, 3.1), (1.5, 0)])
def test_a_mirror_has_the_exact_reflectance(prober: Prober, index: tuple[float, float]) -> None:
    eta, k = index
    cosines = [0.05, 0.2, 0.5, 0.85, 1]
    found, _ = _albedo(prober, _metal(roughness=0, conductor_eta=eta, conductor_k=k), cosines, 64)
    expected = [_fresnel(eta, k, c) for c in np.float32(cosines).astype(float)]
    np.testing.assert_allclose(found, expected, rtol=2e-5, atol=2e-6)


def test_the_metal_alone_has_it_and_each_channel_its_own(gpu: Renderer) -> None:
    """A mirror in a white world, head-on; half a metal reflects half as much besides the dielectric's share."""
    wall = {"type": "quad", "origin": [-9, -9, 0], "u": [18, 0, 0], "v": [0, 18, 0], "material": "m"}
    m = {"type": "principled", "metallic": 1, "roughness": 0, **{k: list(v) for k, v in GOLD.items()}}
    for metallic in (1, 0.5):
        mixed = {"m": {**m, "metallic": metallic, "base_color": 0}}
        scene = document([wall], mixed, environment={"type": "constant", "radiance": 1})
        scene["camera"] = {"position": [0, 0, 1e4], "target": [0, 0, 0], "vfov": 0.05}
        image = render(gpu, scene, 16, width=8, height=8)
        expected = metallic * _fresnel(*GOLD.values(), 1.0) + (1 - metallic) * 0.04
        np.testing.assert_allclose(image.mean((0, 1))[:3], expected, rtol=0.02)


@pytest.mark.parametrize("roughness", [0, 0.1, 0.4, 0.7, 1])
def test_a_metal_that_reflects_everything_stays_white(prober: Prober, roughness: float) -> None:
    """Without a real part nothing is absorbed, whatever the angle."""
    m = _metal(roughness=roughness, conductor_eta=1e-7, conductor_k=3)
    albedo, error = _albedo(prober, m, np.linspace(0.06, 1, 12), 1 << 14)
    assert (albedo - 4 * error < 1.003).all() and (albedo + 4 * error > 0.99).all(), albedo


def test_no_metal_gains_light(prober: Prober) -> None:
    rng = np.random.default_rng(1)
    n = 2048
    m = np.repeat(_metal(), n)
    m["roughness"], m["metallic"], m["anisotropic"] = rng.random((3, n))
    m["conductor_eta"] = np.exp(rng.uniform(-4, 2, (n, 3)))
    m["conductor_k"] = np.exp(rng.uniform(-4, 3, (n, 3)))
    m["base_color"] = 1
    asks = np.zeros((n, 4), np.float32)
    asks[:, 0] = rng.uniform(0.03, 1, n)
    inputs = {Slot.SUM: asks, Slot.MATERIALS: m}
    out = prober.run("albedo.comp", n, inputs, (Slot.OUTPUT,), {}, FLAGS, samples=2048)[0].astype(float)
    error = np.sqrt(np.maximum(out[:, 1] - out[:, 0] ** 2, 0) / 2048)
    assert (out[:, 2] == 1).all()
    assert (out[:, 0] - 5 * error < 1.003).all(), (out[:, 0] - 5 * error).max()


def test_a_metal_without_indices_keeps_its_bits(prober: Prober) -> None:
    m = _metal(roughness=0.4, conductor_eta=ABSENT, conductor_k=ABSENT, base_color=(1, 0.78, 0.34))
    with_code, without = (_albedo(prober, m, [0.2, 0.9], 256, f) for f in (FLAGS, PRINCIPLED_FLAGS))
    assert (with_code == without).all()


def test_scenes_without_it_have_none_of_its_code() -> None:
    for model in ("principled", "microfacet"):
        more = {"fresnel": "conductor"} if model == "microfacet" else {"metallic": 1}
        indices = {k: list(v) for k, v in GOLD.items()}
        scene = pack(parse_scene(made_of({"type": model, **more, **indices})), IMAGES).arrays
        assert ("HAS_CONDUCTOR" in flags(scene)) == (model == "principled")
    assert "HAS_CONDUCTOR" not in flags(pack(parse_scene(made_of({"type": "principled"})), IMAGES).arrays, True)


@pytest.mark.parametrize("given", ["conductor_eta", "conductor_k"])
def test_half_an_index_is_refused_where_it_stands(given: str) -> None:
    scene = document([], {"m": {"type": "principled", given: [1, 1, 1]}})
    with pytest.raises(InvalidDocument) as refused:
        parse_scene(scene, "", Config())
    assert refused.value.errors[0].pointer == f"/materials/m/{given}"
    other = {"conductor_eta": "conductor_k", "conductor_k": "conductor_eta"}[given]
    assert other in refused.value.errors[0].detail
