"""`principled` neither gains nor loses: white furnaces, 4 096 draws of all parameters, slabs and absorption."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np
import pytest
from scipy.stats import qmc

from gpu import ESTIMATORS, Renderer
from gpu.layout import ABSENT
from gpu.layout.bindings import Slot
from gpu.layout.models import NUMBERS
from tests import film
from tests.extremes.scenes import LONG
from tests.marks import BY_ESTIMATOR, seldom
from tests.probing import PRINCIPLED_FLAGS, Prober, materials, prober_of, rare
from tests.rendering import assert_estimators_agree, document, picture, render

WHITE = {"type": "constant", "radiance": 1}
SPHERE = {"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "m"}
QUAD = {"type": "quad", "origin": [-1, -1, 0], "u": [2, 0, 0], "v": [0, 2, 0], "material": "m"}
BOX = {"type": "box", "min": [-1, -1, -1], "max": [1, 1, 1], "material": "m"}
FRACTIONS = (
    "subsurface", "metallic", "specular", "specular_tint", "roughness", "anisotropic", "sheen", "sheen_tint",
    "clearcoat", "clearcoat_gloss", "transmission", "sheen_roughness",
)  # fmt: skip
OTHERS = ("ior", "clearcoat_roughness", "r", "g", "b", "specular_r", "specular_g", "specular_b", "cosine", "azimuth")
NAMES = (*FRACTIONS, *OTHERS)


@pytest.fixture(scope="module")
def prober(gpu: Renderer) -> Prober:
    return prober_of(gpu)


def _materials(u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Records and directions from numbers 0..1, in the order of NAMES."""
    d = dict(zip(NAMES, u.T, strict=True))
    m = np.repeat(materials(model=NUMBERS["principled"]), len(u))
    for name in FRACTIONS:
        m[name] = d[name]
    m["ior"] = np.where(d["ior"] < 0.5, ABSENT, 1 + 3 * (2 * d["ior"] - 1) ** 2)
    m["clearcoat_roughness"] = np.where(d["clearcoat_roughness"] < 0.5, ABSENT, 2 * d["clearcoat_roughness"] - 1)
    m["base_color"] = u[:, [NAMES.index(c) for c in "rgb"]]
    m["specular_color"] = u[:, [NAMES.index(f"specular_{c}") for c in "rgb"]]
    asks = np.zeros((len(u), 4), np.float32)
    asks[:, 0] = np.maximum(d["cosine"], 0.02)
    asks[:, 1] = 2 * np.pi * d["azimuth"]
    asks[:, 2] = np.arange(len(u)) % 2  # every other one from inside
    return m, asks


def _albedo(prober: Prober, m: np.ndarray, asks: np.ndarray, samples: int) -> tuple[np.ndarray, np.ndarray]:
    """Directional albedo of the brightest channel and its standard error, none of it NaN or negative."""
    inputs = {Slot.SUM: asks, Slot.MATERIALS: m}
    told = prober.run("albedo.comp", len(m), inputs, (Slot.OUTPUT,), {}, PRINCIPLED_FLAGS | rare(m), samples=samples)
    out = told[0].astype(float)
    assert (out[:, 2] == 1).all()
    return out[:, 0], np.sqrt(np.maximum(out[:, 1] - out[:, 0] ** 2, 0) / samples)


