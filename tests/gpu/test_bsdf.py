"""A material's BSDF as numbers: equal to the formulas in double precision, and consistent with itself."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gpu import BsdfAlbedo, BsdfTerms, BsdfValues, Renderer, SceneArrays, Steps
from gpu.bsdf import kernels
from gpu.layout import models
from gpu.layout.models import NUMBERS
from gpu.precompile import kernel_keys
from service.document.material.microfacet import MicrofacetMaterial
from service.pack import pack_material
from tests import baseline, disney, microfacets
from tests.lobes import LAYERED, OPENPBR, PRINCIPLED, ROWS
from tests.marks import seldom
from tests.probing import materials

P = NUMBERS["principled"]
GLASS = {"model": P, "transmission": 1, "base_color": (1, 0.8, 0.6)}
SPECULAR = {
    "varnish": materials(model=P, roughness=0, base_color=(0.8, 0.2, 0.1)),
    "varnished metal": materials(model=P, metallic=1, roughness=0.4, clearcoat=1, clearcoat_roughness=0),
    "mirror with a mirror on top": materials(
        model=P, metallic=1, roughness=0, base_color=(1, 0.8, 0.3), clearcoat=0.7, clearcoat_roughness=0
    ),
    "half clear": materials(model=P, transmission=0.5, roughness=0, base_color=(0.9, 0.5, 0.2), ior=1.5),
}
ALL = ROWS | PRINCIPLED | SPECULAR
# Lobes that the cells of the quadrature are too wide for.
NARROW = {
    "mirror",
    "smooth metal",
    "clear coat",
    "glTF mirror",
    "glTF dielectric",
    "blinn-phong mirror",
    "phong mirror",
}
ANGLES = (10.0, 50.0, 80.0)


def lone(material: np.ndarray) -> SceneArrays:
    return SceneArrays(kernels.NOWHERE, material)


def values(gpu: Renderer, material: np.ndarray, wo: Any, wi: Any) -> BsdfValues:
    return Steps(gpu.bsdf.values(lone(material), np.atleast_2d(wo), np.atleast_2d(wi))).finish()


def albedo(gpu: Renderer, material: np.ndarray, wo: Any, samples: int) -> BsdfAlbedo:
    return Steps(gpu.bsdf.albedo(lone(material), np.atleast_2d(wo), samples)).finish()


def terms(gpu: Renderer, material: np.ndarray, degrees: np.ndarray, view: float = 45) -> BsdfTerms:
    w = np.array([direction(angle) for angle in degrees])
    return Steps(gpu.bsdf.terms(lone(material), direction(view)[None], w)).finish()


def direction(degrees: float) -> np.ndarray:
    t = math.radians(degrees)
    return np.array([math.sin(t), 0.0, math.cos(t)])


def sphere(rng: np.random.Generator, count: int) -> np.ndarray:
    v = rng.normal(size=(count, 3))
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    return np.asarray(v[np.abs(v[:, 2]) > 0.01])


def quadrature(rows: int = 256, columns: int = 256) -> tuple[np.ndarray, np.ndarray]:
    """Directions (n, 3) over the sphere, in cells of equal angles, and the solid angle of each (n,)."""
    theta = (np.arange(rows) + 0.5) / rows * np.pi
    phi = (np.arange(columns) + 0.5) / columns * 2 * np.pi
    t, p = (a.ravel() for a in np.meshgrid(theta, phi, indexing="ij"))
    # The integral of sin over a row of this height, not its value in the middle.
    step = np.sin(t) * 2 * math.sin(np.pi / rows / 2) * 2 * np.pi / columns
    return np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], 1), step


def fresnel(c: float, eta: float) -> tuple[float, float]:
    """Reflectance of the two polarisations' mean, and the cosine of the refracted ray (0: none), by Fresnel."""
    sin2 = (1 - c * c) / eta**2
    if sin2 >= 1:
        return 1.0, 0.0
    t = math.sqrt(1 - sin2)
    return (((c - eta * t) / (c + eta * t)) ** 2 + ((eta * c - t) / (eta * c + t)) ** 2) / 2, t


@pytest.mark.parametrize("row", ROWS)
def test_values_are_the_formulas(gpu: Renderer, row: str) -> None:
    material = ROWS[row]
    wi = sphere(np.random.default_rng(1), 2000).astype(np.float32).astype(float)
    above = wi[:, 2] > 0
    formulas = {NUMBERS["metal_rough"]: baseline.metal_rough, NUMBERS["blinn_phong"]: baseline.blinn_phong}
    formulas[NUMBERS["phong"]] = baseline.phong
    for angle in ANGLES:
        wo = direction(angle).astype(np.float32).astype(float)
        found = values(gpu, material, wo, wi)
        formula = formulas.get(material[0]["model"], lambda *args: disney.bsdf(*args, np.array([1.0, 0.0])))
        np.testing.assert_allclose(found.f[0, above], formula(material[0], wo, wi[above]), rtol=2e-3, atol=1e-6)
        assert not found.f[0, ~above].any() and not found.pdf[0, ~above].any()


