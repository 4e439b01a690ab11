"""Thin films: the colours of a transfer matrix, nothing gained, nothing lost, and no step where a film begins."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from gpu import Renderer
from gpu.layout.bindings import Slot
from gpu.layout.models import NUMBERS
from tests import film
from tests.marks import seldom
from tests.probing import OPENPBR_FLAGS, PRINCIPLED_FLAGS, Prober, materials, openpbr, prober_of, rare
from tests.rendering import document, render

ANGLES = (0, 30, 50, 65, 80)
THICKNESSES = (30, 80, 150, 250, 400, 650, 1200, 5000)
INDICES = (1.2, 1.4, 1.8, 2.5)


@pytest.fixture(scope="module")
def prober(gpu: Renderer) -> Prober:
    return prober_of(gpu)


def _mirrored(prober: Prober, m: np.ndarray, cosines: np.ndarray, inside: int = 0) -> np.ndarray:
    """What a smooth surface mirrors (rgb) of light at each cosine: its sample at u_lobe 0."""
    pbr = m["model"][0] == NUMBERS["openpbr"]
    flags = (OPENPBR_FLAGS if pbr else PRINCIPLED_FLAGS) | rare(m) | {"HAS_FILM", "HAS_CONDUCTOR"}
    n = len(cosines)
    asks = np.zeros((2 * n, 4), np.float32)
    asks[n:, 0], asks[n:, 2] = np.sqrt(1 - cosines**2), cosines
    inputs = {Slot.SUM: asks, Slot.MATERIALS: m}
    choices = {"samples": 1, "inside": inside, "last_wo": n - 1}
    f, wi = prober.run("bsdf.comp", n, inputs, (Slot.MOMENTS, Slot.OUTPUT), {}, flags, **choices)
    assert (wi[:, 2] > 0).all() and (wi[:, 3] == 1).all()
    return f[:, :3].astype(float)


COSINES = np.cos(np.radians(np.array(ANGLES))).astype(np.float32).astype(float)
METALS = {
    "titanium": ([2.5] * 3, [3.4] * 3), "silver": ([0.05] * 3, [4.0] * 3),
    "gold": ([0.18, 0.42, 1.37], [3.42, 2.35, 1.77]),
}  # fmt: skip


def _is_near(found: np.ndarray, expected: np.ndarray) -> None:
    """Within 2 % + 0.004 of each channel."""
    off = np.abs(found - expected) / (0.004 + 0.02 * expected)
    worst = np.unravel_index(np.argmax(off), off.shape)
    assert off.max() < 1, (off.max(), worst, found[worst], expected[worst])


@pytest.mark.parametrize("base", [1.0, 1.33, 1.5, 2.4])
@pytest.mark.parametrize("index", INDICES)
def test_a_film_on_a_dielectric_is_that_of_a_transfer_matrix(prober: Prober, base: float, index: float) -> None:
    """From outside, and from inside at the angles that refraction makes of these. On index 1 it is soap."""
    inside = np.sqrt(1 - (1 - COSINES**2) / base**2)
    for thickness in THICKNESSES:
        m = materials(model=NUMBERS["principled"], roughness=0, transmission=1, ior=base, base_color=1)
        m["film_thickness"], m["film_ior"] = thickness, index
        expected = np.array([film.reflectance(c, thickness, index, base) for c in COSINES])
        _is_near(_mirrored(prober, m, COSINES), expected)
        _is_near(_mirrored(prober, m, inside, 1), expected)


@pytest.mark.parametrize("metal", METALS)
@pytest.mark.parametrize("index", INDICES)
def test_a_film_on_a_metal_is_that_of_a_transfer_matrix(prober: Prober, metal: str, index: float) -> None:
    eta, k = METALS[metal]
    for thickness in THICKNESSES:
        m = materials(model=NUMBERS["principled"], roughness=0, metallic=1, conductor_eta=eta, conductor_k=k)
        m["film_thickness"], m["film_ior"] = thickness, index
        n = np.array(eta) + 1j * np.array(k)
        expected = np.array([film.reflectance(c, thickness, index, n) for c in COSINES])
        _is_near(_mirrored(prober, m, COSINES), expected)


@pytest.mark.parametrize("edge", [1.0, 0.5, 0.1])
def test_a_metal_without_an_index_has_that_of_its_colour_and_its_edge(prober: Prober, edge: float) -> None:
    f0 = np.array([0.95, 0.6, 0.3])
    for thickness in THICKNESSES:
        m = openpbr(metallic=1, base_color=f0, specular_color=edge, roughness=0)
        m["film_thickness"], m["film_ior"] = thickness, 1.6
        index = film.metal_index(f0, np.full(3, edge))
        expected = np.array([film.reflectance(c, thickness, 1.6, index) for c in COSINES])
        _is_near(_mirrored(prober, m, COSINES), expected)


def test_titanium_is_bronze_and_blue(prober: Prober) -> None:
    """Of 30 and 50 nm of rutile."""
    m = materials(
        model=NUMBERS["principled"], roughness=0, metallic=1, conductor_eta=2.5, conductor_k=3.4, film_ior=2.4
    )
    for thickness, expected in ((30, [0.23, 0.14, 0.05]), (50, [0.03, 0.15, 0.37])):
        m["film_thickness"] = thickness
        np.testing.assert_allclose(_mirrored(prober, m, np.ones(1))[0], expected, atol=0.03)


@pytest.mark.parametrize("given", [{"metallic": 1, "base_color": 0.95, "specular_color": 0.5}, {"transmission": 1}])
def test_a_film_that_begins_makes_no_step(prober: Prober, given: dict[str, Any]) -> None:
    cosines = np.linspace(0.05, 1, 12)
    m = openpbr(roughness=0, **given)
    bare = _mirrored(prober, m, cosines)
    m["film_thickness"] = 1e-3
    np.testing.assert_allclose(_mirrored(prober, m, cosines), bare, atol=1e-4)
    m["film_thickness"], m["film_weight"] = 500, 0
    assert (_mirrored(prober, m, cosines) == bare).all()


def test_light_is_reflected_in_full_where_it_was(prober: Prober) -> None:
    """From inside, beyond the critical angle, whatever the film."""
    m = materials(model=NUMBERS["principled"], roughness=0, transmission=1, ior=1.5, film_thickness=300, film_ior=1.8)
    critical = math.sqrt(1 - 1 / 1.5**2)
    assert (_mirrored(prober, m, np.linspace(0.05, critical - 1e-3, 8), 1) == 1).all()


FILMS = ((120, 1.4), (300, 1.33), (250, 2.0), (500, 2.5), (1500, 1.6))
BASES: dict[str, dict[str, Any]] = {
    "diffuse": {}, "glass": {"transmission": 1}, "soap": {"transmission": 1, "ior": 1}, "metal": {"metallic": 1},
    "half": {"transmission": 0.5, "metallic": 0.3}, "dense": {"ior": 2.4},
    "pane": {"transmission": 1, "thin_walled": 1},
}  # fmt: skip


def _albedo(
    prober: Prober, m: np.ndarray, asks: np.ndarray, samples: int, more: frozenset[str] = frozenset()
) -> tuple[np.ndarray, np.ndarray]:
    """The albedos and their errors, of a kernel that has `more` flags besides those that it needs."""
    pbr = m["model"][0] == NUMBERS["openpbr"]
    flags = (OPENPBR_FLAGS if pbr else PRINCIPLED_FLAGS) | rare(m) | more
    inputs = {Slot.SUM: asks, Slot.MATERIALS: m}
    out = prober.run("albedo.comp", len(m), inputs, (Slot.OUTPUT,), {}, flags, samples=samples)[0].astype(float)
    assert (out[:, 2] == 1).all()
    return out[:, 0], np.sqrt(np.maximum(out[:, 1] - out[:, 0] ** 2, 0) / samples)


@pytest.mark.parametrize("base", seldom(BASES, ["soap", "half", "dense"]))
@pytest.mark.parametrize("model", ["principled", pytest.param("openpbr", marks=pytest.mark.slow)])
def test_white_under_a_film_loses_little_and_never_gains(prober: Prober, base: str, model: str) -> None:
    """The brightest channel in a furnace, from both sides of what transmits."""
    given = {**BASES[base], "base_color": 1, "roughness": 0}
    one = openpbr(**given) if model == "openpbr" else materials(model=NUMBERS["principled"], **given)
    roughness, cosines, films = (
        a.ravel()
        for a in np.meshgrid([0, 0.15, 0.4, 0.7, 1], np.linspace(0.06, 1, 8), range(len(FILMS)), indexing="ij")
    )
    m = np.repeat(one, len(cosines))
    m["roughness"] = roughness
    m["film_thickness"], m["film_ior"] = np.array(FILMS)[films.astype(int)].T
    asks = np.zeros((len(m), 4), np.float32)
    asks[:, 0] = cosines
    for inside in range(2 if given.get("transmission", 0) == 1 else 1):
        asks[:, 2] = inside
        albedo, error = _albedo(prober, m, asks, 1 << 13, frozenset({"HAS_THIN_WALLS"}))  # one kernel for all
        over, under = albedo - 4 * error, albedo + 4 * error
        high, low = int(np.argmax(over)), int(np.argmin(under))
        assert over[high] < 1.003, (over[high], error[high], m[high], asks[high])
        assert under[low] > 0.98, (under[low], error[low], m[low], asks[low])


def test_thick_films_on_white_gain_nothing_from_their_ripples(prober: Prober) -> None:
    """Up to a roughness of .3. Means over rougher facets know four cosines: up to 1.3 % comes back too much there."""
    grid = np.meshgrid([1000, 1200, 1400, 1600], [1.12, 1.33], [0, 0.2, 0.3], np.linspace(0.1, 1, 6), indexing="ij")
    thickness, ior, roughness, cosines = (a.ravel() for a in grid)
    m = np.repeat(materials(model=NUMBERS["principled"], base_color=1), len(cosines))
    m["film_thickness"], m["film_ior"], m["roughness"] = thickness, ior, roughness
    asks = np.zeros((len(m), 4), np.float32)
    asks[:, 0] = cosines
    albedo, error = _albedo(prober, m, asks, 1 << 13)
    assert (albedo - 4 * error).max() < 1.003 and (albedo + 4 * error).min() > 0.98


def test_a_film_on_dispersive_glass_keeps_the_furnace(gpu: Renderer) -> None:
    """A filmed ball of flint glass is not seen in a white world, whichever channel leads."""
    glass = {"type": "principled", "transmission": 1, "base_color": 1, "roughness": 0, "ior": 1.7, "abbe": 20}
    ball = {"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "m"}
    scene = document(
        [ball], {"m": {**glass, "film_thickness": 320, "film_ior": 1.35}},
        environment={"type": "constant", "radiance": 1},
        camera={"position": [0, 0, 4], "target": [0, 0, 0], "vfov": 24},
    )  # fmt: skip
    image = render(gpu, scene, 128, max_bounces=64)[..., :3].mean((0, 1))
    assert (image > 0.98).all() and (image < 1.003).all(), image
    assert np.ptp(image) < 5e-3, image
