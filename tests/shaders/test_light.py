"""Claims about light, against closed forms: every light, every estimator, the closed room, the furnace."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gpu import ESTIMATORS, FILTERS, Renderer, RenderSettings
from gpu.kernels import features
from service.document import parse_scene
from service.pack import pack
from tests.extremes.scenes import LONG
from tests.gpu import flag_scenes
from tests.marks import BY_ESTIMATOR
from tests.rendering import Images, assert_estimators_agree, document, picture, render

QUAD = {"type": "quad", "origin": [-1, -1, 0], "u": [2, 0, 0], "v": [0, 2, 0], "material": "m"}
SPHERE = {"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "m"}
NARROW = {"position": [0, 0, 4], "target": [0, 0, 0], "vfov": 0.02}  # looks at one point of the surface at z = 0
LAMP = {"type": "diffuse", "albedo": 0, "emission": [7, 3, 1]}


def _spot(gpu: Renderer, scene: dict[str, Any], samples: int = 4096, **more: Any) -> np.ndarray:
    """Mean colour of a 16 x 16 picture, all of whose pixels look at the same point."""
    return render(gpu, scene, samples // 16, width=16, height=16, **more)[..., :3].mean((0, 1))


def test_point_light_falls_off_as_cosine_over_squared_distance(gpu: Renderer) -> None:
    light = {"type": "point", "position": [0.3, -0.2, 1.5], "intensity": [3, 7, 0.4]}
    camera = {"position": [0, 0, 4], "target": [0, 0, 0], "vfov": 24}
    image = render(gpu, document([QUAD], lights=[light], camera=camera), 256)[..., :3]
    k = math.tan(math.radians(12)) * 4
    at = ((np.arange(32 * 8) + 0.5) / (32 * 8) * 2 - 1) * k
    x, y = np.meshgrid(at, -at)
    d2 = (x - 0.3) ** 2 + (y + 0.2) ** 2 + 1.5**2
    e = (1.5 / d2**1.5).reshape(32, 8, 32, 8).mean((1, 3))
    np.testing.assert_allclose(image, e[..., None] * 0.5 / math.pi * np.array([3, 7, 0.4]), rtol=4e-3)


def test_a_light_behind_gives_nothing(gpu: Renderer) -> None:
    light = {"type": "point", "position": [0, 0, -1], "intensity": 50}
    assert render(gpu, document([QUAD], lights=[light]), 4)[..., :3].max() == 0


@pytest.mark.parametrize("estimator", BY_ESTIMATOR)
@pytest.mark.parametrize("filter_name", FILTERS)
def test_convex_furnace(gpu: Renderer, estimator: str, filter_name: str) -> None:
    env = {"type": "constant", "radiance": [2, 1, 0.5]}
    image = _spot(gpu, document([SPHERE], environment=env, camera=NARROW), estimator=estimator, filter=filter_name)
    np.testing.assert_allclose(image, [1, 0.5, 0.25], rtol=0.02 if estimator != "bsdf" else 1e-5)


# Areas sampled across a corner have a tail of 1 / d^2: `light` alone converges slowly there.
@pytest.mark.parametrize(
    ("estimator", "a", "n", "tolerance"),
    [("mis", 0.5, 6, 6e-3), ("bsdf", 0.5, 6, 6e-3), ("uniform", 0.5, 6, 6e-3), ("light", 0.5, 6, 0.03),
     ("mis", 0.97, 1023, 0.02)],
)  # fmt: skip
def test_closed_room_holds_its_geometric_series(
    gpu: Renderer, estimator: str, a: float, n: int, tolerance: float
) -> None:
    """Inward-facing quads of emission L and albedo a: after n bounces L (1 - a^(n+1)) / (1 - a) everywhere."""
    room = [
        {"type": "quad", "origin": o, "u": u, "v": v, "material": "m"}
        for o, u, v in (
            ([-1, -1, -1], [2, 0, 0], [0, 2, 0]),
            ([-1, -1, 1], [0, 2, 0], [2, 0, 0]),
            ([-1, -1, -1], [0, 2, 0], [0, 0, 2]),
            ([1, -1, -1], [0, 0, 2], [0, 2, 0]),
            ([-1, -1, -1], [0, 0, 2], [2, 0, 0]),
            ([-1, 1, -1], [2, 0, 0], [0, 0, 2]),
        )
    ]
    camera = {"position": [0.1, 0.2, 0.3], "target": [0.5, 0, -1], "vfov": 70}
    scene = document(room, {"m": {"type": "diffuse", "albedo": a, "emission": 2}}, camera=camera)
    image = render(gpu, scene, 256 if n < 99 else 48, max_bounces=n, estimator=estimator)[..., :3]
    assert image.mean() == pytest.approx(2 * (1 - a ** (n + 1)) / (1 - a), rel=tolerance)
    assert image.min() > 2


@pytest.mark.parametrize("estimator", BY_ESTIMATOR)
def test_sphere_light(gpu: Renderer, estimator: str) -> None:
    """E = pi L (r / d)^2 cos for a sphere wholly above the horizon [Hottel]."""
    r, d, tilt = 0.3, 1.2, math.radians(40)
    lamp = {"type": "sphere", "center": [d * math.sin(tilt), 0, d * math.cos(tilt)], "radius": r, "material": "lamp"}
    scene = document([QUAD, lamp], {"m": {"type": "diffuse", "albedo": 0.8}, "lamp": LAMP}, camera=NARROW)
    image = _spot(gpu, scene, 1 << 16, estimator=estimator)
    np.testing.assert_allclose(image, 0.8 * (r / d) ** 2 * math.cos(tilt) * np.array([7, 3, 1]), rtol=0.03)


def _rectangle_factor(a: float, b: float, c: float) -> float:
    """Form factor of a small surface to a parallel rectangle a x b at height c above it, one corner overhead."""
    x, y = a / c, b / c
    p, q = math.sqrt(1 + x * x), math.sqrt(1 + y * y)
    return (x / p * math.atan(y / p) + y / q * math.atan(x / q)) / (2 * math.pi)


RECTANGLE = {"type": "quad", "origin": [0, 0, 1.1], "u": [0, 0.7, 0], "v": [0.9, 0, 0], "material": "lamp"}
VERTICES = [[0, 0, 1.1], [0, 0.7, 1.1], [0.9, 0.7, 1.1], [0.9, 0, 1.1]]
MESH = {"type": "mesh", "vertices": VERTICES, "faces": [[0, 1, 2], [0, 2, 3]], "material": "lamp"}
BOX = {"type": "box", "min": [0, 0, 1.1], "max": [0.9, 0.7, 1.2], "material": "lamp"}


@pytest.mark.parametrize("estimator", BY_ESTIMATOR)
@pytest.mark.parametrize("lamp", [RECTANGLE, MESH, BOX], ids=["quad", "mesh", "box"])
def test_rectangular_lights(gpu: Renderer, lamp: dict[str, Any], estimator: str) -> None:
    camera = {"position": [-1, -1, 1], "target": [0, 0, 0], "vfov": 0.02}
    materials = {"m": {"type": "diffuse", "albedo": 0.8}, "lamp": LAMP}
    image = _spot(gpu, document([QUAD, lamp], materials, camera=camera), 1 << 16, estimator=estimator)
    np.testing.assert_allclose(image, 0.8 * _rectangle_factor(0.9, 0.7, 1.1) * np.array([7, 3, 1]), rtol=0.03)


def test_lights_shine_outwards_only(gpu: Renderer) -> None:
    turned = {**RECTANGLE, "u": RECTANGLE["v"], "v": RECTANGLE["u"]}
    materials = {"m": {"type": "diffuse", "albedo": 0.8}, "lamp": LAMP}
    camera = {"position": [-1, -1, 1], "target": [0, 0, 0], "vfov": 0.02}
    for estimator in ESTIMATORS:
        image = _spot(gpu, document([QUAD, turned], materials, camera=camera), 256, estimator=estimator)
        assert image.max() == 0


@pytest.mark.parametrize("estimator", ["bsdf", "light"])
def test_ellipsoid_light_agrees_with_mis(gpu: Renderer, estimator: str) -> None:
    lamp = {
        "type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "lamp",
        "transform": {"translate": [0.4, 0.2, 1.2], "rotate": [20, 30, 40], "scale": [0.6, 0.15, 0.3]},
    }  # fmt: skip
    camera = {"position": [-1, -1, 1], "target": [0, 0, 0], "vfov": 0.02}
    scene = document([QUAD, lamp], {"m": {"type": "diffuse", "albedo": 0.8}, "lamp": LAMP}, camera=camera)
    expected = _spot(gpu, scene, 1 << 16)
    np.testing.assert_allclose(_spot(gpu, scene, 1 << 16, estimator=estimator), expected, rtol=0.03)


def test_environment_lights_from_where_it_is_seen(gpu: Renderer) -> None:
    """One bright texel: irradiance is its solid angle times the cosine, under rotation too."""
    texels = np.zeros((16, 32, 3), np.float32)
    j, i = 5, 2
    texels[j, i] = 400
    rotation, normal = 30.0, np.array([0, 0, 1.0])
    phi = ((i + 0.5) / 32 - 0.5) * 2 * math.pi
    theta = (j + 0.5) / 16 * math.pi
    d = np.array([math.sin(theta) * math.sin(phi), math.cos(theta), -math.sin(theta) * math.cos(phi)])
    a = math.radians(rotation)
    d = np.array([math.cos(a) * d[0] + math.sin(a) * d[2], d[1], -math.sin(a) * d[0] + math.cos(a) * d[2]])
    omega = 2 * math.pi / 32 * (math.cos(j * math.pi / 16) - math.cos((j + 1) * math.pi / 16))
    env = {"type": "image", "asset": "e", "rotation": rotation, "background": False, "scale": 2}
    image = render(gpu, document([QUAD], environment=env, camera=NARROW), 1024, assets=Images(e=texels))
    expected = 0.5 / math.pi * 800 * omega * float(d @ normal)
    assert expected > 1
    assert image[..., :3].mean() == pytest.approx(expected, rel=0.03)  # the texel is as wide as 11 degrees


def _showcase() -> dict[str, Any]:
    shapes = [
        {"type": "quad", "origin": [-3, -1, 3], "u": [6, 0, 0], "v": [0, 0, -6], "material": "floor"},
        {**SPHERE, "radius": 0.8, "material": "metal"},
        {"type": "box", "min": [0.9, -1, -0.5], "max": [1.5, 0.3, 0.4], "material": "coat"},
        {**SPHERE, "center": [-1.5, 0.2, 0], "radius": 0.4, "material": "coat", "transform": {"scale": [1, 2, 0.5]}},
        {"type": "quad", "origin": [-1, 2.5, -1], "u": [2, 0, 0], "v": [0, 0, 2], "material": "lamp"},
        {**SPHERE, "center": [0.9, 0.9, 0.2], "radius": 0.35, "material": "gltf"},
        {**SPHERE, "center": [-0.6, -0.8, 1], "radius": 0.25, "material": "phong"},
    ]
    materials = {
        "floor": {"type": "diffuse", "albedo": [0.7, 0.6, 0.5]},
        "metal": {"type": "disney", "metallic": 1, "roughness": 0.35, "anisotropic": 0.5, "base_color": 0.9},
        "coat": {"type": "disney", "base_color": "#803020", "clearcoat": 1, "sheen": 0.5, "subsurface": 0.3},
        "lamp": LAMP,
        "gltf": {"type": "metal_rough", "base_color": [0.9, 0.6, 0.3], "metallic": 0.7, "roughness": 0.4},
        "phong": {"type": "blinn_phong", "diffuse": 0.3, "specular": 0.6, "shininess": 20, "ambient": 0.05},
    }
    env = {"type": "constant", "radiance": 0.3}
    light = {"type": "point", "position": [2, 2, 2], "intensity": 5}
    return document(shapes, materials, environment=env, lights=[light])


@pytest.mark.skipif(not LONG, reason="make extremes: tests/extremes/test_estimators.py compares them always")
def test_all_estimators_converge_to_the_same_picture(gpu: Renderer) -> None:
    assert_estimators_agree(gpu, _showcase())


@pytest.mark.parametrize("filter_name", FILTERS)
def test_the_cut_into_slices_does_not_show(gpu: Renderer, monkeypatch: pytest.MonkeyPatch, filter_name: str) -> None:
    from gpu.picture import tiles as module

    pictures = []
    for slice_s, pass_s, budget in ((1.0, 1.0, 600.0), (1e-5, 1e-4, 1e-4), (1e-3, 5.0, 1e-3)):
        monkeypatch.setattr(module, "SLICE_S", slice_s)
        monkeypatch.setattr(module, "PASS_S", pass_s)
        made = picture(gpu, _showcase(), 0, width=80, height=56, max_bounces=4, filter=filter_name)
        while made.samples < 7:
            made.trace(budget, 7)
        pictures.append((made.read(), made.read("variance"), made.noise()))
        made.release()
    for image, variance, noise in pictures[1:]:
        assert (image == pictures[0][0]).all()
        assert (variance == pictures[0][1]).all()
        assert noise == pictures[0][2]


def _of_other_scenes(most: int) -> Iterator[frozenset[str]]:
    """Every flag that some scene of `flag_scenes` raises, together with those that it raises beside it: about `most`
    at a time, as LLVM takes twenty minutes for a kernel with all of them."""
    group: frozenset[str] = frozenset()
    for scene in flag_scenes.SCENES.values():
        group |= features.flags(pack(parse_scene(scene), flag_scenes.IMAGES).arrays)
        if len(group) >= most:
            yield group
            group = frozenset()
    yield group


@pytest.mark.slow
def test_flags_change_no_pixel_beyond_rounding(gpu: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    exact = render(gpu, _showcase(), 16, max_bounces=3, roulette_depth=99)
    raised = features.flags(pack(parse_scene(_showcase()), Images()).arrays)
    seen = raised
    for group in _of_other_scenes(most=20):
        if group <= seen:
            continue
        seen |= group
        with monkeypatch.context() as patched:
            patched.setattr(features, "flags", lambda scene, editing=False, more=raised | group: more)
            full = render(gpu, _showcase(), 16, max_bounces=3, roulette_depth=99)
        # A rounding may turn a path at an edge: all but a few pixels agree to rounding, and their mean does.
        close = np.isclose(full, exact, rtol=1e-3, atol=1e-5).all(2)
        assert close.mean() > 0.97, group - raised
        assert full.mean() == pytest.approx(exact.mean(), rel=2e-3)
    assert len(features.everything() - seen) <= 3, "those of files and of textured lights"


def test_editing_a_scene_equals_making_it_anew(gpu: Renderer) -> None:
    scene = _showcase()
    made = picture(gpu, scene, 4, editing=True)
    scene["materials"]["coat"]["clearcoat"] = 0.2
    scene["camera"]["position"] = [1, 1, 4]
    arrays = pack(parse_scene(scene), Images()).arrays
    made.scene.edit(replace(made.scene.arrays, camera=arrays.camera, materials=arrays.materials))
    made.reset()
    made.trace(600, 4)
    anew = picture(gpu, scene, 4, editing=True)
    assert (made.read() == anew.read()).all()
    made.configure(RenderSettings(32, 32, max_bounces=1, filter="box", seed=1))
    made.trace(600, 4)
    assert not (made.read() == anew.read()).all()


def test_many_samples_do_not_drift(gpu: Renderer) -> None:
    """A plain sum in 32 bits is 0.06 % off after these, and 1 % after the million that `make extremes` takes."""
    scene = document([], environment={"type": "constant", "radiance": [0.1, 0.7, 1e-6]})
    made = picture(gpu, scene, 1 << (20 if LONG else 16), width=8, height=8, max_bounces=0)
    expected = np.array([0.1, 0.7, 1e-6], np.float32)
    np.testing.assert_allclose(made.read()[..., :3] / expected, 1, rtol=2e-7)
    assert made.read("variance").max() < 1e-12
    assert made.noise() < 1e-6


def test_noise_tells_the_real_error(gpu: Renderer) -> None:
    weights = np.array([0.2126, 0.7152, 0.0722])
    scene = _showcase()
    truth = render(gpu, scene, 2048, width=48, height=48, max_bounces=2, seed=9)[..., :3] @ weights
    for sampler, samples in (("sobol", 16), ("sobol", 64), ("independent", 16), ("independent", 64)):
        made = picture(gpu, scene, samples, width=48, height=48, max_bounces=2, sampler=sampler)
        real = np.sqrt(((made.read()[..., :3] @ weights - truth) ** 2).mean()) / truth.mean()
        assert made.noise() == pytest.approx(real, rel=0.2), (sampler, samples)
        made.release()
        made.scene.release()


def test_guides_of_the_first_hit(gpu: Renderer) -> None:
    quad = {**QUAD, "u": [0, 2, 0], "v": [2, 0, 0]}  # its normal points away: the guide's faces the viewer
    camera = {"position": [0, 0, 4], "target": [0, 0, 0], "vfov": 2 * math.degrees(math.atan(0.5))}
    materials = {"m": {"type": "diffuse", "albedo": [0.2, 0.4, 0.6]}}
    made = picture(gpu, document([quad], materials, camera=camera), 16)
    inside = (slice(10, 22), slice(10, 22))
    np.testing.assert_allclose(made.read("normal")[inside] - [0, 0, 1], 0, atol=1e-6)
    np.testing.assert_allclose(made.read("albedo")[inside] - [0.2, 0.4, 0.6], 0, atol=1e-6)
    depth = made.read("depth")
    assert depth[16, 16, 0] == pytest.approx(4, rel=1e-3)
    assert depth[0, 0, 0] == 0
    assert made.read("albedo")[0, 0].max() == 0
    assert made.read()[16, 16, 3] == 1
    assert made.read()[0, 0, 3] == 0


@pytest.mark.parametrize("estimator", BY_ESTIMATOR)
@pytest.mark.parametrize("bounces", [0, 1, 5])
def test_ambient_is_added_where_a_path_meets_the_surface(gpu: Renderer, estimator: str, bounces: int) -> None:
    """A ball of ambient radiance inside a closed white one: the geometric series again, without any light."""
    phong = {"type": "blinn_phong", "diffuse": 0.5, "specular": 0, "shininess": 0, "ambient": [3, 2, 1]}
    room = {"type": "sphere", "center": [0, 0, 0], "radius": 9, "material": "m"}
    scene = document([SPHERE, room], {"m": phong}, camera=NARROW)
    image = _spot(gpu, scene, 1 << 14, estimator=estimator, max_bounces=bounces)
    np.testing.assert_allclose(image, (2 - 0.5**bounces) * np.array([3, 2, 1]), rtol=0.02)


@pytest.mark.parametrize("estimator", BY_ESTIMATOR)
def test_blinn_phong_under_a_point_light(gpu: Renderer, estimator: str) -> None:
    for shininess, power in ((0, 1.0), (40, math.cos(math.radians(15)) ** 40), (1e6, 0.0)):
        phong = {"type": "blinn_phong", "diffuse": 0.3, "specular": [1, 0.5, 0.25], "shininess": shininess}
        light = {"type": "point", "position": [math.sqrt(0.5), 0, math.sqrt(0.5)], "intensity": math.pi}
        camera = {"position": [math.sin(math.radians(-15)) * 4, 0, math.cos(math.radians(-15)) * 4],
                  "target": [0, 0, 0], "vfov": 0.02}  # fmt: skip
        scene = document([QUAD], {"m": phong}, lights=[light], camera=camera)
        want = 0.3 * math.sqrt(0.5) + power * np.array([1, 0.5, 0.25])
        np.testing.assert_allclose(_spot(gpu, scene, 64, estimator=estimator), want, rtol=2e-3)


@pytest.mark.parametrize("shininess", [0, 1e-30, 1e6, 1e20])
def test_no_shininess_makes_a_nan(gpu: Renderer, shininess: float) -> None:
    for diffuse, specular in ((0, 1), (1, 0), (0, 0), (0.5, 0.5)):
        phong = {"type": "blinn_phong", "diffuse": diffuse, "specular": specular, "shininess": shininess}
        scene = document([SPHERE], {"m": phong}, environment={"type": "constant", "radiance": 1})
        for estimator in ESTIMATORS:
            assert np.isfinite(render(gpu, scene, 16, estimator=estimator)).all()