LAB_PLASTIC = {"diffuse": [0.7, 0.4, 0.1], "diffuse_model": "oren_nayar", "diffuse_roughness": 0.5}


@pytest.mark.llvmpipe
@pytest.mark.parametrize("row", seldom([*ALL, "microfacet"], ["iridescent glass"]))
def test_lobes_add_up_to_the_values(gpu: Renderer, row: str) -> None:
    if row == "microfacet":
        packed = pack_material(MicrofacetMaterial(type="microfacet", alpha=0.3, **LAB_PLASTIC))
    else:
        packed = lone(ALL[row])
    model = models.BY_NUMBER[int(packed.materials["model"][0])]
    rng = np.random.default_rng(11)
    wo, wi = sphere(rng, 20), sphere(rng, 300)
    plain = Steps(gpu.bsdf.values(packed, wo, wi)).finish()
    found = Steps(gpu.bsdf.values(packed, wo, wi, lobes=True)).finish()
    assert found.lobe_names.tolist() == list(model.lobe_names)
    assert len(plain.lobes) == len(plain.lobe_names) == 0
    np.testing.assert_array_equal(found.f, plain.f)
    np.testing.assert_array_equal(found.pdf, plain.pdf)
    assert (found.lobes >= 0).all()
    np.testing.assert_allclose(found.lobes.sum(0, dtype=np.float64), found.f, rtol=2e-6, atol=1e-12)


def test_openpbr_calls_its_lobes_as_the_specification_does(gpu: Renderer) -> None:
    wo = direction(30)[None]
    found = Steps(gpu.bsdf.values(lone(OPENPBR["openpbr default"]), wo, wo, lobes=True)).finish()
    assert found.lobe_names.tolist() == ["diffuse", "specular", "multiscatter", "fuzz", "coat", "transmission"]


def test_each_lobe_is_its_own_part(gpu: Renderer) -> None:
    wo, wi = direction(30), [direction(-50), direction(-150)]
    glass = {**GLASS, "roughness": 0.4, "transmission": 0.5, "sheen": 1, "clearcoat": 1}
    found = Steps(gpu.bsdf.values(lone(materials(**glass)), wo[None], np.array(wi), lobes=True)).finish()
    part = dict(zip(found.lobe_names.tolist(), found.lobes[:, 0], strict=True))
    lit = {name: f.any(axis=1).tolist() for name, f in part.items()}
    above, below, both = [True, False], [False, True], [True, True]
    assert lit == {
        "diffuse": above, "specular": above, "multiscatter": both, "sheen": above, "clearcoat": above,
        "transmission": below,
    }  # fmt: skip
    matte = {"model": NUMBERS["disney"], "base_color": (0.8, 0.4, 0.2), "specular": 0}
    whole = values(gpu, materials(**matte), wo, wi).f[0, 0]
    with_coat = materials(**matte, clearcoat=1, clearcoat_gloss=1)
    found = Steps(gpu.bsdf.values(lone(with_coat), wo[None], np.array(wi), lobes=True)).finish()
    np.testing.assert_allclose(found.f[0, 0] - found.lobes[3, 0, 0], whole, rtol=1e-5)


@pytest.mark.parametrize("row", ["glTF rough", "plastic", "varnish"])
def test_nothing_is_seen_from_inside_an_opaque_body(gpu: Renderer, row: str) -> None:
    wi, _ = quadrature(16, 16)
    found = values(gpu, ALL[row], [[0.6, 0, -0.8], [1, 0, 0]], wi)
    assert not found.f.any() and not found.pdf.any() and not found.delta_probability.any()


def test_a_direction_in_the_surface_has_no_value(gpu: Renderer) -> None:
    for material in ALL.values():
        found = values(gpu, material, direction(30), [[1, 0, 0], [0, -1, 1e-44], [0.6, 0, -1e-44]])
        assert not found.f.any() and not found.pdf.any()


