"""Thin walls: panes do what their two faces do, gain nothing and lose little; leaves pass diffuse light."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.stats import qmc

from gpu import Renderer
from gpu.layout.bindings import Slot
from gpu.layout.models import NUMBERS
from tests.marks import BY_ESTIMATOR, seldom
from tests.probing import OPENPBR_FLAGS, PRINCIPLED_FLAGS, Prober, materials, openpbr, prober_of
from tests.rendering import document, render

PRINCIPLED = NUMBERS["principled"]
WALLS = frozenset({"HAS_THIN_WALLS"})
FLAGS = {PRINCIPLED: PRINCIPLED_FLAGS | WALLS, NUMBERS["openpbr"]: OPENPBR_FLAGS | WALLS}
PANE = {"type": "principled", "transmission": 1, "thin_walled": True, "base_color": 1, "roughness": 0}
WHITE = {"type": "constant", "radiance": 1}
QUAD = {"type": "quad", "origin": [-1, -1, 0], "u": [2, 0, 0], "v": [0, 2, 0], "material": "m"}
COSINES = np.linspace(0.1, 1, 16)


@pytest.fixture(scope="module")
def prober(gpu: Renderer) -> Prober:
    return prober_of(gpu)


def pane(model: int = PRINCIPLED, **members: Any) -> np.ndarray:
    given = {"thin_walled": 1, "transmission": 1, "roughness": 0, "base_color": 1, **members}
    return materials(model=model, **given) if model == PRINCIPLED else openpbr(**given)


def fresnel(c: Any, eta: float) -> Any:
    t = np.sqrt(1 - (1 - np.square(c)) / eta**2)
    return 0.5 * (((c - eta * t) / (c + eta * t)) ** 2 + ((eta * c - t) / (eta * c + t)) ** 2)


def _directions(cosines: Any) -> np.ndarray:
    c = np.array(cosines, float)
    return np.stack([0.6 * np.sqrt(1 - c * c), -0.8 * np.sqrt(1 - c * c), c], 1)


def _ask(prober: Prober, m: np.ndarray, wo: np.ndarray, ask: np.ndarray, sample: int = 1) -> list[np.ndarray]:
    """(n, 4) f and pdf, and (n, 4) directions; `ask` are wi, or numbers to sample by."""
    asks = np.zeros((2 * len(ask), 4), np.float32)
    asks[: len(ask), :3], asks[len(ask) :, :3] = ask, wo
    inputs = {Slot.SUM: asks, Slot.MATERIALS: m}
    outputs, choices = (Slot.MOMENTS, Slot.OUTPUT), {"samples": sample, "inside": 0, "last_wo": len(ask) - 1}
    flags = FLAGS[int(m["model"][0])]
    found = prober.run("bsdf.comp", len(ask), inputs, outputs, {}, flags, **choices)
    return [each.astype(float) for each in found]


def _albedo(prober: Prober, m: np.ndarray, asks: np.ndarray, samples: int) -> tuple[np.ndarray, np.ndarray]:
    flags = FLAGS[int(m["model"][0])]
    inputs = {Slot.SUM: asks.astype(np.float32), Slot.MATERIALS: m}
    out = prober.run("albedo.comp", len(m), inputs, (Slot.OUTPUT,), {}, flags, samples=samples)[0].astype(float)
    assert (out[:, 2] == 1).all()
    return out[:, 0], np.sqrt(np.maximum(out[:, 1] - out[:, 0] ** 2, 0) / samples)


@pytest.mark.parametrize("model", FLAGS)
@pytest.mark.parametrize("ior", [1.33, 1.5, 2.4])
def test_a_smooth_pane_reflects_with_both_faces(prober: Prober, model: int, ior: float) -> None:
    """2 R / (1 + R), and straight through (1 - R) / (1 + R), tinted once."""
    cosines = np.array([1, 0.8, 0.5, 0.2, 0.05])
    wo, r = _directions(cosines), fresnel(cosines, ior)
    tint = {"base_color": (1, 0.5, 0.25)} if model == PRINCIPLED else {"attenuation_color": (1, 0.5, 0.25)}
    m = pane(model, ior=ior)
    for name, value in tint.items():
        m[name] = value
    for u, expected, way in (
        (0.0, (2 * r / (1 + r))[:, None] * [1, 1, 1], [-1, -1, 1]),
        (0.9999, ((1 - r) / (1 + r))[:, None] * [1, 0.5, 0.25], [-1, -1, -1]),
    ):
        f, wi = _ask(prober, m, wo, np.tile([u, 0.5, 0.5], (5, 1)))
        assert (wi[:, 3] == 1).all(), "perfectly specular"
        np.testing.assert_allclose(wi[:, :3], wo * way, atol=1e-6)
        np.testing.assert_allclose(f[:, :3], expected, rtol=2e-5)


def test_a_pane_of_index_1_is_not_there(prober: Prober) -> None:
    wo = _directions([1, 0.5, 0.1])
    for roughness in (0, 0.7):
        f, wi = _ask(prober, pane(ior=1, roughness=roughness), wo, np.full((3, 3), 0.5))
        np.testing.assert_allclose(wi[:, :3], -wo, atol=1e-6)
        np.testing.assert_allclose(f[:, :3], 1, atol=1e-6)


@pytest.mark.parametrize("roughness", seldom([0, 0.05, 0.2, 0.3, 0.5, 0.7, 1], [0.05, 0.3, 0.7]))
def test_white_panes_lose_little(prober: Prober, roughness: float) -> None:
    for model in FLAGS:
        for ior in (1.1, 1.33, 1.5, 2.4, 4):
            m = np.repeat(pane(model, ior=ior, roughness=roughness), 16)
            albedo, error = _albedo(prober, m, np.stack([COSINES, COSINES, 0 * COSINES, 0 * COSINES], 1), 1 << 14)
            assert (albedo - 4 * error < 1.003).all(), (model, ior, albedo)
            assert (albedo + 4 * error > 0.98).all(), (model, ior, albedo)


@pytest.mark.parametrize("model", FLAGS)
def test_no_wall_gains_light(prober: Prober, model: int) -> None:
    """4 096 draws of what a wall may be, from both sides; white ones as well, and those at the corners."""
    names = (
        "metallic", "roughness", "anisotropic", "sheen", "clearcoat", "clearcoat_roughness", "transmission",
        "sheen_roughness", "subsurface", "diffuse_transmission", "specular", "ior",
        "coat_ior", "colour", "cosine", "azimuth",
    )  # fmt: skip
    u = qmc.Sobol(len(names), seed=4).random(4096)
    u[2048:, :11] = np.round(u[2048:, :11])
    d = dict(zip(names, u.T, strict=True))
    m = np.repeat(pane(model), len(u))
    for name in names[:10]:
        m[name] = d[name]
    m["ior"] = 1 + 3 * d["ior"] ** 2 if model == PRINCIPLED else np.exp(2.5 * d["ior"] - 0.7)
    m["coat_ior"] = 1 + 2 * d["coat_ior"]
    m["specular"] = d["specular"]
    grey = np.where(np.arange(len(u)) % 3 == 0, d["colour"], 1)[:, None]
    for name in ("base_color", "diffuse_transmission_color", "attenuation_color", "specular_color"):
        m[name] = grey
    asks = np.stack([np.maximum(d["cosine"], 0.02), 7 * d["azimuth"], np.arange(len(u)) % 2, 0 * d["cosine"]], 1)
    albedo, _ = _albedo(prober, m, asks, 512)
    first = np.argsort(-albedo)[:192]
    again, error = _albedo(prober, m[first], asks[first], 1 << 15)
    top = int(np.argmax(again - 4 * error))
    assert again[top] - 4 * error[top] < 1.003, (again[top], error[top], m[first][top], asks[first][top])


def test_a_white_leaf_gives_all_of_it(prober: Prober) -> None:
    """What comes back and what goes through add up to the albedo, however it is divided."""
    cosines = np.linspace(0.15, 1, 8)
    asks = np.stack([cosines, 0 * cosines, 0 * cosines, 0 * cosines], 1)
    given = {"transmission": 0, "base_color": 1}
    for share in (0, 0.3, 1):
        m = np.repeat(
            materials(model=PRINCIPLED, thin_walled=1, **given, diffuse_transmission=share, roughness=0.6), 8
        )
        albedo, error = _albedo(prober, m, asks, 1 << 14)
        assert (abs(albedo - 1) < 4 * error + 5e-3).all(), (share, albedo)
    # Without a boundary, and of another colour on the other side.
    m = materials(model=PRINCIPLED, thin_walled=1, specular=0, base_color=0.6, diffuse_transmission=0.25)
    m["diffuse_transmission_color"] = 0.2
    wi = _directions(np.full(2, 0.7)) * np.array([[1, 1, 1], [1, 1, -1]])
    f, _ = _ask(prober, m, _directions([0.4, 0.4]), wi, 0)
    np.testing.assert_allclose(f[:, 0], 0.7 / math.pi * np.array([0.75 * 0.6, 0.25 * 0.2]), rtol=1e-3)


def _two_faces(ior: float, alpha: float, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Angles by which two rough faces turn light that meets them head-on, and the shares that pass."""
    rng = np.random.default_rng(5)

    def bent(wo: np.ndarray, k: float, eta: float) -> tuple[np.ndarray, np.ndarray]:
        v = wo * [alpha, alpha, 1]
        v /= np.linalg.norm(v, axis=1, keepdims=True)
        z = (1 - rng.random(n)) * (1 + v[:, 2]) - v[:, 2]
        r, phi = np.sqrt(np.maximum(1 - z * z, 0)), 2 * np.pi * rng.random(n)
        m = (np.stack([r * np.cos(phi), r * np.sin(phi), z], 1) + v) * [alpha, alpha, 1]
        m /= np.linalg.norm(m, axis=1, keepdims=True)
        c = (wo * m).sum(1)
        inside = 1 - k * k * (1 - c * c)
        t = (k * c - np.sqrt(np.maximum(inside, 0)))[:, None] * m - k * wo
        passes = (inside > 0) & (t[:, 2] < 0)
        share = np.zeros(n)
        cos_out = np.sqrt(np.maximum(inside, 0))
        outer = np.where(k < 1, c, cos_out)
        share[passes] = 1 - fresnel(np.minimum(outer[passes], 1), eta)
        stretch = np.sqrt(alpha**2 * (1 - t[:, 2] ** 2) + t[:, 2] ** 2)
        return t, share * 2 * abs(t[:, 2]) / (abs(t[:, 2]) + stretch)

    t, first = bent(np.tile([0.0, 0.0, 1.0], (n, 1)), 1 / ior, ior)
    t, second = bent(-t, ior, ior)
    return np.arccos(np.clip(-t[:, 2], -1, 1)), first * second


