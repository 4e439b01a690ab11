"""Media that scatter and shine: closed forms, furnaces, the H functions of half spaces, and estimators that agree."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from gpu import Renderer, layout
from gpu.layout.bindings import Slot
from tests import stats
from tests.extremes.scenes import ball, icosphere, quad
from tests.half_spaces import h_function
from tests.marks import BY_ESTIMATOR
from tests.probing import prober_of
from tests.rendering import assert_estimators_agree, document, picture, render

Doc = dict[str, Any]
WHITE = {"type": "constant", "radiance": 1}
CLEAR = {"type": "principled", "transmission": 1, "base_color": 1, "roughness": 0, "ior": 1}
HALF_SPACE = {"type": "box", "min": [-300, -300, -300], "max": [300, 300, 0], "material": "clear"}


def seen(gpu: Renderer, shapes: list[Doc], samples: int, **more: Any) -> np.ndarray:
    """Radiance from (0, 0, 4) along -Z."""
    materials = {"clear": CLEAR, "glass": {**CLEAR, "ior": 1.5}, **more.pop("materials", {})}
    camera = more.pop("camera", {"position": [0, 0, 4], "target": [0, 0, 0], "vfov": 0.02})
    given = {k: more.pop(k) for k in ("estimator", "max_bounces") if k in more}
    scene = document(shapes, materials, camera=camera, **more)
    return np.asarray(render(gpu, scene, samples, width=16, height=16, **given)[..., :3].mean((0, 1)))


def filled(medium: Doc, material: str = "clear", **more: Any) -> Doc:
    return ball(material, **more) | {"medium": medium}


@pytest.mark.parametrize("g", [-0.99, -0.3, 0.0, 1e-4, 0.6, 0.99])
def test_turns_follow_the_phase_function(gpu: Renderer, g: float) -> None:
    """Chi-square over bands of the turn that are equally likely in closed form, and over angles around them."""
    n, bands, angles = 100_000, 16, 12
    asks = np.zeros((n, 4), np.float32)
    asks[:, :2] = np.random.default_rng(7).random((n, 2))
    (out,) = prober_of(gpu).run("phase.comp", n, {Slot.SUM: asks}, raised=frozenset({"HAS_SCATTERING"}), g=g)
    wi, pdf = out[:, :3].astype(float), out[:, 3].astype(float)
    np.testing.assert_allclose(np.linalg.norm(wi, axis=1), 1, atol=1e-6)
    turn = -wi[:, 2]  # wo is where the light goes to, so that it came along -z
    sideways = np.hypot(wi[:, 0], wi[:, 1]) ** 2
    short = np.where(
        g * turn > 0, sideways / (1 + np.abs(turn)), 1 - np.sign(g) * turn
    )  # 1 - |cosine|, to all digits
    root = np.sqrt((1 - abs(g)) ** 2 + 2 * abs(g) * short)
    np.testing.assert_allclose(pdf, (1 - g * g) / (4 * np.pi * root**3), rtol=2e-4)
    share = (1 + turn) / 2 if g == 0 else (1 - g * g) / (2 * g) * (1 / root - 1 / (1 + g))
    around = np.arctan2(wi[:, 1], wi[:, 0])
    observed = np.histogram2d(share, around, (bands, angles), [[0, 1], [-np.pi, np.pi]])[0]
    assert stats.chi_square(observed, np.full_like(observed, n / observed.size)) > stats.sidak(1e-3, 6)
    assert turn.mean() == pytest.approx(g, abs=4 * turn.std() / math.sqrt(n))


LAMPS = [(0.3, 0, 2, 5), (-0.02, 0.01, 4, 1), (0, -9, 1, 400), (1, 1, -3, 8)]  # the last one is behind the ray


@pytest.mark.parametrize("lamps", [LAMPS[:1], LAMPS, [(0.01, 0, 2, 3)], [(0, 0, 2, 3)], []])
@pytest.mark.parametrize(("t", "rate"), [(6.0, 0.3), (1e30, 0.05), (6.0, 20.0)])
def test_distances_towards_lamps_follow_their_density(gpu: Renderer, lamps: list[Any], t: float, rate: float) -> None:
    """Chi-square over distances, of one lamp, of four, and of one close to the ray; none goes beyond the end."""
    frame = np.zeros((), layout.Uniforms.dtype)
    for i, values in enumerate(lamps):
        frame["lamps_x"][i], frame["lamps_y"][i], frame["lamps_z"][i], frame["lamps_intensity"][i] = values
    n, raised = 100_000, frozenset({"HAS_MEDIA", "HAS_SCATTERING", "HAS_POINT_LIGHTS"})

    def asked(u: Any, at: Any) -> np.ndarray:
        asks = np.zeros((n, 4), np.float32)
        asks[:, 0], asks[:, 1] = u, at
        probe = prober_of(gpu)
        (out,) = probe.run("equiangular.comp", n, {Slot.SUM: asks}, raised=raised, frame=frame, t=t, rate=rate)
        return out.astype(float)

    drawn = asked(np.random.default_rng(3).random(n), -1)
    chance, far = drawn[0, 2], drawn[0, 3]
    assert far == pytest.approx(min(t, 5 / rate)) and drawn[:, 0].min() >= 0 and drawn[:, 0].max() <= far
    assert np.isfinite(drawn).all() and 0 <= chance <= 0.5 and (chance > 0 or not lamps or rate > 1)
    if chance == 0 or lamps[0][:2] == (0, 0):  # on the ray, where bins would be as narrow as numbers
        return
    bins = 1000 if rate < 1 else 100  # far from a lamp few angles are left between numbers
    edges = np.quantile(drawn[:, 0], np.linspace(0, 1, bins + 1))
    edges[0], edges[-1] = 0, far
    middles = (np.arange(n // bins) + 0.5) / (n // bins)
    density = asked(0, (edges[:-1, None] + np.diff(edges)[:, None] * middles).ravel())[:, 1]
    shares = density.reshape(bins, -1).mean(axis=1) * np.diff(edges) / chance
    assert shares.sum() == pytest.approx(1, abs=2e-3)
    assert np.abs(shares * bins - 1).max() < 0.4  # the edges are those of these draws
    again = asked(np.random.default_rng(4).random(n), -1)
    observed = np.histogram(again[:, 0], edges)[0]
    assert stats.chi_square(observed, n * shares / shares.sum()) > stats.sidak(1e-3, 9)


@pytest.mark.parametrize("estimator", BY_ESTIMATOR)
def test_what_absorbs_lets_through_what_beer_and_lambert_say(gpu: Renderer, estimator: str) -> None:
    """Also beside what the material itself absorbs, and over the whole way to a lamp."""
    tinted = {**CLEAR, "attenuation_color": [0.5, 0.5, 0.5], "attenuation_distance": 1.0}
    medium = {"absorption": [0.0, 0.5, 3.0]}
    image = seen(
        gpu, [filled(medium, "tinted")], 4, environment=WHITE, materials={"tinted": tinted}, estimator=estimator,
        max_bounces=8,
    )  # fmt: skip
    np.testing.assert_allclose(image, 0.25 * np.exp(-2 * np.array([0.0, 0.5, 3.0])), rtol=1e-4)


def test_space_that_absorbs(gpu: Renderer) -> None:
    """A lamp fades over the way; of what is infinitely far nothing arrives, but where a channel loses nothing."""
    fog = {**WHITE, "medium": {"absorption": [0.0, 0.1, 1.0]}}
    lamp = quad("lamp", (-1, -1, 1), (2, 0, 0), (0, 2, 0))
    materials = {"lamp": {"type": "diffuse", "albedo": 0, "emission": 2}}
    image = seen(gpu, [lamp], 4, environment=fog, materials=materials)
    np.testing.assert_allclose(image, 2 * np.exp(-3 * np.array([0.0, 0.1, 1.0])), rtol=1e-4)
    assert seen(gpu, [ball("lamp", (3, 0, 0))], 4, environment=fog, materials=materials).tolist() == [1, 0, 0]
    lit = {"type": "point", "position": [0, 0, 2], "intensity": 1}
    wall = {"wall": {"type": "diffuse", "albedo": 1}}
    image = seen(gpu, [quad("wall", (-1, -1, 1), (2, 0, 0), (0, 2, 0))], 4, environment=fog | {"radiance": 0},
                 materials=wall, lights=[lit])  # fmt: skip
    np.testing.assert_allclose(image, np.exp(-4 * np.array([0.0, 0.1, 1.0])) / math.pi, rtol=1e-4)


@pytest.mark.parametrize("absorption", [0.0, 1e-6, 0.3, 50.0])
def test_what_shines_adds_up_along_the_ray(gpu: Renderer, absorption: float) -> None:
    medium = {"absorption": absorption, "emission": [1.0, 0.5, 0.0]}
    length = (1 - math.exp(-2 * absorption)) / absorption if absorption else 2.0
    image = seen(gpu, [filled(medium)], 4, environment={**WHITE, "radiance": 0.0})
    np.testing.assert_allclose(image, length * np.array([1.0, 0.5, 0.0]), rtol=1e-4, atol=1e-7)


@pytest.mark.parametrize("material", ["clear", "glass"])
@pytest.mark.parametrize(
    "medium", [{"scattering": 2}, {"scattering": [8, 1, 3], "g": 0.8}, {"scattering": 1, "g": -0.6}]
)
def test_what_loses_nothing_is_white_in_a_furnace(gpu: Renderer, material: str, medium: Doc) -> None:
    scene = document([filled(medium, material)], {"clear": CLEAR, "glass": {**CLEAR, "ior": 1.5}}, environment=WHITE)
    made = picture(gpu, scene, 256, max_bounces=512)
    image, variance = made.read()[..., :3].astype(float), made.read("variance").astype(float)
    error = np.sqrt(variance.mean((0, 1)) / variance[..., 0].size)
    assert np.all(np.abs(image.mean((0, 1)) - 1) < 4 * error + 1e-5)
    assert error.max() < 0.004


def test_what_shines_and_absorbs_as_much_is_as_bright_as_the_furnace(gpu: Renderer) -> None:
    """Kirchhoff: emission of absorption times the radiance around, which in a body is that outside times the square
    of its index; among particles that scatter."""
    medium = {"absorption": 1.0, "scattering": [4, 1, 0], "emission": 1.0, "g": 0.5}
    dense = {**medium, "emission": 1.5**2}
    for shape in (filled(medium), filled(dense, "glass"), {**icosphere("glass", 2), "medium": dense}):
        image = seen(gpu, [shape], 64, environment=WHITE, max_bounces=128)
        np.testing.assert_allclose(image, 1, atol=0.01)


@pytest.mark.parametrize("albedo", [0.3, 0.8, 0.98])
def test_half_spaces_show_what_chandrasekhar_says(gpu: Renderer, albedo: float) -> None:
    """Under a constant sky, and under a sun, whose light passes the index-matched surface to be sampled within."""
    medium = {"absorption": 1 - albedo, "scattering": albedo}
    body = {**HALF_SPACE, "medium": medium}
    expected = 1 - h_function(np.array([albedo]), 1.0)[0] * math.sqrt(1 - albedo)
    image = seen(gpu, [body], 1024 if albedo < 0.5 else 128, environment=WHITE, max_bounces=512)
    np.testing.assert_allclose(image.mean(), expected, rtol=0.01)
    mu = 0.6
    sun = {"type": "directional", "direction": [0.8, 0, -mu], "irradiance": math.pi}
    h = h_function(np.array([albedo]), 1.0)[0] * h_function(np.array([albedo]), mu)[0]
    image = seen(gpu, [body], 128, lights=[sun], max_bounces=512)
    np.testing.assert_allclose(image.mean(), albedo / 4 * mu / (1 + mu) * h, rtol=0.01)


@pytest.mark.parametrize("g", [0.0, 0.6])
def test_the_colour_of_much_is_the_one_that_was_asked_for(gpu: Renderer, g: float) -> None:
    medium: Doc = {"albedo": [0.8, 0.5, 0.1], "radius": [0.1, 1.0, 0.3], "g": g}
    image = seen(gpu, [{**HALF_SPACE, "medium": medium}], 128, environment=WHITE, max_bounces=512)
    np.testing.assert_allclose(image, medium["albedo"], atol=0.03 if g else 0.01)


@pytest.mark.parametrize("g", [-0.5, 0.0, 0.9])
def test_fog_around_a_point_light_scatters_once_as_by_quadrature(gpu: Renderer, g: float) -> None:
    """The ray passes it at a distance of 1; a lamp behind it shines through."""
    fog = {"type": "constant", "radiance": 0, "medium": {"scattering": [0.2, 0.1, 0.0], "absorption": 0.05, "g": g}}
    light = {"type": "point", "position": [1, 0, 0], "intensity": [1, 2, 1]}
    image = seen(gpu, [ball("clear", (0, 50, 0))], 512, environment=fog, lights=[light], max_bounces=1)
    s = np.linspace(0, 200, 2_000_001)
    z = 4 - s
    r = np.sqrt(1 + z * z)
    cosine = z / r  # between the light's way on and the way to the camera
    phase = (1 - g * g) / (4 * math.pi * (1 + g * g - 2 * g * cosine) ** 1.5)
    for channel, (scattering, intensity) in enumerate(zip((0.2, 0.1, 0.0), (1, 2, 1), strict=True)):
        extinction = scattering + 0.05
        along = scattering * phase * intensity * np.exp(-extinction * (s + r)) / r**2
        expected = float(np.trapezoid(along, s))
        np.testing.assert_allclose(image[channel], expected, rtol=0.02, atol=1e-9)


def test_estimators_agree_in_what_scatters(gpu: Renderer) -> None:
    """A lamp in fog beside a cloud with a lamp in it, a matte floor, a glass ball of milk."""
    cloud = {"scattering": 1.5, "absorption": [0.1, 0.2, 0.5], "g": 0.4}
    shapes = [
        filled(cloud), ball("lamp", (0.3, 0, 0), 0.3), ball("lamp", (-2, 2, 1), 0.5),
        quad("floor", (-4, -1, 4), (8, 0, 0), (0, 0, -8)),
        filled({"scattering": 5}, "glass", center=(1.8, 0, 0), radius=0.7),
    ]  # fmt: skip
    materials = {
        "clear": CLEAR, "glass": {**CLEAR, "ior": 1.5}, "floor": {"type": "diffuse", "albedo": 0.6},
        "lamp": {"type": "diffuse", "albedo": 0, "emission": 4},
    }  # fmt: skip
    fog = {**WHITE, "radiance": 0, "medium": {"scattering": 0.1, "absorption": 0.02, "g": 0.3}}
    assert_estimators_agree(gpu, document(shapes, materials, environment=fog))


@pytest.mark.parametrize("g", [0.999999, -0.999999, 0.99999999])
def test_extreme_media_stay_finite(gpu: Renderer, g: float) -> None:
    for scattering in (1e-9, 1.0, 1e9):
        medium = {"scattering": scattering, "g": g, "absorption": [0, 1e-9, 1e9], "emission": [0, 1e3, 1e3]}
        image = seen(gpu, [filled(medium, "glass")], 4, environment=WHITE, max_bounces=16)
        assert np.isfinite(image).all() and image.max() <= 2.5e3


@pytest.mark.parametrize("g", [1, -1])
def test_glass_whose_light_turns_not_at_all_or_all_the_way(gpu: Renderer, g: float) -> None:
    """OpenPBR's range has both ends, of which there is no phase function."""
    milk = {
        "type": "openpbr", "transmission_weight": 1, "specular_roughness": 0, "specular_ior": 1.0001,
        "transmission_color": [0.5] * 3, "transmission_depth": 1, "transmission_scatter": [0.69] * 3,
        "transmission_scatter_anisotropy": g,
    }  # fmt: skip
    image = seen(gpu, [ball("milk")], 16, environment=WHITE, materials={"milk": milk}, max_bounces=64)
    np.testing.assert_allclose(image, 1, atol=0.03)