@pytest.mark.parametrize("inside", [False, True])
@pytest.mark.parametrize("row", ["frosted", "rough glass", "brushed glass", "half clear", "varnish"])
def test_density_and_specular_lobes_add_up(gpu: Renderer, row: str, inside: bool) -> None:
    """Of these lobes hardly a sample is lost below the horizon: glass folds those, and the others do not go there."""
    if inside and not ALL[row]["transmission"][0]:
        return
    wi, step = quadrature()
    for angle in ANGLES[:2]:
        found = values(gpu, ALL[row], direction(angle) * (-1 if inside else 1), wi)
        assert found.pdf[0] @ step + found.delta_probability.sum() == pytest.approx(1, abs=0.012)


@pytest.mark.parametrize("row", seldom(sorted(ALL.keys() - NARROW), ["iridescent glass"]))
def test_albedo_is_the_integral_of_the_values(gpu: Renderer, row: str) -> None:
    """Specular lobes included; reflected and transmitted light."""
    wi, step = quadrature()
    wo = np.array([direction(angle) for angle in ANGLES])
    found = [values(gpu, ALL[row], each, wi) for each in wo]
    expected = np.array([(step * np.abs(wi[:, 2])) @ one.f[0] + one.delta_weight[0].sum(0) for one in found])
    sampled = albedo(gpu, ALL[row], wo, 1 << 16)
    assert (np.abs(sampled.albedo - expected) < 4.5 * sampled.error + 8e-3 * expected + 1e-6).all()


def test_the_error_is_that_of_the_albedo(gpu: Renderer) -> None:
    """Of many estimates of the same albedo, which all have numbers of their own."""
    same = np.repeat([direction(60)], 4000, axis=0)
    found = albedo(gpu, ROWS["rough metal"], same, 64)
    assert found.albedo.std(0) == pytest.approx(np.sqrt((found.error**2).mean(0)), rel=0.05)
    single = albedo(gpu, ROWS["rough metal"], same, 1)
    assert single.albedo.std(0) == pytest.approx(np.sqrt((single.error**2).mean(0)), rel=0.05)


@pytest.mark.parametrize("angle", [0.0, 35.0, 60.0, 85.0])
@pytest.mark.parametrize("inside", [False, True])
def test_clear_glass(gpu: Renderer, angle: float, inside: bool) -> None:
    ior, side = 1.5, -1 if inside else 1
    wo = direction(angle) * [1, 1, side]
    eta = 1 / ior if inside else ior
    reflectance, cos_t = fresnel(math.cos(math.radians(angle)), eta)
    wi, _ = quadrature(32, 32)
    found = values(gpu, materials(**GLASS, roughness=0, ior=ior), wo, wi)
    assert not found.f.any() and not found.pdf.any()
    lobes = {
        1: ([-wo[0], 0, wo[2]], reflectance * np.ones(3)),
        -1: ([-wo[0] / eta, 0, -side * cos_t], (1 - reflectance) * np.array(GLASS["base_color"])),
    }
    there = found.delta_probability[0] > 0
    assert there.sum() == (2 if reflectance < 1 else 1)
    assert found.delta_probability.sum() == pytest.approx(1, abs=1e-6)
    for at in np.flatnonzero(there):
        expected, weight = lobes[1 if found.delta_wi[0, at, 2] * side > 0 else -1]
        np.testing.assert_allclose(found.delta_wi[0, at], expected, atol=2e-6)
        np.testing.assert_allclose(found.delta_weight[0, at], weight, rtol=1e-4, atol=2e-6)


def test_a_matched_index_lets_light_pass(gpu: Renderer) -> None:
    wo = direction(40)
    found = values(gpu, materials(**GLASS, roughness=0.5, ior=1), wo, [0, 0, 1])
    assert np.flatnonzero(found.delta_probability[0]).tolist() == [1]
    np.testing.assert_allclose(found.delta_wi[0, 1], -wo, atol=1e-6)
    np.testing.assert_allclose(found.delta_weight[0, 1], GLASS["base_color"], rtol=1e-5)


def test_a_mirror_under_a_mirror(gpu: Renderer) -> None:
    """The coat reflects by Fresnel, times its amount; the metal what that leaves, by Schlick."""
    found = values(gpu, SPECULAR["mirror with a mirror on top"], direction(60), direction(20))
    assert not found.f.any() and found.delta_probability.sum() == pytest.approx(1, abs=1e-6)
    coat = 0.7 * fresnel(0.5, 1.5)[0]
    base = np.array([1, 0.8, 0.3])
    for at, weight in ((0, (1 - coat) * (base + (1 - base) * 0.5**5)), (2, coat * np.ones(3))):
        np.testing.assert_allclose(found.delta_wi[0, at], direction(-60), atol=1e-6)
        np.testing.assert_allclose(found.delta_weight[0, at], weight, rtol=2e-3)  # the coat's share is a table's