@pytest.mark.parametrize("ior", [1.33, 1.5, 1.8])
@pytest.mark.parametrize("roughness", [0.2, 0.4])
def test_a_frosted_pane_blurs_as_its_two_faces_do(prober: Prober, ior: float, roughness: float) -> None:
    """Half of what goes through straight is within the same angle as after two refractions."""
    angles, shares = _two_faces(ior, roughness**2, 200_000)
    order = np.argsort(angles)
    sums = np.cumsum(shares[order])
    expected = np.interp(0.5 * sums[-1], sums, angles[order])
    n = 60_000
    _, wi = _ask(
        prober,
        pane(ior=ior, roughness=roughness),
        np.tile([0, 0, 1], (n, 1)),
        np.random.default_rng(6).random((n, 3)),
    )
    through = wi[:, 2] < 0
    assert np.median(np.arccos(np.clip(-wi[through, 2], -1, 1))) == pytest.approx(expected, rel=0.08)


@pytest.mark.slow
def test_a_frosted_pane_blurs_an_edge(gpu: Renderer) -> None:
    """The edge of a lamp a metre behind it is as wide as its facets' slopes are spread, and sharp without any.

    The slopes along one axis have the distribution (1 + s / sqrt(alpha^2 + s^2)) / 2, whose quartiles are
    alpha / sqrt(3) from the middle; light turns by twice a slope.
    """
    lamp = {"type": "quad", "origin": [0, -9, -1], "u": [9, 0, 0], "v": [0, 18, 0], "material": "lamp"}
    wall = {**QUAD, "origin": [-9, -9, 0], "u": [18, 0, 0], "v": [0, 18, 0]}
    camera = {"position": [0, 0, 40], "target": [0, 0, 0], "vfov": 0.5}
    for roughness in (0, 0.3, 0.4, 0.5):
        made = {"m": {**PANE, "roughness": roughness}, "lamp": {"type": "diffuse", "albedo": 0, "emission": 1}}
        image = render(gpu, document([wall, lamp], made, camera=camera), 2048, width=64, height=16, max_bounces=3)
        row, pixel = image[..., 0].mean(0) / (12 / 13), 2 * 40 * math.tan(math.radians(0.25)) / 16
        low, high = (np.interp(level, row, np.arange(64) * pixel) for level in (0.25, 0.75))
        alpha = 0.83 * 0.5 * roughness**2
        assert high - low == pytest.approx(4 * alpha / math.sqrt(3), rel=0.12, abs=pixel), roughness


