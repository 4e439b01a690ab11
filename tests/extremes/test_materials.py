"""Materials at the ends of their ranges, seen and lit from straight above to .01 degrees off the surface."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gpu import Renderer
from gpu.layout.bindings import Slot
from gpu.layout.models import NUMBERS
from tests import baseline, disney
from tests.probing import DISNEY_FLAGS, PRINCIPLED_FLAGS, Prober, materials, prober_of

D, P, G, B = NUMBERS["disney"], NUMBERS["principled"], NUMBERS["metal_rough"], NUMBERS["blinn_phong"]
GLASS = {"model": P, "transmission": 1, "base_color": 1}
ROUGHNESSES = (0, 1e-4, 0.0099, 0.01, 0.0101, 1)
ROWS = {
    **{f"disney metal, roughness {r}": materials(model=D, metallic=1, roughness=r) for r in ROUGHNESSES},
    **{f"disney plastic, roughness {r}": materials(model=D, roughness=r, specular=1) for r in (0, 1e-4, 1)},
    "disney coat, GTR1 of .001": materials(model=D, clearcoat=1, clearcoat_gloss=1, base_color=0),
    "disney coat, GTR1 of .1": materials(model=D, clearcoat=1, clearcoat_gloss=0, base_color=0),
    "disney all at 1": materials(model=D, base_color=1, metallic=1, subsurface=1, specular=1, roughness=1,
                                 specular_tint=1, anisotropic=1, sheen=1, sheen_tint=1, clearcoat=1,
                                 clearcoat_gloss=1),
    "disney all at 0": materials(model=D, base_color=0, specular=0, roughness=0, sheen_tint=0, clearcoat_gloss=0),
    "disney brushed mirror": materials(model=D, metallic=1, roughness=0, anisotropic=1),
    "disney thin black": materials(model=D, base_color=(0, 0, 1e-30), specular_tint=1, subsurface=1, sheen=1),
    **{f"glTF metal, roughness {r}": materials(model=G, metallic=1, roughness=r, base_color=1) for r in (0, 1e-4, 1)},
    **{f"blinn-phong, shininess {s:g}": materials(model=B, phong_specular=1, shininess=s) for s in (0, 1, 1e4, 1e9)},
    **{f"metal, roughness {r}": materials(model=P, metallic=1, base_color=1, roughness=r) for r in ROUGHNESSES},
    **{f"plastic, roughness {r}": materials(model=P, base_color=1, roughness=r) for r in ROUGHNESSES},
    **{f"glass, roughness {r}": materials(**GLASS, roughness=r) for r in ROUGHNESSES},
    **{f"glass, ior {n}, roughness {r}": materials(**GLASS, roughness=r, ior=n)
       for n in (1, 1.0001, 1.00011, 1.001, 3, 4) for r in (0, 0.02, 1)},
    "brushed glass": materials(**GLASS, roughness=0.3, anisotropic=1, ior=3),
    "metal brushed": materials(model=P, metallic=1, base_color=1, roughness=0.05, anisotropic=1),
    "coat, roughness 0": materials(model=P, clearcoat=1, clearcoat_roughness=0, base_color=0),
    "coat, roughness 1": materials(model=P, clearcoat=1, clearcoat_roughness=1, base_color=0),
    "velvet, roughness 0": materials(model=P, sheen=1, sheen_roughness=0, base_color=0),
    "velvet, roughness 1": materials(model=P, sheen=1, sheen_roughness=1, base_color=0),
    "all at 1": materials(model=P, base_color=1, metallic=1, subsurface=1, specular=1, roughness=1, specular_tint=1,
                          anisotropic=1, sheen=1, sheen_tint=1, clearcoat=1, clearcoat_gloss=1, transmission=1),
    "all at 0": materials(model=P, base_color=0, specular=0, roughness=0, sheen_tint=0, clearcoat_gloss=0),
    "nearly metal": materials(**GLASS, metallic=1 - 1e-7, roughness=0.5),
    "nearly clear": materials(model=P, transmission=1e-7, base_color=1, roughness=0.5),
}  # fmt: skip
ELEVATIONS = (90.0, 45.0, 1.0, 0.1, 0.01)  # degrees above the surface
OLD = DISNEY_FLAGS | {"HAS_METAL_ROUGH", "HAS_BLINN_PHONG"}
SIDES = {row: (0, 1) if m["transmission"][0] > 0 and m["metallic"][0] < 1 else (0,) for row, m in ROWS.items()}
CASES = [(row, inside) for row in ROWS for inside in SIDES[row]]


@pytest.fixture(scope="module")
def prober(gpu: Renderer) -> Prober:
    return prober_of(gpu)


def _at(elevation: float, azimuth: float | np.ndarray) -> np.ndarray:
    e, a = np.radians(elevation), np.asarray(azimuth)
    w = np.stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e) * np.ones_like(a)], -1)
    return np.asarray(w.astype(np.float32))


def _ask(prober: Prober, row: str, wo: np.ndarray, ask: np.ndarray, sample: int, inside: int) -> list[np.ndarray]:
    asks = np.zeros((len(ask) + 1, 4), np.float32)
    asks[:-1, :3], asks[-1, :3] = ask, wo
    principled = ROWS[row]["model"][0] == P
    inputs, choices = {Slot.SUM: asks, Slot.MATERIALS: ROWS[row]}, {"samples": sample, "inside": inside}
    outputs = (Slot.MOMENTS, Slot.OUTPUT)
    flags = PRINCIPLED_FLAGS if principled else OLD
    return prober.run("bsdf.comp", len(ask), inputs, outputs, {}, flags, last_wo=0, **choices)


@pytest.mark.parametrize(("row", "inside"), CASES)
def test_values_and_samples_are_sound(prober: Prober, row: str, inside: int) -> None:
    rng = np.random.default_rng(5)
    azimuths = np.concatenate([[0, np.pi, 1e-6, np.pi - 1e-6], rng.uniform(0, 2 * np.pi, 60)])
    wi = np.concatenate([_at(e, azimuths) for e in (*ELEVATIONS, 1e-5)])
    wi = np.concatenate([wi, wi * np.float32([1, 1, -1])])
    u = np.concatenate([rng.random((2000, 3)), np.array(np.meshgrid(*[[0, 0.5, 1 - 2**-24]] * 3)).reshape(3, -1).T])
    for elevation in ELEVATIONS:
        wo = _at(elevation, 0.0)
        f, _ = _ask(prober, row, wo, wi, 0, inside)
        assert np.isfinite(f).all() and (f >= 0).all(), (elevation, wi[~np.isfinite(f).all(1)])
        f, directions = _ask(prober, row, wo, u, 1, inside)
        assert np.isfinite(f).all() and (f >= 0).all(), (elevation, u[~np.isfinite(f).all(1)])
        alive = f[:, 3] > 0
        assert np.abs(np.linalg.norm(directions[alive, :3], axis=1) - 1).max(initial=0) < 1e-4
        weight = f[alive, :3].astype(float) / f[alive, 3:]
        assert np.isfinite(weight).all()
        if ROWS[row]["model"][0] == P:  # gains nothing, at no angle; the means of 2000 samples scatter
            mean = weight.sum(0) / len(u)
            error = weight.std(0) / math.sqrt(len(u)) if alive.any() else np.zeros(3)
            assert (mean - 5 * error < 1.003).all(), (elevation, mean, error)


def _formula(m: np.void, wo: np.ndarray, wi: np.ndarray) -> np.ndarray:
    known = {G: baseline.metal_rough, B: baseline.blinn_phong}
    return known[m["model"]](m, wo, wi) if m["model"] in known else disney.bsdf(m, wo, wi, np.array([0.8, 0.6]))


@pytest.mark.parametrize("row", [row for row in ROWS if ROWS[row]["model"][0] != P])
def test_grazing_values_are_the_formula(prober: Prober, row: str) -> None:
    """Within what rounding the directions does to a lobe 1000 times as steep as they are exact."""
    azimuths = np.random.default_rng(6).uniform(0, 2 * np.pi, 200)
    for elevation in ELEVATIONS:
        wo = _at(elevation, 0.3)
        wi = np.concatenate([_at(e, azimuths) for e in ELEVATIONS])
        f, _ = _ask(prober, row, wo, wi, 0, 0)
        wide = wo.astype(float), wi.astype(float)
        expected = _formula(ROWS[row][0], *wide) * wide[1][:, 2:]
        np.testing.assert_allclose(f[:, :3], expected, rtol=2e-3, atol=1e-7)


@pytest.mark.parametrize("alpha", [1e-3, 0.1])
def test_gtr1_keeps_its_digits(prober: Prober, alpha: float) -> None:
    """The coat's lobe near its peak, where z^2 (alpha^2 - 1) + 1 would cancel: 1e-3 to 1 alpha off."""
    row = "disney coat, GTR1 of .001" if alpha == 1e-3 else "disney coat, GTR1 of .1"
    wo = np.array([0, 0, 1], np.float32)
    off = alpha * np.logspace(-3, 0, 50)
    wm = np.stack([off, 0 * off, np.sqrt(1 - off**2)], 1)
    wi = (2 * wm[:, 2:] * wm - wo).astype(np.float32)
    f, _ = _ask(prober, row, wo, wi, 0, 0)
    wide = wo.astype(float), wi.astype(float)
    np.testing.assert_allclose(f[:, :3], _formula(ROWS[row][0], *wide) * wide[1][:, 2:], rtol=1e-5)