@pytest.mark.parametrize(
    "glass",
    [{"roughness": 0.3}, {"roughness": 0.5, "anisotropic": 0.8, "anisotropic_rotation": 30, "transmission": 0.6}],
    ids=["frosted", "brushed"],
)
def test_values_are_reciprocal_across_the_surface(gpu: Renderer, glass: dict[str, Any]) -> None:
    """f over the square of the index on wi's side is symmetric, whichever sides the two directions are on."""
    material = materials(**{**GLASS, **glass, "ior": 1.5})
    rng = np.random.default_rng(5)
    a, b = sphere(rng, 60), sphere(rng, 50)
    there = values(gpu, material, a, b).f / np.where(b[:, 2] < 0, 1.5**2, 1)[None, :, None]
    back = values(gpu, material, b, a).f / np.where(a[:, 2] < 0, 1.5**2, 1)[None, :, None]
    np.testing.assert_allclose(there, back.swapaxes(0, 1), rtol=3e-3, atol=1e-6)
    across = a[:, None, 2] * b[None, :, 2] < 0
    assert (there[across] > 0).any() and (there[~across] > 0).any()


LAB: list[dict[str, Any]] = [
    {"distribution": "phong", "alpha": 1e6, "geometry": "kelemen", "fresnel": "cook_torrance", "f0": 0.5},
    {"distribution": "beckmann", "geometry": "smith", "fresnel": "none"},
    {"distribution": "gtr", "alpha": 0.001, "gamma": 10.0, "geometry": "schlick_ggx"},
    {"distribution": "gtr", "gamma": 1.0, "geometry": "cook_torrance", "fresnel": "dielectric", "ior": 1.8},
    {"distribution": "abc", "alpha": 1e6, "gamma": 1000.0, "geometry": "implicit"},
    {"distribution": "sgd", "alpha": 0.3, "geometry": "smith_correlated", "diffuse": 0.5, "diffuse_model": "eon"},
    {"distribution": "gaussian", "geometry": "neumann", "fresnel": "conductor", "conductor_eta": [0.2, 0.9, 1.1],
     "conductor_k": [3.9, 2.4, 2.2]},
]  # fmt: skip


@pytest.mark.parametrize("given", LAB, ids=lambda given: given["distribution"])
def test_microfacet_and_its_terms(gpu: Renderer, given: dict[str, Any]) -> None:
    """Against the formulas in double precision; all of its terms are in one kernel."""
    material = MicrofacetMaterial(type="microfacet", **given)
    packed, m = pack_material(material), material.model_dump()
    degrees = np.array([1e-3, 0.03, 0.3, 3.0, 20.0, 60.0, 85.0])
    w, view = np.array([direction(angle) for angle in degrees]), direction(45)
    found = Steps(gpu.bsdf.terms(packed, view[None], w)).finish()
    expected = microfacets.d(m["distribution"], m["alpha"], m["gamma"], np.tan(np.radians(degrees)))
    np.testing.assert_allclose(found.distribution, expected, rtol=1e-3, atol=1e-30)
    np.testing.assert_allclose(found.fresnel, microfacets.fresnel(m, w[:, 2]), rtol=1e-3)
    wi = w * [-1, 1, 1]
    half = wi + view
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    geometry = microfacets.geometry(m, np.broadcast_to(view, wi.shape), wi, half)
    np.testing.assert_allclose(found.geometry, geometry, rtol=1e-2, atol=1e-3)
    # Seen head-on, where the half vector is as exact as the directions are.
    head_on = np.array([0.0, 0.0, 1.0])
    f = Steps(gpu.bsdf.values(packed, head_on[None], w)).finish().f[0]
    np.testing.assert_allclose(f, microfacets.bsdf(m, head_on, w), rtol=1.2e-2, atol=1e-6)
    keys = list(kernel_keys.bsdf_keys())
    assert all(kernel_keys.bsdf_key(packed, question) in keys for question in kernels.ENTRIES)


def test_pairs_are_those_of_the_grid(gpu: Renderer) -> None:
    rng = np.random.default_rng(7)
    wo, wi = sphere(rng, 50)[:40], sphere(rng, 50)[:40]
    grid = values(gpu, ALL["frosted"], wo, wi)
    paired = Steps(gpu.bsdf.values(lone(ALL["frosted"]), wo, wi, paired=True)).finish()
    np.testing.assert_array_equal(paired.f[:, 0], grid.f[range(40), range(40)])
    np.testing.assert_array_equal(paired.pdf[:, 0], grid.pdf[range(40), range(40)])