def _draws(kind: str) -> np.ndarray:
    bits = len(NAMES) - 8  # of what stands at a corner: all but colours and direction
    u = qmc.Sobol(len(NAMES), seed=1).random(2 << bits if kind == "every corner" else 4096)
    colours = [NAMES.index(n) for n in ("r", "g", "b", "specular_r", "specular_g", "specular_b")]
    if "corner" in kind:
        keep = [NAMES.index("cosine"), NAMES.index("azimuth")]
        u = np.where(np.isin(np.arange(len(NAMES)), keep), u, np.round(u))
        if kind == "every corner":  # 2^14 of them, each from outside and from inside
            chosen = [i for i in range(len(NAMES)) if i not in keep and i not in colours]
            u[:, chosen] = (np.arange(len(u))[:, None] // 2 >> np.arange(bits)) & 1
    if kind != "any":
        u[:, colours] = 1
    return u


@pytest.mark.parametrize("kind", ["any", "white", "corners", *(["every corner"] if LONG else [])])
def test_no_parameters_gain_light(prober: Prober, kind: str) -> None:
    m, asks = _materials(_draws(kind))
    albedo, _ = _albedo(prober, m, asks, 1024)
    first = np.argsort(-albedo)[:64]  # the brightest again, with more samples
    again, error = _albedo(prober, m[first], asks[first], 1 << 15)
    top = int(np.argmax(again - 4 * error))
    assert again[top] - 4 * error[top] < 1.003, (again[top], error[top], m[first][top], asks[first][top])


def test_films_on_white_gain_little(prober: Prober) -> None:
    """All parameters are drawn. Means over rough facets know four cosines: a few of 4 096 draws gain more."""
    gains = film.surest_gains(partial(_albedo, prober), *_materials(_draws("white")))
    assert gains[0] < 1.06 and gains[4] < 1.003, gains[:6]


GRAZING = math.cos(math.radians(87))


@pytest.mark.parametrize("inside", [0, 1])
@pytest.mark.parametrize("roughness", [0, 1e-4, 0.01, 0.05, 0.1, 0.17, 0.25, 0.3, 0.5, 0.7, 0.85, 1])
def test_white_metal_and_clear_glass_lose_nothing(prober: Prober, roughness: float, inside: int) -> None:
    """At 87 degrees and less, where it is entered and where it is left."""
    cosines = np.concatenate([np.linspace(GRAZING, 0.15, 6), np.linspace(0.15, 1, 10)])
    glass = {"transmission": 1}
    for given in ({"metallic": 1}, glass, {**glass, "ior": 1.2}, {**glass, "ior": 1.33}, {**glass, "ior": 2.4}):
        m = np.repeat(materials(model=NUMBERS["principled"], base_color=1, roughness=roughness, **given), 16)
        asks = np.stack([cosines, cosines, np.full(16, inside), 0 * cosines], 1).astype(np.float32)
        albedo, error = _albedo(prober, m, asks, 1 << 14)
        assert (albedo - 4 * error < 1.003).all(), (given, albedo)
        assert (albedo + 4 * error > 0.99).all(), (given, albedo)


@pytest.mark.parametrize("anisotropic", [0.1, 0.7, 1])
def test_stretched_lobes_lose_little(prober: Prober, anisotropic: float) -> None:
    """Of any index, from 1.1 on, but in few directions; nearer to 1 they may lose more. They never gain."""
    u = qmc.Sobol(4, seed=2).random(512)
    for given in ({"metallic": 1}, {"transmission": 1}):
        m = np.repeat(materials(model=NUMBERS["principled"], base_color=1, anisotropic=anisotropic, **given), 512)
        m["roughness"] = u[:, 0]
        m["ior"] = 1 + 3 * u[:, 3] ** 2
        inside = np.arange(512) % 2 * given.get("transmission", 0)
        columns = [GRAZING + (1 - GRAZING) * u[:, 1] ** 1.5, 7 * u[:, 2], inside, 0 * inside]
        asks = np.stack(columns, 1).astype(np.float32)
        albedo, _ = _albedo(prober, m, asks, 1 << 12)
        order = np.argsort(albedo)
        assert 0.99 < albedo.mean() < 1.001
        low, high = (order[m["ior"][order] > 1.1])[:24], order[-24:]
        again, error = _albedo(prober, m[low], asks[low], 1 << 16)
        assert again.min() > 0.93 and np.sort(again)[12] > 0.97, (given, np.sort(again))
        again, error = _albedo(prober, m[high], asks[high], 1 << 16)
        assert (again - 4 * error < 1.003).all(), (given, again.max())


GLASS = {"type": "principled", "transmission": 1, "base_color": 1, "roughness": 0, "ior": 1.5}
METAL = {"type": "principled", "metallic": 1, "base_color": 1}


def _furnace(material: dict[str, Any], shape: dict[str, Any]) -> dict[str, Any]:
    camera = {"position": [0, 0, 4], "target": [0, 0, 0], "vfov": 24}
    return document([shape], {"m": material}, environment=WHITE, camera=camera)


def _render(gpu: Renderer, material: dict[str, Any], shape: dict[str, Any], samples: int, **more: Any) -> np.ndarray:
    return render(gpu, _furnace(material, shape), samples, max_bounces=128, **more)[..., :3]


@pytest.mark.parametrize("shape", [SPHERE, BOX, QUAD], ids=["sphere", "box", "plane"])
@pytest.mark.parametrize("roughness", [0, 0.2, 0.6, 1])
def test_white_furnace_of_pictures(gpu: Renderer, shape: dict[str, Any], roughness: float) -> None:
    for material in (METAL, GLASS):
        image = _render(gpu, {**material, "roughness": roughness}, shape, 512)
        assert 0.99 < image.mean() < 1.003, (material, image.mean())


def _bounds(gpu: Renderer, material: dict[str, Any], shape: dict[str, Any], samples: int) -> tuple[float, float]:
    """Mean of the picture and four standard errors, less and more."""
    settings = {"max_bounces": 512, "width": 16, "height": 16, "sampler": "independent"}
    made = picture(gpu, _furnace(material, shape), samples, **settings)
    image, error = float(made.read()[..., :3].mean()), math.sqrt(made.read("variance")[..., 0].mean() / 256)
    made.release()
    return image - 4 * error, image + 4 * error


@pytest.mark.parametrize("shape", [SPHERE, BOX], ids=["sphere", "box"])
@pytest.mark.parametrize("ior", [1.1, 1.5, 2.4, 4])
def test_white_furnace_of_dense_bodies(gpu: Renderer, shape: dict[str, Any], ior: float) -> None:
    """Light is scattered some ior^2 times before it leaves: what little is lost or gained each time adds up."""
    for roughness in (0.3, 1):
        low, high = _bounds(gpu, {**GLASS, "roughness": roughness, "ior": ior}, shape, 384)
        assert low < 1.003 and high > 0.99, (roughness, low, high)
        assert high - low < (0.25 if ior == 4 else 0.05)  # no weights that grow from bounce to bounce


@pytest.mark.parametrize("shape", [SPHERE, BOX, QUAD], ids=["sphere", "box", "plane"])
@pytest.mark.parametrize("ior", [1.1, 1.5, 2, 4])
def test_white_furnace_of_stretched_glass(gpu: Renderer, shape: dict[str, Any], ior: float) -> None:
    for roughness, anisotropic in ((0.5, 1), (0.9, 1), (0.9, 0.6)):
        material = {**GLASS, "roughness": roughness, "anisotropic": anisotropic, "ior": ior}
        # Paths in a body of index 4 are sixteen times as long, and vary so much that more samples say little more.
        low, high = _bounds(gpu, material, shape, 64 if ior == 4 else 256)
        assert low < 1.003 and high > 0.97, (roughness, anisotropic, low, high)


@pytest.mark.parametrize(("shape", "most"), [(SPHERE, 160), (BOX, 255)], ids=["sphere", "box"])
def test_weights_do_not_pile_up_inside_rough_glass(gpu: Renderer, shape: dict[str, Any], most: int) -> None:
    """Weights above 1 multiply while a path stays inside: of 131 072 samples, whose mean is 1, 226 and 313 would be
    above 10 if facets were sampled as often as they are visible, and one at 334."""
    material = {**GLASS, "ior": 2.3, "roughness": 0.8, "anisotropic": 0.85}
    settings = {"max_bounces": 512, "width": 512, "height": 256, "sampler": "independent"}
    found = render(gpu, _furnace(material, shape), 1, **settings)[..., 0]
    assert (found > 10).sum() < most
    assert found.max() < 100


@pytest.mark.parametrize("estimator", BY_ESTIMATOR)
@pytest.mark.parametrize("material", [GLASS, {**METAL, "roughness": 0}, {**GLASS, "ior": 1, "roughness": 0.5}])
def test_perfectly_specular_lobes_in_every_estimator(gpu: Renderer, estimator: str, material: dict[str, Any]) -> None:
    """What a mirror or clear glass shows is counted in full, whatever the estimator does elsewhere."""
    image = _render(gpu, material, SPHERE, 64, estimator=estimator)
    np.testing.assert_allclose(image, 1, atol=2e-3)


@pytest.mark.parametrize("n", [1.0, 1.33, 1.5, 2.4])
def test_a_slab_passes_what_fresnel_says(gpu: Renderer, n: float) -> None:
    """Head-on and with all inner reflections: T = 2 n / (n^2 + 1), from a lamp behind; R = 1 - T."""
    slab = {"type": "box", "min": [-2, -2, -0.5], "max": [2, 2, 0.5], "material": "m"}
    lamp = {"type": "quad", "origin": [-9, -9, -3], "u": [18, 0, 0], "v": [0, 18, 0], "material": "lamp"}
    materials_ = {"m": {**GLASS, "ior": n}, "lamp": {"type": "diffuse", "albedo": 0, "emission": 1}}
    camera = {"position": [0, 0, 4], "target": [0, 0, 0], "vfov": 0.02}
    scene = document([slab, lamp], materials_, camera=camera)
    image = render(gpu, scene, 1024, width=8, height=8, max_bounces=64)[..., :3]
    assert image.mean() == pytest.approx(2 * n / (n * n + 1), abs=3e-3)


@pytest.mark.parametrize("distance", seldom([0.5, 2.0], [2.0]))
@pytest.mark.parametrize("shape", [SPHERE, BOX, {**SPHERE, "transform": {"scale": [2, 2, 1]}}])
def test_absorption_follows_the_length_of_the_path(gpu: Renderer, distance: float, shape: dict[str, Any]) -> None:
    """Index 1, 2 m of path through the middle: what is left is colour^(2 / distance)."""
    colour = [0.9, 0.5, 0.1]
    material = {**GLASS, "ior": 1, "attenuation_color": colour, "attenuation_distance": distance}
    camera = {"position": [0, 0, 4], "target": [0, 0, 0], "vfov": 0.02}
    for estimator in ESTIMATORS:
        scene = document([shape], {"m": material}, environment=WHITE, camera=camera)
        image = render(gpu, scene, 4, width=8, height=8, max_bounces=8, estimator=estimator)[..., :3].mean((0, 1))
        np.testing.assert_allclose(image, np.array(colour) ** (2 / distance), rtol=1e-4)


def test_a_glass_sphere_bends_rays_as_snell_says(gpu: Renderer) -> None:
    """Off axis by h and twice refracted, a ray turns by 2 (asin h - asin(h / n)): a lamp there is seen."""
    n, h = 1.5, 0.6
    turn = 2 * (math.asin(h) - math.asin(h / n))
    entered, leaving = math.asin(h), math.asin(h) - 2 * math.asin(h / n)
    out = np.array([-math.sin(leaving), 0, -math.cos(leaving)])
    out_direction = np.array([-math.sin(turn), 0, -math.cos(turn)])
    centre = out + 3 * out_direction
    lamp = {"type": "sphere", "center": centre.tolist(), "radius": 0.05, "material": "lamp"}
    materials_ = {"m": {**GLASS, "ior": n}, "lamp": {"type": "diffuse", "albedo": 0, "emission": 1}}
    camera = {"position": [h, 0, 4], "target": [h, 0, 0], "vfov": 0.02}
    image = render(gpu, document([SPHERE, lamp], materials_, camera=camera), 256, width=8, height=8, max_bounces=4)
    c, t = math.cos(entered), math.sqrt(1 - (h / n) ** 2)
    rs, rp = (c - n * t) / (c + n * t), (n * c - t) / (n * c + t)
    expected = (1 - (rs * rs + rp * rp) / 2) ** 2
    assert image[..., :3].mean() == pytest.approx(expected, abs=0.01)


def test_rough_glass_agrees_in_every_estimator(gpu: Renderer) -> None:
    lamp = {"type": "sphere", "center": [1.5, 2, 2], "radius": 0.6, "material": "lamp"}
    floor = {"type": "quad", "origin": [-4, -1, 4], "u": [8, 0, 0], "v": [0, 0, -8], "material": "floor"}
    inside = {**SPHERE, "radius": 0.4, "material": "floor"}
    glass = {**GLASS, "roughness": 0.9, "attenuation_color": [0.5, 0.8, 0.9], "attenuation_distance": 1}
    glass |= {"clearcoat": 0.5, "clearcoat_roughness": 0.5}
    materials_ = {
        "m": glass, "floor": {"type": "principled", "base_color": [0.7, 0.5, 0.3], "sheen": 0.5},
        "lamp": {"type": "diffuse", "albedo": 0, "emission": 6},
    }  # fmt: skip
    scene = document([SPHERE, inside, floor, lamp], materials_, environment={"type": "constant", "radiance": 0.4})
    assert_estimators_agree(gpu, scene, max_bounces=5, within=0.02)
