"""Every material model: exact against float64, reciprocal, sampled with the density it claims. A lobe is a row."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gpu import Renderer
from gpu.layout.bindings import Slot
from gpu.layout.models import NUMBERS
from tests import baseline, disney, stats
from tests.lobes import BLINN_PHONG, LAYERED, METAL_ROUGH, PHONG, ROWS, D, Grid
from tests.marks import seldom
from tests.probing import DISNEY_FLAGS, OPENPBR_FLAGS, PRINCIPLED_FLAGS, Prober, materials, prober_of, rare

RECIPROCAL = [name for name, row in ROWS.items() if row["model"][0] not in (BLINN_PHONG, PHONG)]
ANGLES = (0.0, 35.0, 70.0, 87.0)
FLAGS = DISNEY_FLAGS | {"HAS_METAL_ROUGH", "HAS_BLINN_PHONG", "HAS_PHONG"}
TANGENT = np.array([0.8, 0.6])
CASES = [(name, angle) for name in ROWS for angle in ANGLES]


@pytest.fixture(scope="module")
def prober(gpu: Renderer) -> Prober:
    return prober_of(gpu)


def _wo(angle: float) -> np.ndarray:
    t = math.radians(angle)
    return np.array([math.sin(t) * 0.6, math.sin(t) * -0.8, math.cos(t)])


def _ask(
    prober: Prober, row: str, wo: np.ndarray, ask: np.ndarray, sample: int, inside: int
) -> tuple[np.ndarray, np.ndarray]:
    asks = np.zeros((len(ask) + wo.size // 3, 4), np.float32)
    asks[:, :3] = np.concatenate([ask, wo.reshape(-1, 3)])
    record = ROWS[row] if row in ROWS else LAYERED[row]
    inputs = {Slot.SUM: asks, Slot.MATERIALS: record}
    is_openpbr = record["model"][0] == NUMBERS["openpbr"]
    flags = FLAGS if row in ROWS else OPENPBR_FLAGS if is_openpbr else PRINCIPLED_FLAGS
    flags |= rare(record)
    choices = {"samples": sample, "inside": inside, "last_wo": wo.size // 3 - 1}
    f, wi = prober.run("bsdf.comp", len(ask), inputs, (Slot.MOMENTS, Slot.OUTPUT), {}, flags, **choices)
    return f.astype(float), wi.astype(float)


def _eval(prober: Prober, row: str, wo: np.ndarray, wi: np.ndarray, inside: int = 0) -> np.ndarray:
    """(n, 4), f and its pdf, of wi (n, 3) and one wo (3,) or as many."""
    return _ask(prober, row, wo, wi, 0, inside)[0]


def _sample(
    prober: Prober, row: str, wo: np.ndarray, u: np.ndarray, inside: int = 0
) -> tuple[np.ndarray, np.ndarray]:
    f, wi = _ask(prober, row, wo, u, 1, inside)
    return f, wi[:, :3]


def _hemisphere(rng: np.random.Generator, n: int) -> np.ndarray:
    z, phi = rng.uniform(0.01, 1, n), rng.uniform(0, 2 * np.pi, n)
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], 1)


def _formula(material: np.void, wo: np.ndarray, wi: np.ndarray) -> np.ndarray:
    formulas = {METAL_ROUGH: baseline.metal_rough, BLINN_PHONG: baseline.blinn_phong, PHONG: baseline.phong}
    if material["model"] in formulas:
        return formulas[material["model"]](material, wo, wi)
    return disney.bsdf(material, wo, wi, TANGENT)


@pytest.mark.parametrize("row", ROWS)
def test_value_is_the_formula(prober: Prober, row: str) -> None:
    rng = np.random.default_rng(1)
    for angle in ANGLES:
        wo, wi = _wo(angle).astype(np.float32).astype(float), _hemisphere(rng, 4000).astype(np.float32).astype(float)
        mirrored = wo * [-1, -1, 1] + 1e-3 * rng.normal(size=(400, 3))  # where narrow lobes are
        wi = np.concatenate([wi, mirrored / np.linalg.norm(mirrored, axis=1, keepdims=True)])
        wi = wi[wi[:, 2] > 0.005].astype(np.float32).astype(float)
        expected = _formula(ROWS[row][0], wo, wi) * wi[:, 2:]
        # Directions are rounded to 2^-24 and a lobe of alpha .001 moves 1000 times as fast.
        np.testing.assert_allclose(_eval(prober, row, wo, wi)[:, :3], expected, rtol=2e-3, atol=1e-6)


@pytest.mark.parametrize("row", RECIPROCAL)
def test_reciprocal(prober: Prober, row: str) -> None:
    rng = np.random.default_rng(2)
    for wo in _hemisphere(rng, 6):
        wi = _hemisphere(rng, 64)
        there = _eval(prober, row, wo, wi)[:, :3] / wi[:, 2:]
        back = _eval(prober, row, wi, np.broadcast_to(wo, wi.shape))[:, :3] / wo[2]
        np.testing.assert_allclose(there, back, rtol=2e-3, atol=1e-6)


@pytest.mark.parametrize(("row", "angle"), CASES)
def test_samples_follow_their_pdf_and_carry_the_albedo(prober: Prober, row: str, angle: float) -> None:
    rng = np.random.default_rng(3)
    wo = _wo(angle)
    grid = Grid(wo)
    on_grid = _eval(prober, row, wo, np.where(grid.solid_angle[:, None] > 0, grid.wi, [0, 0, 1]))
    f, wi = _sample(prober, row, wo, rng.random((60_000, 3)))
    grid.assert_samples_follow(on_grid, f, wi, len(CASES))


def test_a_wrong_pdf_is_seen(prober: Prober) -> None:
    """The chi-square test above fails when alpha^2 is off by 10 %: samples of one roughness, density of another."""
    wo = _wo(35)
    grid, n = Grid(wo), 240_000
    ROWS["off"] = materials(model=D, metallic=1, roughness=0.7 * 1.1**0.25, base_color=(1, 0.78, 0.34))
    try:
        on_grid = _eval(prober, "off", wo, np.where(grid.solid_angle[:, None] > 0, grid.wi, [0, 0, 1]))
    finally:
        del ROWS["off"]
    f, wi = _sample(prober, "rough metal", wo, np.random.default_rng(3).random((n, 3)))
    observed, expected = grid.counts(wi[f[:, 3] > 0]), grid.sums(on_grid[:, 3]) * n
    p = stats.chi_square(observed, expected * (observed.sum() / expected.sum()))
    assert p < 1e-6


def _clear(row: str) -> bool:
    """Whether light goes through."""
    return bool(max(LAYERED[row][name][0] for name in ("transmission", "diffuse_transmission")) > 0)


def _keyed(material: np.void) -> bool:
    """Whether a layer of `openpbr` lies over the base: it leaves to the base what it does not reflect of wo alone."""
    return bool(material["model"] == NUMBERS["openpbr"] and (material["clearcoat"] > 0 or material["sheen"] > 0))


@pytest.mark.parametrize("inside", [0, 1])
@pytest.mark.parametrize("row", [name for name, m in LAYERED.items() if not _keyed(m[0])])
def test_layered_models_are_reciprocal(prober: Prober, row: str, inside: int) -> None:
    """f is symmetric; across the surface f of basic radiance over the square of the index on wi's side is."""
    if inside and not _clear(row):
        return
    rng = np.random.default_rng(2)
    m = LAYERED[row][0]
    root = math.sqrt(0.08 * m["specular"])
    eta2 = (float(m["ior"]) if m["ior"] > 0 else (1 + root) / (1 - root)) ** 2
    if m["thin_walled"]:
        eta2 = 1.0
    for wo in _hemisphere(rng, 5):
        wi = _hemisphere(rng, 48)
        there = _eval(prober, row, wo, wi, inside)[:, :3] / wi[:, 2:]
        back = _eval(prober, row, wi, np.broadcast_to(wo, wi.shape), inside)[:, :3] / wo[2]
        np.testing.assert_allclose(there, back, rtol=3e-3, atol=1e-6)
        if _clear(row):
            under = wi * [1, 1, -1]
            there = _eval(prober, row, wo, under, inside)[:, :3] / wi[:, 2:] / (1 if inside else eta2)
            # From the other side, whose frame is turned about x: y and z change sign.
            turned, source = under * [1, 1, -1], wo * [1, 1, -1]
            back = _eval(prober, row, turned, np.broadcast_to(source, wi.shape), 1 - inside)[:, :3] / wo[2]
            back = back / (eta2 if inside else 1)
            assert there.max() > 0
            np.testing.assert_allclose(there, back, rtol=3e-3, atol=1e-6)