def test_slices_and_other_questions_change_nothing(gpu: Renderer) -> None:
    """Two questions of one kernel take turns, slice by slice."""
    rng = np.random.default_rng(6)
    first, second = ALL["all at once"], ALL["frosted"]
    wo, wi = sphere(rng, 3), sphere(rng, 4000)
    alone = values(gpu, first, wo, wi)
    sampled = albedo(gpu, first, wo, 4096)
    work = [
        gpu.bsdf.values(lone(first), wo, wi, slice_s=0),
        gpu.bsdf.values(lone(second), wi[:40], wi, slice_s=0),
        gpu.bsdf.albedo(lone(first), wo, 4096, slice_s=0),
    ]
    found: dict[int, Any] = {}
    steps = [Steps(each) for each in work]
    count = 0
    while len(found) < len(steps):
        for i, each in enumerate(steps):
            if i not in found and (answer := each.step()) is not None:
                found[i] = answer
            count += 1
    assert count > 60
    assert (found[0].f == alone.f).all() and (found[0].pdf == alone.pdf).all()
    assert (found[2].albedo == sampled.albedo).all() and (found[2].error == sampled.error).all()


@pytest.mark.parametrize("row", ["glTF metal", "rough metal", "smooth metal", "brushed"])
def test_a_metal_is_the_product_of_its_terms(gpu: Renderer, row: str) -> None:
    """f = D G F / (4 cos cos), each factor taken at its own angle."""
    view, angles = 45.0, np.array([2.0, 30.0, 44.0, 46.0, 80.0])  # on the other side of the normal than the view
    f = values(gpu, ROWS[row], direction(view), [direction(-angle) for angle in angles]).f[0]
    d = terms(gpu, ROWS[row], np.abs(view - angles) / 2).distribution
    fresnel_ = terms(gpu, ROWS[row], (view + angles) / 2).fresnel
    g = terms(gpu, ROWS[row], angles, view).geometry
    cosines = math.cos(math.radians(view)) * np.cos(np.radians(angles))
    np.testing.assert_allclose(f, (d * g / (4 * cosines))[:, None] * fresnel_, rtol=2e-3)
    assert ((g > 0) & (g <= 1)).all()


def test_terms_of_principled(gpu: Renderer) -> None:
    """Trowbridge and Reitz, Smith with correlated heights, and Fresnel, in double precision."""
    alpha, angles = 0.4**2, np.array([0.0, 20.0, 60.0, 85.0])
    found = terms(gpu, materials(model=P, roughness=0.4, ior=1.5), angles, 30)
    c = np.cos(np.radians(angles))
    np.testing.assert_allclose(found.distribution, alpha**2 / (np.pi * (c**2 * (alpha**2 - 1) + 1) ** 2), rtol=1e-4)
    np.testing.assert_allclose(found.fresnel, [[fresnel(x, 1.5)[0]] * 3 for x in c], rtol=1e-4)

    def hidden(degrees: Any) -> np.ndarray:
        return np.asarray((np.sqrt(1 + (alpha * np.tan(np.radians(degrees))) ** 2) - 1) / 2)

    np.testing.assert_allclose(found.geometry, 1 / (1 + hidden(30) + hidden(angles)), rtol=1e-4)
    assert found.has_facets.all()
    mirror = terms(gpu, materials(model=P, roughness=0, ior=1.5), angles)
    assert not mirror.has_facets.any()
    np.testing.assert_array_equal(mirror.fresnel, found.fresnel)


def test_no_slider_asks_for_a_kernel_that_was_not_foreseen() -> None:
    """But a film's, which is rare: its code is compiled when it is asked for."""
    foreseen = list(kernel_keys.bsdf_keys())
    used = set()
    lab = pack_material(MicrofacetMaterial(type="microfacet"))
    measured = models.BY_NUMBER[NUMBERS["measured"]]
    assert measured.record is not None
    file = lone(materials(model=measured.number))
    setattr(file, measured.records, np.zeros((measured.record.words // 4, 4), np.uint32))
    filmless = [lone(row) for row in (ALL | LAYERED).values() if not (row["film_thickness"] > 0).any()]
    for material in [*filmless, lab, file]:
        glowing = material.materials.copy()
        glowing["emission"], glowing["opacity"], glowing["attenuation_distance"] = 3.0, 0.5, 1.0
        for question in kernels.ENTRIES:
            key = kernel_keys.bsdf_key(material, question)
            assert kernel_keys.bsdf_key(replace(material, materials=glowing), question) == key
            used.add(foreseen.index(key))
    assert used == set(range(len(foreseen)))
