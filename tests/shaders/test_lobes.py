"""Every material model: exact against float64, reciprocal, sampled with the density it claims. A lobe is a row."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gpu import Renderer
from gpu.kernels.features import EDITED
from gpu.layout import MaterialModel
from gpu.layout.bindings import Slot
from tests import baseline, disney, stats
from tests.probing import PRINCIPLED_FLAGS, Prober, materials, prober_of

D, METAL_ROUGH, BLINN_PHONG = MaterialModel.DISNEY, MaterialModel.METAL_ROUGH, MaterialModel.BLINN_PHONG
PHONG = MaterialModel.PHONG
ROWS = {
    "diffuse": materials(model=MaterialModel.DIFFUSE, base_color=(0.8, 0.5, 0.1)),
    "disney default": materials(model=D),
    "retro-reflective": materials(model=D, roughness=1, specular=0, base_color=(0.9, 0.2, 0.4)),
    "subsurface": materials(model=D, subsurface=1, roughness=0.8),
    "sheen": materials(model=D, sheen=1, sheen_tint=1, base_color=(0.1, 0.1, 0.6)),
    "rough metal": materials(model=D, metallic=1, roughness=0.7, base_color=(1, 0.78, 0.34)),
    "smooth metal": materials(model=D, metallic=1, roughness=0.1),
    "mirror": materials(model=D, metallic=1, roughness=0, base_color=0.9),
    "brushed": materials(model=D, metallic=1, roughness=0.4, anisotropic=0.9),
    "tinted": materials(model=D, specular=1, specular_tint=1, base_color=(0.1, 0.7, 0.2), roughness=0.3),
    "clear coat": materials(model=D, clearcoat=1, clearcoat_gloss=1, base_color=(0.4, 0, 0)),
    "hazy coat": materials(model=D, clearcoat=1, clearcoat_gloss=0, metallic=0.5, roughness=0.9),
    "everything": materials(
        model=D, base_color=(0.6, 0.3, 0.2), metallic=0.3, subsurface=0.4, specular=0.8, roughness=0.35,
        specular_tint=0.5, anisotropic=0.6, sheen=0.7, sheen_tint=0.3, clearcoat=0.8, clearcoat_gloss=0.7,
    ),
    "glTF metal": materials(model=METAL_ROUGH, metallic=1, roughness=0.5, base_color=(1, 0.78, 0.34)),
    "glTF mirror": materials(model=METAL_ROUGH, metallic=1, roughness=0, base_color=0.9),
    "glTF dielectric": materials(model=METAL_ROUGH, roughness=0.2, base_color=(0.1, 0.5, 0.9)),
    "glTF rough": materials(model=METAL_ROUGH, roughness=1, base_color=0.8, metallic=0.4),
    "blinn-phong": materials(model=BLINN_PHONG, base_color=(0.4, 0.1, 0.1), phong_specular=0.5, shininess=40),
    "blinn-phong flat": materials(model=BLINN_PHONG, base_color=0, phong_specular=(1, 0.5, 0.2), shininess=0),
    "blinn-phong dull": materials(model=BLINN_PHONG, base_color=0.2, phong_specular=1, shininess=2.5),
    "blinn-phong mirror": materials(model=BLINN_PHONG, base_color=0, phong_specular=1, shininess=1e6),
    "phong": materials(model=PHONG, base_color=(0.4, 0.1, 0.1), phong_specular=0.5, shininess=40),
    "phong flat": materials(model=PHONG, base_color=0.3, phong_specular=(1, 0.5, 0.2), shininess=0),
    "phong dull": materials(model=PHONG, base_color=0.2, phong_specular=1, shininess=2.5),
    "phong mirror": materials(model=PHONG, base_color=0, phong_specular=1, shininess=1e6),
}  # fmt: skip
RECIPROCAL = [name for name, row in ROWS.items() if row["model"][0] not in (BLINN_PHONG, PHONG)]
P = MaterialModel.PRINCIPLED
GLASS = {"model": P, "transmission": 1, "base_color": (1, 0.8, 0.6)}
PRINCIPLED = {
    "plastic": materials(model=P, roughness=0.3),
    "rough plastic": materials(model=P, roughness=1, specular=1, base_color=(0.9, 0.2, 0.1)),
    "principled metal": materials(model=P, metallic=1, roughness=0.7, base_color=(1, 0.78, 0.34)),
    "principled brushed": materials(model=P, metallic=1, roughness=0.4, anisotropic=0.9, anisotropic_rotation=30),
    "flat": materials(model=P, subsurface=1, roughness=0.6),
    "velvet": materials(model=P, sheen=1, sheen_roughness=0.6, base_color=0.1),
    "satin": materials(model=P, sheen=1, sheen_roughness=0, specular=0, sheen_color=(1, 0.2, 0.4)),
    "principled coat": materials(model=P, clearcoat=1, clearcoat_gloss=0, base_color=(0.4, 0, 0)),
    "rough coat": materials(model=P, clearcoat=0.8, clearcoat_roughness=0.4, metallic=0.5, specular_color=(1, 0, 0)),
    "frosted": materials(roughness=0.3, **GLASS),
    "rough glass": materials(roughness=0.8, ior=1.8, **GLASS),
    "brushed glass": materials(roughness=0.5, anisotropic=0.8, **GLASS),
    "all at once": materials(
        model=P, base_color=(0.6, 0.3, 0.2), metallic=0.3, subsurface=0.4, specular=0.8, roughness=0.45,
        specular_tint=0.5, anisotropic=0.6, sheen=0.7, sheen_tint=0.3, clearcoat=0.8, clearcoat_gloss=0.2,
        transmission=0.6,
    ),
}  # fmt: skip
ANGLES = (0.0, 35.0, 70.0, 87.0)
FLAGS = frozenset({"HAS_DISNEY", *EDITED["HAS_DISNEY"], "HAS_METAL_ROUGH", "HAS_BLINN_PHONG", "HAS_PHONG"})
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
    inputs = {Slot.SUM: asks, Slot.MATERIALS: ROWS[row] if row in ROWS else PRINCIPLED[row]}
    flags = FLAGS if row in ROWS else PRINCIPLED_FLAGS
    defines = {"SAMPLE": sample, "INSIDE": inside}
    outputs = (Slot.MOMENTS, Slot.OUTPUT)
    f, wi = prober.run("bsdf.comp", len(ask), inputs, outputs, defines, flags, last_wo=wo.size // 3 - 1)
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


class Grid:
    """Cells over half vectors, in the logarithm of their slope and in azimuth: any lobe is smooth there."""

    SLOPES = np.linspace(math.log(1e-6), math.log(2e3), 81)
    AZIMUTHS = 16
    FINE = 20

    def __init__(self, wo: np.ndarray) -> None:
        self.wo = wo
        n = (len(self.SLOPES) - 1) * self.FINE
        x = self.SLOPES[0] + (np.arange(n) + 0.5) * (self.SLOPES[-1] - self.SLOPES[0]) / n
        phi = (np.arange(self.AZIMUTHS * self.FINE) + 0.5) * 2 * np.pi / (self.AZIMUTHS * self.FINE)
        x, phi = (a.ravel() for a in np.meshgrid(x, phi, indexing="ij"))
        cos = 1 / np.sqrt(1 + np.exp(2 * x))
        sin = cos * np.exp(x)
        wm = np.stack([sin * np.cos(phi), sin * np.sin(phi), cos], 1)
        cos_d = wm @ wo
        self.wi = 2 * cos_d[:, None] * wm - wo
        step = (self.SLOPES[1] - self.SLOPES[0]) / self.FINE * 2 * np.pi / (self.AZIMUTHS * self.FINE)
        # d omega_m = sin dtheta dphi with dtheta = sin cos dx; d omega_i = 4 cos_d d omega_m
        self.solid_angle = np.where((cos_d > 0) & (self.wi[:, 2] > 0), 4 * cos_d * sin * sin * cos * step, 0)

    def sums(self, density: np.ndarray) -> np.ndarray:
        cells = (density * self.solid_angle).reshape(len(self.SLOPES) - 1, self.FINE, self.AZIMUTHS, self.FINE)
        return cells.sum((1, 3))

    def counts(self, wi: np.ndarray) -> np.ndarray:
        wm = wi + self.wo
        wm /= np.linalg.norm(wm, axis=1, keepdims=True)
        x = np.log(np.maximum(np.hypot(wm[:, 0], wm[:, 1]), 1e-12) / wm[:, 2])
        phi = np.arctan2(wm[:, 1], wm[:, 0]) % (2 * np.pi)
        return np.histogram2d(x, phi, [self.SLOPES, np.linspace(0, 2 * np.pi, self.AZIMUTHS + 1)])[0]

    def assert_samples_follow(self, on_grid: np.ndarray, f: np.ndarray, wi: np.ndarray, cases: int) -> None:
        """That samples `wi` (n, 3) with the values `f` (n, 4), rgb and density, follow the density of `on_grid`, by a
        chi-square test among `cases`, and carry the albedo that its values integrate to."""
        n, alive = len(f), f[:, 3] > 0
        observed, expected = self.counts(wi[alive]), self.sums(on_grid[:, 3]) * len(f)
        # Samples below the horizon are lost; quadrature knows their share to about a percent at grazing angles.
        assert observed.sum() == pytest.approx(expected.sum(), abs=0.012 * n)
        p = stats.chi_square(observed, expected * (observed.sum() / expected.sum()))
        assert p > stats.sidak(1e-3, cases), f"chi-square p = {p:.2g}"
        weights = np.where(alive[:, None], f[:, :3] / np.where(alive, f[:, 3], 1)[:, None], 0)
        albedo = np.array([self.sums(on_grid[:, c]).sum() for c in range(3)])
        error = weights.std(0) / math.sqrt(n)
        assert (np.abs(weights.mean(0) - albedo) < 4.5 * error + 2e-3 * albedo + 1e-6).all()


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


def _clear(row: str) -> float:
    return float(PRINCIPLED[row]["transmission"][0])


@pytest.mark.parametrize("inside", [0, 1])
@pytest.mark.parametrize("row", PRINCIPLED)
def test_principled_is_reciprocal(prober: Prober, row: str, inside: int) -> None:
    """f is symmetric; across the surface f of basic radiance over the square of the index on wi's side is."""
    if inside and not _clear(row):
        return
    rng = np.random.default_rng(2)
    m = PRINCIPLED[row][0]
    root = math.sqrt(0.08 * m["specular"])
    eta2 = (float(m["ior"]) if m["ior"] > 0 else (1 + root) / (1 - root)) ** 2
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


@pytest.mark.parametrize(("row", "angle"), [(row, angle) for row in PRINCIPLED for angle in (30.0, 50.0, 70.0)])
def test_principled_samples_follow_their_pdf(prober: Prober, row: str, angle: float) -> None:
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
        assert p > stats.sidak(1e-3, 4 * len(PRINCIPLED)), f"chi-square p = {p:.2g}"
        weights = np.where(alive[:, None], f[:, :3] / np.where(alive, f[:, 3], 1)[:, None], 0)
        albedo, error = cells[..., :3].sum((0, 1)), weights.std(0) / math.sqrt(n)
        assert (np.abs(weights.mean(0) - albedo) < 4.5 * error + 5e-3 * albedo + 1e-6).all()