@pytest.mark.parametrize("row", LAYERED)
@pytest.mark.parametrize("angle", seldom([30.0, 50.0, 70.0], [30.0, 50.0]))
def test_layered_samples_follow_their_pdf(prober: Prober, row: str, angle: float) -> None:
    """Over the whole sphere in cells of cosine and azimuth, from outside and from inside."""
    rng = np.random.default_rng(4)
    n, rows, columns, fine = 60_000, 20, 20, 32
    wo = _wo(angle)
    z = (np.arange(rows * fine) + 0.5) / (rows * fine) * 2 - 1
    phi = (np.arange(columns * fine) + 0.5) / (columns * fine) * 2 * np.pi
    zz, pp = (a.ravel() for a in np.meshgrid(z, phi, indexing="ij"))
    r = np.sqrt(1 - zz * zz)
    grid = np.stack([r * np.cos(pp), r * np.sin(pp), zz], 1)
    for inside in (0, 1) if _clear(row) else (0,):
        on_grid = _eval(prober, row, wo, grid, inside)
        cells = on_grid.reshape(rows, fine, columns, fine, 4).sum((1, 3)) * (4 * np.pi / len(grid))
        f, wi = _sample(prober, row, wo, rng.random((n, 3)), inside)
        alive = f[:, 3] > 0
        edges = [np.linspace(-1, 1, rows + 1), np.linspace(0, 2 * np.pi, columns + 1)]
        at = np.arctan2(wi[alive, 1], wi[alive, 0]) % (2 * np.pi)
        observed = np.histogram2d(wi[alive, 2], at, edges)[0]
        expected = cells[..., 3] * n
        assert observed.sum() == pytest.approx(expected.sum(), abs=0.012 * n)
        p = stats.chi_square(observed, expected * (observed.sum() / expected.sum()), 25.0)
        assert p > stats.sidak(1e-3, 4 * len(LAYERED)), f"chi-square p = {p:.2g}"
        weights = np.where(alive[:, None], f[:, :3] / np.where(alive, f[:, 3], 1)[:, None], 0)
        albedo, error = cells[..., :3].sum((0, 1)), weights.std(0) / math.sqrt(n)
        assert (np.abs(weights.mean(0) - albedo) < 4.5 * error + 5e-3 * albedo + 1e-6).all()