@pytest.mark.parametrize("estimator", BY_ESTIMATOR)
def test_furnaces_of_walls(gpu: Renderer, estimator: str) -> None:
    """A white pane of any roughness, a ball of it, and a white leaf are not seen in a white world."""
    camera = {"position": [0, 0, 4], "target": [0, 0, 0], "vfov": 24}
    ball = {"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "m"}
    leaf = {**PANE, "transmission": 0, "diffuse_transmission": 0.5, "roughness": 0.6}
    for material in (PANE, {**PANE, "roughness": 1}, leaf):
        for shape in (QUAD, ball):
            shapes = [shape, *({**other, "transform": {"translate": [50, 0, 0]}} for other in (QUAD, ball))]
            made = {"m": material, "pane": PANE, "leaf": leaf}  # what one kernel serves
            scene = document(shapes, made, environment=WHITE, camera=camera)
            image = render(gpu, scene, 128, max_bounces=64, estimator=estimator)[..., :3]
            assert 0.98 < image.mean() < 1.003, (material, shape, image.mean())


def test_a_wall_has_no_inside(gpu: Renderer) -> None:
    """What would attenuate inside does not, behind one wall as behind two, and the index bends nothing."""
    lamp = {"type": "quad", "origin": [-9, -9, -3], "u": [18, 0, 0], "v": [0, 18, 0], "material": "lamp"}
    camera = {"position": [0, 0, 4], "target": [0, 0, 0], "vfov": 0.02}
    box = {"type": "box", "min": [-2, -2, -1], "max": [2, 2, 1], "material": "m"}
    red = {**PANE, "attenuation_color": [0.9, 0.1, 0.1], "attenuation_distance": 0.01}
    made = {"m": red, "lamp": {"type": "diffuse", "albedo": 0, "emission": 1}}
    t = 2 * 1.5 / (1.5**2 + 1)
    # Two panes with all reflections between them: 1 / T = 1 / t1 + 1 / t2 - 1.
    for shape, expected in (({**QUAD, "origin": [-1, -1, 1]}, t), (box, 1 / (2 / t - 1))):
        image = render(gpu, document([shape, lamp], made, camera=camera), 1024, width=8, height=8, max_bounces=64)
        np.testing.assert_allclose(image[..., :3].mean((0, 1)), expected, atol=4e-3)
    solid = {"type": "principled", "transmission": 1, "roughness": 0, "base_color": 1, "ior": 1}
    solid |= {"attenuation_color": [0.9, 0.5, 0.1], "attenuation_distance": 1}
    inner = {"type": "box", "min": [-1, -1, -0.5], "max": [1, 1, 0.5], "material": "solid"}
    made |= {"solid": solid}
    image = render(gpu, document([box, inner, lamp], made, camera=camera), 1024, width=8, height=8, max_bounces=64)
    left = np.array([0.9, 0.5, 0.1])  # between the two panes each way through the body
    expected = left * t * t / (1 - ((1 - t) * left) ** 2)
    np.testing.assert_allclose(image[..., :3].mean((0, 1)), expected, atol=4e-3)
