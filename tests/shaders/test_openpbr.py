"""`openpbr` never gains light, its white loses little, and the specification's closed forms hold."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np
import pytest
from scipy.stats import qmc

from gpu import Renderer
from gpu.layout.bindings import Slot
from gpu.layout.models import NUMBERS
from service.config import Config
from service.document import parse_scene
from service.problems import InvalidDocument
from tests import film
from tests.probing import OPENPBR_FLAGS, PRINCIPLED_FLAGS, Prober, materials, openpbr, prober_of, rare
from tests.rendering import document

FRACTIONS = (
    "base_weight", "diffuse_roughness", "metallic", "roughness", "anisotropic", "transmission", "clearcoat",
    "clearcoat_roughness", "coat_anisotropy", "coat_darkening", "sheen", "sheen_roughness",
)  # fmt: skip
COLOURS = ("base_color", "specular_color", "attenuation_color", "coat_color", "sheen_color")
OTHERS = ("specular", "ior", "coat_ior", "cosine", "azimuth")
NAMES = (*FRACTIONS, *OTHERS, *(f"{name} {c}" for name in COLOURS for c in "rgb"))


@pytest.fixture(scope="module")
def prober(gpu: Renderer) -> Prober:
    return prober_of(gpu)


def _draws(kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Records and directions: 4 096 low-discrepancy draws of all parameters."""
    u = qmc.Sobol(len(NAMES), seed=3).random(4096)
    column = dict(zip(NAMES, u.T, strict=True))
    m = np.repeat(openpbr(), len(u))
    for name in FRACTIONS:
        m[name] = np.round(column[name]) if kind == "corners" else column[name]
    if kind == "any":
        for name in COLOURS:
            m[name] = np.stack([column[f"{name} {c}"] for c in "rgb"], 1)
    else:
        for name in COLOURS:
            m[name] = 1
        m["base_weight"] = 1
    m["specular"] = np.where(column["specular"] < 0.7, column["specular"] / 0.7, 1 / (1.001 - column["specular"]))
    m["ior"] = np.exp(2.5 * column["ior"] - 0.7)  # 0.5 to 6
    m["coat_ior"] = np.exp(2.5 * column["coat_ior"] - 0.7)
    asks = np.zeros((len(u), 4), np.float32)
    asks[:, 0] = np.maximum(column["cosine"], 0.02)
    asks[:, 1] = 2 * np.pi * column["azimuth"]
    asks[:, 2] = np.arange(len(u)) % 2  # every other one from inside
    return m, asks


def _albedo(prober: Prober, m: np.ndarray, asks: np.ndarray, samples: int) -> tuple[np.ndarray, np.ndarray]:
    inputs = {Slot.SUM: asks, Slot.MATERIALS: m}
    told = prober.run("albedo.comp", len(m), inputs, (Slot.OUTPUT,), {}, OPENPBR_FLAGS | rare(m), samples=samples)
    out = told[0].astype(float)
    assert (out[:, 2] == 1).all(), m[out[:, 2] != 1][:1]
    return out[:, 0], np.sqrt(np.maximum(out[:, 1] - out[:, 0] ** 2, 0) / samples)


@pytest.mark.parametrize("kind", ["any", "white", "corners"])
def test_no_parameters_gain_light(prober: Prober, kind: str) -> None:
    m, asks = _draws(kind)
    if kind == "any":
        film.draw(m)
    albedo, _ = _albedo(prober, m, asks, 512)
    first = np.argsort(-albedo)[:64]  # the brightest again, with more samples
    again, error = _albedo(prober, m[first], asks[first], 1 << (13 if kind == "any" else 15))
    top = int(np.argmax(again - 4 * error))
    assert again[top] - 4 * error[top] < 1.003, (again[top], error[top], m[first][top], asks[first][top])


def test_films_on_white_gain_little(prober: Prober) -> None:
    """All parameters are drawn. Means over rough facets know four cosines: a few of 4 096 draws gain more."""
    gains = film.surest_gains(partial(_albedo, prober), *_draws("white"))
    assert gains[0] < 1.03 and gains[4] < 1.003, gains[:6]


WHITE: dict[str, dict[str, Any]] = {
    "metal": {"metallic": 1},
    "glossy": {},
    "clay": {"diffuse_roughness": 1},
    "glass": {"transmission": 1},
    "coat": {"clearcoat": 1},
    "rough coat": {"clearcoat": 1, "clearcoat_roughness": 0.6, "coat_anisotropy": 0.5},
    "coated metal": {"clearcoat": 1, "metallic": 1},
    "coated glass": {"clearcoat": 1, "transmission": 1},
    "fuzz": {"sheen": 1},
    "fuzz on a coat": {"sheen": 0.7, "clearcoat": 0.6, "sheen_roughness": 0.2},
}


@pytest.mark.parametrize("name", WHITE)
def test_white_loses_little(prober: Prober, name: str) -> None:
    cosines = np.tile(np.linspace(0.1, 1, 16), 4)
    m = np.repeat(openpbr(base_color=1, specular_color=1, **WHITE[name]), len(cosines))
    m["roughness"] = np.repeat([0, 0.2, 0.6, 1], 16)
    asks = np.stack([cosines, cosines, 0 * cosines, 0 * cosines], 1).astype(np.float32)
    for inside in range(1 + WHITE[name].get("transmission", 0)):
        asks[:, 2] = inside
        albedo, error = _albedo(prober, m, asks, 1 << 14)
        assert (albedo - 4 * error < 1.003).all(), albedo.max()
        assert (albedo + 4 * error > 0.98).all(), albedo


