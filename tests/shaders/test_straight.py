"""Light that goes straight through panes, bubbles and boundaries of index 1 is sampled from the lights.

A small floor is lit through a surface and seen from beside that; nothing else sends light to it.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from gpu import Renderer
from gpu.kernels.features import flags
from service.document import parse_scene
from service.pack import pack
from tests.extremes.scenes import ball
from tests.marks import BY_ESTIMATOR, seldom
from tests.rendering import Images, assert_estimators_agree, document, render

Doc = dict[str, Any]
CAMERA = {"position": [0, -1, 0.4], "target": [0, 0, 0], "vfov": 0.02}
FLOOR = {"type": "quad", "origin": [-0.05, -0.05, 0], "u": [0.1, 0, 0], "v": [0, 0.1, 0], "material": "floor"}
PANE = {"type": "quad", "origin": [-9, -9, 1], "u": [18, 0, 0], "v": [0, 18, 0], "material": "m"}
GLASS = {"type": "principled", "transmission": 1, "thin_walled": True, "base_color": 1, "roughness": 0}
AIR = {"type": "principled", "transmission": 1, "base_color": 1, "roughness": 0, "ior": 1}
OPEN = {"type": "openpbr", "transmission_weight": 1, "specular_roughness": 0, "geometry_thin_walled": True}
POINT = {"type": "point", "position": [0, 0, 2], "intensity": 5}
MATTE = {"type": "diffuse", "albedo": 0.5}
LAMP = {"type": "diffuse", "albedo": 0, "emission": 10000}
AWAY = [ball("m", (50 + 3 * i, 0, 0)) for i in range(30)]  # enough for a tree


def scene(shapes: list[Doc], material: Doc | None = None, **more: Any) -> Doc:
    materials = {"floor": MATTE, "lamp": LAMP, "m": material or GLASS, **more.pop("materials", {})}
    return document([FLOOR, *shapes], materials, **{"camera": CAMERA, **more})


def lit(gpu: Renderer, shapes: list[Doc], material: Doc | None = None, samples: int = 16, **more: Any) -> np.ndarray:
    """What the camera sees of the floor. Panes that are passed are bounces: of two by default."""
    given = {k: more.pop(k) for k in ("estimator", "max_bounces", "caustics", "filter_glossy") if k in more}
    image = render(gpu, scene(shapes, material, **more), samples, width=8, height=8, **{"max_bounces": 3, **given})
    return np.asarray(image[..., :3].mean((0, 1)))


def fresnel(c: float, eta: float) -> float:
    t = math.sqrt(1 - (1 - c * c) / eta**2)
    return 0.5 * (((c - eta * t) / (c + eta * t)) ** 2 + ((eta * c - t) / (eta * c + t)) ** 2)


def passed(c: float, eta: float) -> float:
    r = fresnel(c, eta)
    return (1 - r) / (1 + r)


def lights(x: float) -> dict[str, Doc]:
    """A lamp of each kind in the same direction."""
    small = ball("lamp", (x, 0, 2), 0.01)
    sun = {"type": "directional", "direction": [-x, 0, -2], "irradiance": 3}
    return {
        "point": {"lights": [{**POINT, "position": [x, 0, 2]}]},
        "sun": {"lights": [sun]},
        "ball": {"lamp": small},
    }


@pytest.mark.parametrize("kind", seldom(["point", "sun", "ball"], ["sun"]))
@pytest.mark.parametrize(("x", "ior"), [(0, 1.5), (2, 1.5), (6, 1.33)])
def test_a_pane_takes_what_it_reflects(gpu: Renderer, kind: str, x: float, ior: float) -> None:
    more = lights(x)[kind]
    lamp = [more.pop("lamp")] if "lamp" in more else []
    bare = lit(gpu, lamp, **more)
    clear = lit(gpu, [*lamp, PANE], {**GLASS, "ior": ior}, **more)
    tinted = lit(gpu, [*lamp, PANE], {**GLASS, "ior": ior, "base_color": [0.9, 0.5, 0.2]}, **more)
    t = passed(2 / math.hypot(x, 2), ior)
    assert bare.min() > 0.001
    np.testing.assert_allclose(clear / bare, t, rtol=2e-3 if lamp else 1e-4)
    np.testing.assert_allclose(tinted / bare, t * np.array([0.9, 0.5, 0.2]), rtol=2e-3 if lamp else 1e-4)


@pytest.mark.parametrize("many", seldom([False, True], [False]))
def test_panes_one_behind_the_other(gpu: Renderer, many: bool) -> None:
    """Through the tree as well; a mesh as a quad, and with the other model."""
    sheet = {"type": "mesh", "vertices": [[-9, -9, 1.5], [9, -9, 1.5], [0, 20, 1.5]], "faces": [[0, 1, 2]],
             "material": "open"}  # fmt: skip
    made = {"open": {**OPEN, "transmission_color": [0.9, 0.5, 0.2]}}
    away = AWAY if many else []
    bare = lit(gpu, away, lights=[POINT])
    both = lit(gpu, [PANE, sheet, *away], materials=made, lights=[POINT])
    np.testing.assert_allclose(both / bare, passed(1, 1.5) ** 2 * np.array([0.9, 0.5, 0.2]), rtol=1e-4)
    hidden = lit(gpu, [PANE, {**PANE, "origin": [-9, -9, 1.7], "material": "floor"}, *away], lights=[POINT])
    assert hidden.max() == 0


FILM = {"film_thickness": 400}
LAYERS: dict[str, Doc] = {
    "tint": {"base_color": [0.9, 0.5, 0.2]}, "part": {"transmission": 0.5}, "metal": {"metallic": 0.3},
    "film": FILM, "coat": {"clearcoat": 1, "clearcoat_roughness": 0.2}, "sheen": {"sheen": 0.8},
    "open": {**OPEN}, "open film": {**OPEN, "thin_film_weight": 1, "thin_film_thickness": 0.4},
    "open coat": {**OPEN, "coat_weight": 0.8, "coat_roughness": 0, "coat_color": [0.9, 0.6, 0.4]},
    "open fuzz": {**OPEN, "fuzz_weight": 0.7},
}  # fmt: skip


SELDOM = ("part", "metal", "sheen", "coat", "open coat", "open film")  # each has a kernel of its own


@pytest.mark.parametrize("name", seldom(LAYERS, SELDOM))
def test_it_is_what_a_path_finds_that_goes_there(gpu: Renderer, name: str) -> None:
    """Whatever lies on the pane: the share of the light of a lamp is that of its picture behind the pane."""
    more = LAYERS[name]
    material = more if "type" in more else {**GLASS, **more}
    light = {**POINT, "position": [2, 0, 2]}
    share = lit(gpu, [PANE], material, lights=[light]) / lit(gpu, [], lights=[light])
    # It is seen from below and far away, so that nothing but the straight way leads there.
    lamp = {"type": "quad", "origin": [995, 5, 1000], "u": [10, 0, 0], "v": [0, -10, 0], "material": "lamp"}
    camera = {"position": [0, 0, 0.5], "target": [2, 0, 2.5], "vfov": 0.02}
    white = {"lamp": {**LAMP, "emission": 1}}
    shapes = [PANE, lamp]
    seen = render(gpu, scene(shapes, material, camera=camera, materials=white), 1 << 10, width=8, height=8)
    np.testing.assert_allclose(share, seen[..., :3].mean((0, 1)), rtol=0.01)


@pytest.mark.parametrize("model", ["principled", "openpbr"])
def test_a_pane_of_half_alpha(gpu: Renderer, model: str) -> None:
    half = {**GLASS, "alpha": 0.5} if model == "principled" else {**OPEN, "geometry_opacity": 0.5}
    share = lit(gpu, [PANE], half, lights=[POINT]) / lit(gpu, [], lights=[POINT])
    np.testing.assert_allclose(share, 0.5 + 0.5 * passed(1, 1.5), rtol=1e-4)


CORNERS = [[x, y, z] for x in (-5, 5) for y in (-5, 5) for z in (0.5, 1.5)]
SIDES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
FACES = [half for a, b, c, d in SIDES for half in ([a, b, c], [a, c, d])]
BODIES: dict[str, Doc] = {
    "sphere": ball("m", (0, 0, 1), 0.5),
    "box": {"type": "box", "min": [-5, -5, 0.5], "max": [5, 5, 1.5], "material": "m"},
    "ellipsoid": ball("m", (0, 0, 1), 0.5, transform={"scale": [2, 1, 1]}),
    "mesh": {"type": "mesh", "vertices": CORNERS, "faces": FACES, "smooth": False, "material": "m"},
}  # fmt: skip


@pytest.mark.parametrize("many", [False, pytest.param(True, marks=pytest.mark.slow)])
@pytest.mark.parametrize("kind", BODIES)
def test_a_body_of_index_1_takes_what_it_attenuates(gpu: Renderer, kind: str, many: bool) -> None:
    """The lamp above it, and within it; and a floor within it."""
    left = np.array([0.9, 0.5, 0.2])
    material = {**AIR, "attenuation_color": left.tolist(), "attenuation_distance": 0.5}
    shapes = [BODIES[kind], *(AWAY if many else [])]
    high = {**POINT, "position": [0, 0, 3]}
    for light in (high, {**POINT, "position": [0, 0, 1]}, {**POINT, "position": [0, 0, 0.4]}):
        bare = lit(gpu, [], lights=[light])
        inside = max(0, min(light["position"][2], 1.5) - 0.5)
        found = lit(gpu, shapes, material, lights=[light])
        np.testing.assert_allclose(found / bare, left ** (inside / 0.5), rtol=2e-3)


def test_a_floor_within_a_body(gpu: Renderer) -> None:
    left = np.array([0.9, 0.5, 0.2])
    material = {**AIR, "attenuation_color": left.tolist(), "attenuation_distance": 1}
    around = {"type": "box", "min": [-3, -3, -1], "max": [3, 3, 1], "material": "m"}
    inner = {"type": "box", "min": [-0.2, -0.2, 0.5], "max": [0.2, 0.2, 0.75], "material": "inner"}
    made = {"inner": {**AIR, "attenuation_color": 0.5, "attenuation_distance": 0.25}}
    way = math.hypot(1, 0.4)  # to the camera
    for lamp, inside in ((POINT, 1), ({**POINT, "position": [0, 0, 0.8]}, 0.8)):
        bare = lit(gpu, [], lights=[lamp])
        found = lit(gpu, [around, inner], material, materials=made, lights=[lamp], max_bounces=5)
        np.testing.assert_allclose(found / bare, 0.5 * left ** (inside + way), rtol=1e-3)
    sun = {"type": "directional", "direction": [0, 0, -1], "irradiance": 3}
    found = lit(gpu, [around], material, lights=[sun]) / lit(gpu, [], lights=[sun])
    np.testing.assert_allclose(found, left ** (1 + way), rtol=1e-3)


@pytest.mark.parametrize("estimator", BY_ESTIMATOR)
def test_a_soap_bubble_around_a_lamp(gpu: Renderer, estimator: str) -> None:
    """It takes what its film reflects: as much as a white wall lacks that is seen from its middle."""
    soap = {**AIR, "film_thickness": 320, "film_ior": 1.33}
    bubble = ball("m", (0, 0, 2), 0.5)
    found = lit(gpu, [bubble], soap, lights=[POINT], estimator=estimator) / lit(gpu, [], lights=[POINT])
    camera = {"position": [0, 0, 2], "target": [0, 0, 5], "vfov": 0.02}
    wall = {"type": "quad", "origin": [-9, 9, 9], "u": [18, 0, 0], "v": [0, -18, 0], "material": "lamp"}
    white = {"lamp": {**LAMP, "emission": 1}}
    seen = render(gpu, scene([bubble, wall], soap, camera=camera, materials=white), 1 << 10, width=8, height=8)
    assert found.min() < 0.95
    np.testing.assert_allclose(found, seen[..., :3].mean((0, 1)), rtol=0.01)


@pytest.mark.parametrize("material", [{**GLASS, "thin_walled": False}, {**GLASS, "transmission": 0}])
def test_what_refracts_or_hides_lets_no_light_pass(gpu: Renderer, material: Doc) -> None:
    other = {"clear": GLASS}
    beside = {**PANE, "origin": [20, 0, 1], "material": "clear"}
    for shape in (PANE, BODIES["sphere"]):
        assert lit(gpu, [shape, beside], material, lights=[POINT], materials=other).max() == 0


def test_rough_panes_scatter_light_as_before(gpu: Renderer) -> None:
    """A clear pane elsewhere changes nothing for a frosted one."""
    frosted = {**GLASS, "roughness": 0.3}
    beside = {**PANE, "origin": [20, 0, 1], "material": "clear"}
    images = [
        lit(gpu, [PANE, *more], frosted, 512, lights=[POINT], materials={"clear": GLASS}, max_bounces=2)
        for more in ([], [beside])
    ]
    np.testing.assert_allclose(*images, rtol=1e-4)
    assert images[0].min() > 0


@pytest.mark.parametrize("estimator", BY_ESTIMATOR)
def test_every_passage_is_a_bounce(gpu: Renderer, estimator: str) -> None:
    """A path that finds the lamp through two panes needs three bounces; so does a ray to it."""
    lamp = {**PANE, "origin": [-9, 9, 2], "v": [0, -18, 0], "material": "lamp"}
    glow = {"lamp": {**LAMP, "emission": 2}}
    panes = [PANE, {**PANE, "origin": [-9, -9, 1.5]}]
    clear = {**GLASS, "ior": 1}  # it reflects nothing
    x = 9 / math.hypot(9, 2)
    seen = 4 / math.pi * x * math.atan(x)  # of the hemisphere, weighted by the cosine
    for bounces, expected in ((1, 0), (2, 0), (3, 1)):
        found = lit(gpu, [lamp, *panes], clear, 1 << 10, materials=glow, estimator=estimator, max_bounces=bounces)
        np.testing.assert_allclose(found, expected * 0.5 * 2 * seen, rtol=0.01)


@pytest.mark.parametrize("more", [{"caustics": "light"}, {"caustics": "paths"}, {"filter_glossy": 0.3}])
def test_it_is_no_caustic_and_never_blurred(gpu: Renderer, more: Doc) -> None:
    """Neither what is traced from the lights nor a bias towards rough surfaces counts it again."""
    lamp = ball("lamp", (0, 0, 2), 0.1)
    bare, clear = (lit(gpu, [lamp, *pane], samples=256, caustics="paths") for pane in ([], [PANE]))
    np.testing.assert_allclose(lit(gpu, [lamp, PANE], samples=256, **more), clear, rtol=2e-3)
    np.testing.assert_allclose(clear / bare, passed(1, 1.5), rtol=5e-3)


@pytest.mark.slow
def test_the_estimators_agree(gpu: Renderer) -> None:
    """A sun of 10 degrees and a ball through a window, a bubble and a body; the camera looks through a pane, too."""
    sun = {"type": "directional", "direction": [-0.3, 0.2, -1], "irradiance": 3, "angular_diameter": 10}
    wide = {**FLOOR, "origin": [-2, -2, 0], "u": [4, 0, 0], "v": [0, 4, 0]}
    window = {**PANE, "origin": [-1.5, -1.5, 1.5], "u": [1.5, 0, 0], "v": [0, 3, 0]}
    body = {"type": "box", "min": [0.2, 0.2, 0.3], "max": [1.2, 1.2, 0.9], "material": "body"}
    before = {**PANE, "origin": [-2, -2, 3], "u": [2, 0, 0], "v": [0, 4, 0]}
    made = {"m": {**GLASS, "ior": 1.8, "base_color": [0.9, 0.7, 0.5]}, "floor": MATTE,
            "body": {**AIR, "attenuation_color": [0.3, 0.6, 0.9], "attenuation_distance": 0.5},
            "lamp": {**LAMP, "emission": 30}, "soap": {**AIR, "film_thickness": 300}}  # fmt: skip
    shapes = [wide, window, body, before, ball("lamp", (1, -1, 1), 0.3), ball("soap", (1, -1, 1), 0.5)]
    assert_estimators_agree(
        gpu, document(shapes, made, lights=[sun], camera={"position": [0, 0, 4], "target": [0, 0, 0]})
    )


def test_scenes_without_such_surfaces_have_none_of_it() -> None:
    def raised(material: Doc, **more: Any) -> bool:
        arrays = pack(parse_scene(scene([PANE], material, **more)), Images()).arrays
        return "HAS_STRAIGHT" in flags(arrays)

    assert raised(GLASS, lights=[POINT]) and raised(AIR, lights=[POINT])
    assert not raised({**GLASS, "thin_walled": False}, lights=[POINT])
    assert not raised({**GLASS, "roughness": 0.1}, lights=[POINT])
    assert not raised({**GLASS, "emission": 1}, lights=[POINT])
