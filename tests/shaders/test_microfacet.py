"""`microfacet`: each of its terms against float64, normalised, reciprocal, and sampled with the density it claims."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy import integrate

from gpu import Renderer
from gpu.kernels.flag_table import FLAGS
from gpu.layout.bindings import Slot
from gpu.layout.microfacet_records import PLAIN, Distribution
from gpu.tables import microfacet as tables
from service.document import parse_scene
from service.document.material.microfacet import ALPHA_RANGES, GAMMA_RANGES
from service.pack import pack_materials, pack_microfacets
from tests import microfacets, stats
from tests.families import EXACT
from tests.lobes import Grid
from tests.probing import Prober, prober_of

Doc = dict[str, Any]
DEFAULTS: Doc = {"distribution": "ggx", "alpha": 0.25, "gamma": 2.0, "geometry": "smith", "fresnel": "schlick",
                 "f0": 0.04, "ior": 1.5, "diffuse": 0.0, "diffuse_model": "lambert",
                 "diffuse_roughness": 0.0}  # fmt: skip
GOLD = {"fresnel": "conductor", "conductor_eta": [0.18, 0.42, 1.37], "conductor_k": [3.42, 2.35, 1.77]}
# (distribution, alpha, gamma): the ends of the ranges, the limits of the formulas and what lies beside them.
SHAPES = [
    *[("phong", a, 2.0) for a in (0.0, 1.0, 40.0, 1e4, 1e6)],
    *[(name, a, 2.0) for name in ("beckmann", "ggx") for a in (0.001, 0.1, 1.0, 10.0)],
    *[("gtr", a, g) for a in (0.001, 0.1, 1.0, 10.0) for g in (0.1, 1.0, 1.000001, 2.0, 10.0)],
    ("gtr", 0.999999, 3.0),
    *[("abc", a, g) for a in (1e-3, 10.0, 1e6) for g in (0.0, 1.0, 1.000001, 2.0, 1000.0)],
    *[("sgd", a, g) for a in (0.01, 0.3, 1.0, 2.0) for g in (0.0, 0.5, 1.0, 1.5, 2.0)],
    *[("gaussian", a, 2.0) for a in (0.01, 0.1, 0.5, 2.0)],
]
PLAIN_FLAGS = {f"HAS_MICROFACET_{kind.upper()}_{term.name}" for kind, term in PLAIN.items()}
MICROFACET_FLAGS = frozenset(name for name in FLAGS if name.startswith("HAS_MICROFACET"))
ANGLES = (0.0, 45.0, 75.0, 89.9)
LOWEST = math.cos(math.radians(89.9))


@pytest.fixture(scope="module")
def prober(gpu: Renderer) -> Prober:
    return prober_of(gpu)


def material(**terms: Any) -> Doc:
    return {**DEFAULTS, **terms}


def shaped(shape: tuple[str, float, float], **terms: Any) -> Doc:
    return material(distribution=shape[0], alpha=shape[1], gamma=shape[2], **terms)


def ask(prober: Prober, m: Doc, wo: np.ndarray, asks: np.ndarray, sample: int = 0) -> list[np.ndarray]:
    """(n, 4), f with its cosine and the pdf, and the directions; of wi, or of (u_lobe, u, u) with `sample`."""
    camera = {"position": [0, 0, 1], "target": [0, 0, 0]}
    scene = parse_scene(
        {"version": 1, "camera": camera, "materials": {"m": {"type": "microfacet", **m}}, "shapes": []}
    )
    kinds = ("distribution", "geometry", "fresnel", "diffuse_model")
    raised = {"HAS_MICROFACET", *(f"HAS_MICROFACET_{kind}_{m[kind]}".upper() for kind in kinds)} - PLAIN_FLAGS
    words = pack_microfacets(scene)
    if len(words) > 5:
        raised.add("HAS_MICROFACET_TABLES")
    assert raised <= set(FLAGS)
    given = np.zeros((len(asks) + wo.size // 3, 4), np.float32)
    given[:, :3] = np.concatenate([asks, wo.reshape(-1, 3)])
    inputs = {Slot.SUM: given, Slot.MATERIALS: pack_materials(scene)}
    outputs = (Slot.MOMENTS, Slot.OUTPUT)
    choices = {"samples": sample, "inside": 0, "last_wo": wo.size // 3 - 1}
    flags = frozenset(raised) if EXACT else MICROFACET_FLAGS
    out = prober.run("bsdf.comp", len(asks), inputs, outputs, {}, flags, microfacets=words, **choices)
    return [each.astype(float) for each in out]


def at(degrees: float, azimuth: float = 0.7) -> np.ndarray:
    """A direction as float32 has it."""
    t = math.radians(degrees)
    w = np.array([math.sin(t) * math.cos(azimuth), math.sin(t) * math.sin(azimuth), math.cos(t)])
    return w.astype(np.float32).astype(float)


def about(wo: np.ndarray, slopes: np.ndarray, seed: int = 1) -> np.ndarray:
    """(n, 3) directions, rounded to float32, that facets of these slopes reflect wo to; at most 89.9 degrees from the
    normal."""
    phi = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(slopes))
    h = np.stack([slopes * np.cos(phi), slopes * np.sin(phi), np.ones_like(slopes)], 1)
    h /= np.linalg.norm(h, axis=1, keepdims=True)
    wi = (2 * (h @ wo)[:, None] * h - wo).astype(np.float32).astype(float)
    return wi[(wi[:, 2] >= LOWEST) & (h @ wo > 0)]


SLOPES = np.geomspace(1e-6, 1e3, 1500)


def relative_error(found: np.ndarray, expected: np.ndarray, least: float) -> float:
    """The worst, where `expected` is above a share `least` of its largest value."""
    seen = expected > least * expected.max()
    assert seen.any() and np.isfinite(found).all()
    return float(np.abs(found[seen] / expected[seen] - 1).max())


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_distributions_are_their_formulas(prober: Prober, shape: tuple[str, float, float]) -> None:
    """Within 1e-3 wherever single precision has the value: D / 4 is what `implicit` and `none` leave."""
    m = shaped(shape, geometry="implicit", fresnel="none")
    for angle in ANGLES:
        wo = at(angle)
        wi = about(wo, SLOPES)
        found = ask(prober, m, wo, wi)[0][:, 0]
        expected = microfacets.bsdf(m, wo, wi)[:, 0] * wi[:, 2]
        assert relative_error(found, expected, 1e-25) < 1e-3


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_distributions_are_normalised(shape: tuple[str, float, float]) -> None:
    """The integral of D cos over the hemisphere is 1: of the formulas above, and of the factors that are packed."""
    name, alpha, gamma = shape
    kind = Distribution[name.upper()]

    def ring(x: float) -> float:
        density = float(microfacets.d(name, alpha, gamma, math.exp(x)))
        return 2 * math.pi * density * (2 * math.cosh(x)) ** -2

    whole = sum(integrate.quad(ring, x, x + 1, epsabs=1e-13)[0] for x in range(-32, 24))
    assert whole == pytest.approx(1, abs=1e-6)
    if kind not in tables.CLOSED_FACTOR:
        x = np.linspace(-9, 3, 50)
        packed = tables.log_factor(kind, alpha, gamma) + tables.log_shape(kind, x, alpha, gamma)
        with np.errstate(divide="ignore"):
            expected = np.log(microfacets.d(name, alpha, gamma, np.exp(x)))
        seen = expected > -500
        np.testing.assert_allclose(packed[seen], expected[seen], atol=1e-5)


GEOMETRIES = ("implicit", "neumann", "cook_torrance", "kelemen", "smith", "smith_correlated")


@pytest.mark.parametrize("geometry", (*GEOMETRIES, "schlick_ggx"))
@pytest.mark.parametrize(
    "shape", [("ggx", 0.001, 2.0), ("ggx", 0.5, 2.0), ("beckmann", 0.3, 2.0), ("gtr", 10.0, 3.0)]
)
def test_geometry_terms_are_their_formulas(prober: Prober, geometry: str, shape: tuple[str, float, float]) -> None:
    m = shaped(shape, geometry=geometry, fresnel="none")
    for angle in ANGLES:
        wo = at(angle)
        wi = about(wo, SLOPES[::20])
        found = ask(prober, m, wo, wi)[0][:, 0]
        expected = microfacets.bsdf(m, wo, wi)[:, 0] * wi[:, 2]
        assert relative_error(found, expected, 1e-25) < 1e-3


@pytest.mark.parametrize("shape", [s for s in SHAPES if s[0] not in ("ggx", "beckmann")], ids=str)
def test_smith_is_the_integral(prober: Prober, shape: tuple[str, float, float]) -> None:
    """G1 within 1e-3 and 1 % of the value from 0 to 89.9 degrees, of all distributions that have a table."""
    wi = np.array([at(t) for t in (*np.linspace(0, 85, 18), *(90 - np.geomspace(5, 0.1, 12)))])
    m, bare = shaped(shape, fresnel="none"), shaped(shape, geometry="implicit", fresnel="none")
    # The half vector is the normal: f is G1^2 D(0) / (4 cos^2), and D(0) / 4 with `implicit`.
    wo = wi * [-1, -1, 1]
    ratio = ask(prober, m, wo, wi)[0][:, 0] / ask(prober, bare, wo, wi)[0][:, 0]
    found = np.sqrt(ratio) * wi[:, 2]
    expected = np.array([microfacets.g1(*shape, float(w[2]), math.hypot(w[0], w[1])) for w in wi])
    difference = np.abs(found - expected)
    assert difference.max() < 1e-3 and (difference / expected).max() < 0.01


TERMS = [
    ("none", {}),
    *[(name, {"f0": f0}) for name in ("schlick", "cook_torrance") for f0 in ([0, 0.04, 0.5], [0.999, 1, 1e-6])],
    *[("dielectric", {"ior": ior}) for ior in (1.0, 1.01, 1.5, 4.0)],
    ("conductor", GOLD),
    ("conductor", {"conductor_eta": [1e-3, 1, 50], "conductor_k": [0, 1e-3, 100]}),
    ("conductor", {"conductor_eta": [0.5, 1.5, 1], "conductor_k": [0, 0, 9]}),
]


@pytest.mark.parametrize(("fresnel", "more"), TERMS, ids=str)
def test_fresnel_terms_are_their_formulas(prober: Prober, fresnel: str, more: Doc) -> None:
    m = material(distribution="phong", alpha=0.0, geometry="implicit", **{**more, "fresnel": fresnel})
    wi = np.array([at(t) for t in (*np.linspace(0, 85, 40), *(90 - np.geomspace(5, 0.1, 20)))])
    wo = wi * [-1, -1, 1]  # so that the half vector is the normal, and the facet's cosine that of both
    found = ask(prober, m, wo, wi)[0][:, :3]
    expected = microfacets.bsdf(m, wo, wi) * wi[:, 2:]
    np.testing.assert_allclose(found, expected, rtol=1e-3, atol=1e-9)


DIFFUSE = [("lambert", 0.0), *[(name, r) for name in ("oren_nayar", "disney", "eon") for r in (0.0, 0.01, 0.4, 1.0)]]


@pytest.mark.parametrize(("model", "roughness"), DIFFUSE)
def test_diffuse_models_are_their_formulas(prober: Prober, model: str, roughness: float) -> None:
    m = material(diffuse=[1.0, 0.5, 0.02], diffuse_model=model, diffuse_roughness=roughness, geometry="implicit",
                 distribution="gaussian", alpha=0.01, f0=0.0)  # fmt: skip
    for angle in ANGLES:
        wo = at(angle)
        wi = about(wo, np.geomspace(0.2, 1e3, 800))  # beyond the highlight
        found = ask(prober, m, wo, wi)[0][:, :3]
        expected = microfacets.bsdf(m, wo, wi) * wi[:, 2:]
        np.testing.assert_allclose(found, expected, rtol=1e-3, atol=1e-7)


ROWS = {
    "default": material(),
    "wide ggx": material(alpha=10.0, geometry="smith_correlated", diffuse=0.3),
    "narrow ggx": material(alpha=0.001, geometry="schlick_ggx"),
    "beckmann": material(distribution="beckmann", alpha=0.4, diffuse=[0.5, 0.1, 0.1], diffuse_model="eon",
                         diffuse_roughness=0.7),
    "wide beckmann": material(distribution="beckmann", alpha=3.0, geometry="cook_torrance", **GOLD),
    "phong": material(distribution="phong", alpha=30.0, geometry="smith_correlated", fresnel="cook_torrance", f0=0.5),
    "flat phong": material(distribution="phong", alpha=0.0, geometry="implicit", fresnel="none"),
    "sharp phong": material(distribution="phong", alpha=1e6, geometry="neumann", fresnel="none"),
    "gtr": material(distribution="gtr", alpha=0.2, gamma=1.3, fresnel="dielectric"),
    "gtr 1": material(distribution="gtr", alpha=0.01, gamma=1.0, geometry="kelemen"),
    "steep gtr": material(distribution="gtr", alpha=10.0, gamma=10.0),
    "flat gtr": material(distribution="gtr", alpha=1.0, gamma=0.1, geometry="schlick_ggx"),
    "abc": material(distribution="abc", alpha=200.0, gamma=1.2, diffuse=0.5, diffuse_model="oren_nayar",
                    diffuse_roughness=0.5),
    "abc 1": material(distribution="abc", alpha=1e3, gamma=1.0, geometry="cook_torrance"),
    "sharp abc": material(distribution="abc", alpha=1e6, gamma=1000.0, geometry="implicit"),
    "sgd": material(distribution="sgd", alpha=0.15, gamma=0.6),
    "long sgd": material(distribution="sgd", alpha=0.01, gamma=1.0),
    "wide sgd": material(distribution="sgd", alpha=2.0, gamma=2.0, geometry="smith_correlated"),
    "gaussian": material(distribution="gaussian", alpha=0.3, diffuse=0.2, diffuse_model="disney",
                         diffuse_roughness=1.0),
    "wide gaussian": material(distribution="gaussian", alpha=2.0, geometry="neumann"),
}  # fmt: skip
CASES = [(name, angle) for name in ROWS for angle in (0.0, 35.0, 70.0, 87.0)]


@pytest.mark.parametrize("row", ROWS)
def test_values_are_the_formula_and_reciprocal(prober: Prober, row: str) -> None:
    m = ROWS[row]
    for angle in ANGLES:
        wo = at(angle)
        wi = about(wo, SLOPES[::30])
        found = ask(prober, m, wo, wi)[0][:, :3]
        expected = microfacets.bsdf(m, wo, wi) * wi[:, 2:]
        np.testing.assert_allclose(found, expected, rtol=1e-3, atol=1e-9)
        back = ask(prober, m, wi, np.broadcast_to(wo, wi.shape))[0][:, :3] / wo[2]
        np.testing.assert_allclose(found / wi[:, 2:], back, rtol=1e-4, atol=1e-9)


@pytest.mark.parametrize(("row", "angle"), CASES)
def test_samples_follow_their_pdf_and_carry_the_albedo(prober: Prober, row: str, angle: float) -> None:
    rng = np.random.default_rng(3)
    m, wo = ROWS[row], at(angle)
    grid = Grid(wo)
    on_grid = ask(prober, m, wo, np.where(grid.solid_angle[:, None] > 0, grid.wi, [0, 0, 1]))[0]
    f, wi = ask(prober, m, wo, rng.random((60_000, 3)), sample=1)
    grid.assert_samples_follow(on_grid, f, wi[:, :3], len(CASES))


@pytest.mark.parametrize("angle", [5.0, 35.0])
@pytest.mark.parametrize("diffuse", [0.0, 0.9])
@pytest.mark.parametrize(
    "shape", [("abc", 300.0, 1.5), ("sgd", 0.15, 0.6), ("gaussian", 0.3, 2.0)], ids=lambda s: s[0]
)
def test_a_density_lacks_what_is_sampled_below_the_horizon(
    prober: Prober, shape: tuple[str, float, float], diffuse: float, angle: float
) -> None:
    """Its integral over all wi is the share of samples that leave the surface. Where D cos has no inverse another
    density is sampled, of which more may fall below: by `abc` twice as much as by D cos here."""
    m, wo = shaped(shape, diffuse=diffuse), at(angle)
    edges = np.linspace(0, 1, 801) ** 2 * np.pi / 2  # of wm: wi is the mirrored wo, d wi = 4 (wo.wm) d wm
    theta, phi = np.meshgrid((edges[1:] + edges[:-1]) / 2, (np.arange(240) + 0.5) * (2 * np.pi / 240), indexing="ij")
    wm = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1).reshape(-1, 3)
    cos_d = wm @ wo
    wi = 2 * cos_d[:, None] * wm - wo
    up = (cos_d > 0) & (wi[:, 2] > 0)
    size = 4 * cos_d * (np.sin(theta) * np.diff(edges)[:, None]).ravel() * (2 * np.pi / 240)
    whole = float((ask(prober, m, wo, wi[up])[0][:, 3] * size[up]).sum())
    n = 100_000
    f, _ = ask(prober, m, wo, np.random.default_rng(5).random((n, 3)), sample=1)
    alive = float((f[:, 3] > 0).mean())
    assert whole == pytest.approx(alive, abs=4.5 * math.sqrt(alive * (1 - alive) / n) + 3e-4)
    if shape[0] == "abc" and not diffuse:
        d = (1 + 300 * (1 - np.cos(theta).ravel())) ** -1.5 * size / (4 * np.where(cos_d == 0, 1, cos_d))
        lost = d[~up].sum() / d.sum(), (d * wm[:, 2])[~up].sum() / (d * wm[:, 2]).sum()
        assert whole == pytest.approx(1 - lost[0], abs=1e-3) and lost[0] > 1.7 * lost[1]


def test_a_wrong_pdf_is_seen(prober: Prober) -> None:
    """The chi-square test above fails when gamma is off by 0.1: samples of one shape, density of another."""
    wo, n = at(35), 60_000
    grid = Grid(wo)
    off = {**ROWS["gtr"], "gamma": 1.4}
    on_grid = ask(prober, off, wo, np.where(grid.solid_angle[:, None] > 0, grid.wi, [0, 0, 1]))[0]
    f, wi = ask(prober, ROWS["gtr"], wo, np.random.default_rng(3).random((n, 3)), sample=1)
    observed, expected = grid.counts(wi[f[:, 3] > 0, :3]), grid.sums(on_grid[:, 3]) * n
    assert stats.chi_square(observed, expected * (observed.sum() / expected.sum())) < 1e-6


@pytest.mark.parametrize("name", [name for name in ALPHA_RANGES if name not in ("ggx", "beckmann")])
@pytest.mark.parametrize("end", [0, 1])
def test_tables_for_textures_know_every_alpha(name: str, end: int) -> None:
    """Between the rows of a table, factor and G1 are within 1e-3, and G1 within 1 % of the value."""
    kind, gamma = Distribution[name.upper()], GAMMA_RANGES.get(name, (2.0, 2.0))[end]
    low, high = ALPHA_RANGES[name]
    alphas = tables.row_alphas(kind, low, high)
    assert (alphas[0], alphas[-1]) == pytest.approx((low, high), rel=1e-9)
    theta = np.radians([*np.linspace(0, 80, 20), *(90 - np.geomspace(10, 0.1, 10))])
    sin, cos = np.sin(theta), np.cos(theta)
    offset = tables.ROW_OFFSETS.get(kind, 0.0)
    for k in range(0, len(alphas) - 1, 9):
        between = math.sqrt((alphas[k] + offset) * (alphas[k + 1] + offset)) - offset
        factors = [tables.log_factor(kind, alpha, gamma) for alpha in (between, alphas[k], alphas[k + 1])]
        areas = [tables.seen_area(kind, alpha, gamma, sin, cos) for alpha in (between, alphas[k], alphas[k + 1])]
        if kind not in tables.CLOSED_FACTOR:
            assert math.expm1(0.5 * (factors[1] + factors[2]) - factors[0]) == pytest.approx(0, abs=1e-3)
        g1, read = cos / areas[0], cos / (0.5 * (areas[1] + areas[2]))
        assert np.abs(read - g1).max() < 1e-3 and np.abs(read / g1 - 1).max() < 0.01


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_extremes_are_finite(prober: Prober, shape: tuple[str, float, float]) -> None:
    """Values and samples, from straight above to 0.001 degrees off the surface, with random numbers at their ends."""
    rng = np.random.default_rng(5)
    ends = np.array(np.meshgrid(*[[0, 0.5, 1 - 2**-24]] * 3)).reshape(3, -1).T
    u = np.concatenate([rng.random((500, 3)), ends])
    for geometry in ("smith_correlated", "kelemen"):
        m = shaped(shape, geometry=geometry, **GOLD)
        for angle in (0.0, 45.0, 89.9, 89.999):
            wo = at(angle)
            wi = np.array([at(t, a) for t in (0, 45, 89, 89.999) for a in (0.7, 0.7 + np.pi, 2.0)])
            f = ask(prober, m, wo, wi)[0]
            assert np.isfinite(f).all() and (f >= 0).all()
            f, directions = ask(prober, m, wo, u, sample=1)
            assert np.isfinite(f).all() and (f >= 0).all()
            alive = f[:, 3] > 0
            assert np.abs(np.linalg.norm(directions[alive, :3], axis=1) - 1).max(initial=0) < 1e-4


def test_every_distribution_is_tried_at_the_ends_of_its_ranges() -> None:
    for name, bounds in ALPHA_RANGES.items():
        tried = [shape for shape in SHAPES if shape[0] == name]
        assert {*bounds} <= {alpha for _, alpha, _ in tried}
        assert {*GAMMA_RANGES.get(name, ())} <= {gamma for *_, gamma in tried}