def _grey(prober: Prober, cosines: Any, samples: int = 1 << 14, **members: Any) -> np.ndarray:
    """The albedo of one material for each cosine."""
    c = np.array(cosines, np.float32)
    asks = np.stack([c, 0 * c, 0 * c, 0 * c], 1)
    return _albedo(prober, np.repeat(openpbr(**members), len(c)), asks, samples)[0]


def _fresnel(c: float, eta: float) -> float:
    t = math.sqrt(1 - (1 - c * c) / eta**2)
    return 0.5 * (((c - eta * t) / (c + eta * t)) ** 2 + ((eta * c - t) / (eta * c + t)) ** 2)


def test_a_metals_edge_has_its_colour(prober: Prober) -> None:
    """F(1/7) is the specular colour times Schlick's reflectance there, and never above 1."""
    schlick = 0.6 + 0.4 * (6 / 7) ** 5
    mirror = {"metallic": 1, "roughness": 0, "base_color": 0.6}
    for weight, color in ((1, 0.3), (0.5, 0.8), (1, 1)):
        found = _grey(prober, [1 / 7, 1], 64, specular=weight, specular_color=color, **mirror)
        np.testing.assert_allclose(found, [weight * color * schlick, weight * 0.6], rtol=1e-5)
    assert _grey(prober, [0.05, 1], 64, **{**mirror, "specular": 4}).tolist() == [1, 1]


@pytest.mark.parametrize("roughness", [0.3, 1])
def test_rough_diffuse_has_the_albedo_of_the_papers(prober: Prober, roughness: float) -> None:
    """Without a boundary: the closed form of energy-preserving Oren-Nayar."""
    a = 1 / (1 + (0.5 - 2 / (3 * math.pi)) * roughness)
    mean = a + (2 / 3 - 28 / (15 * math.pi)) * roughness * a
    theta = np.arccos([1, 0.7, 0.3, 0.1])
    s, c, t = np.sin(theta), np.cos(theta), np.tan(theta)
    once = a + a * roughness / math.pi * (s * (theta - s * c) + 2 / 3 * t * (1 - s**3 - c))
    for rho in (1.0, 0.4):
        again = rho**2 * mean / (1 - rho * (1 - mean))
        found = _grey(prober, c, 1 << 16, specular=0, diffuse_roughness=roughness, base_color=rho)
        np.testing.assert_allclose(found, rho * once + again * (1 - once), atol=2e-3)


@pytest.mark.parametrize("n", [1.2, 1.6, 2.2])
def test_a_coat_darkens_what_lies_under_it(prober: Prober, n: float) -> None:
    """A smooth coat over a Lambertian base of albedo 0.5, exactly [OpenPBR 1.1.1]."""
    base, cosines = 0.5, [1.0, 0.6, 0.25]
    mu = (np.arange(20_000) + 0.5) / 20_000
    k = 1 - (1 - float(np.mean([2 * c * _fresnel(c, n) for c in mu]))) / n**2
    f = np.array([_fresnel(c, n) for c in cosines])
    matt = {"specular": 0, "base_color": base, "clearcoat": 1, "coat_ior": n}
    darkened = (1 - k) / (1 - base * k)
    np.testing.assert_allclose(_grey(prober, cosines, **matt), f + base * (1 - f) * darkened, atol=4e-3)
    undarkened = _grey(prober, cosines, **matt, coat_darkening=0)
    np.testing.assert_allclose(undarkened, f + base * (1 - f), atol=4e-3)


def test_the_weight_is_a_factor_on_the_reflectance_head_on(prober: Prober) -> None:
    black = {"base_color": 0, "roughness": 0}
    for weight, n in ((0.5, 1.5), (3, 1.5), (1, 0.8), (1, 8), (25, 1.5), (100, 1.5)):
        expected = min(1.0, weight * ((n - 1) / (n + 1)) ** 2)
        assert _grey(prober, [1], 64, specular=weight, ior=n, **black)[0] == pytest.approx(expected, abs=5e-4)


def test_layers_of_weight_0_leave_the_bits(prober: Prober) -> None:
    plain = _grey(prober, [0.2, 0.9], 256)
    bare = {"coat_ior": 2, "coat_color": 0, "clearcoat_roughness": 0.7, "sheen_color": 0, "sheen_roughness": 0.1}
    assert (_grey(prober, [0.2, 0.9], 256, **bare) == plain).all()


def test_a_plain_one_is_the_plain_principled(prober: Prober) -> None:
    """Colour, roughness and index alone mean the same in both."""
    cosines = [0.15, 0.5, 1.0]
    asks = np.stack([cosines, [0] * 3, [0] * 3, [0] * 3], 1).astype(np.float32)
    principled = materials(model=NUMBERS["principled"], base_color=0.6, roughness=0.4, ior=1.5)
    told = prober.run(
        "albedo.comp", 3, {Slot.SUM: asks, Slot.MATERIALS: np.repeat(principled, 3)}, (Slot.OUTPUT,), {},
        PRINCIPLED_FLAGS, samples=4096,
    )  # fmt: skip
    found = _grey(prober, cosines, 4096, base_color=0.6, roughness=0.4)
    np.testing.assert_allclose(found, told[0][:, 0], rtol=1e-5)


def test_a_shape_has_one_medium() -> None:
    for more in ({"subsurface_weight": 0.5}, {"transmission_weight": 1, "transmission_depth": 1}):
        filled = {"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "m", "medium": {"absorption": 1}}
        scene = document([filled], {"m": {"type": "openpbr", **more}})
        with pytest.raises(InvalidDocument) as refused:
            parse_scene(scene, "", Config())
        assert refused.value.errors[0].pointer == "/shapes/0/medium"
