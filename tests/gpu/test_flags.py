"""A flag for each piece of code that scenes can do without: a scene that raises it, its price, no pixel changed."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gpu import Renderer, RenderSettings
from gpu.analysis.kernel_cost import kernel_cost
from gpu.arrays import SceneArrays
from gpu.kernels.features import flags, grown
from gpu.kernels.flag_table import FLAGS
from gpu.precompile.kernel_keys import kernel_key, keys_after_edit
from service.document import parse_scene
from service.pack import Packed, pack
from tests.extremes.scenes import LONG, ball, icosphere
from tests.gpu.flag_scenes import FLOOR, IMAGES, LAMP, SCENES, Doc, T, lit, made_of
from tests.marks import seldom
from tests.rendering import document

pytestmark = pytest.mark.exact

ELSEWHERE = {"UVS_1", "TEXTURED_LIGHTS", "INSTANCES"}  # raised in the tests of glTF files, textured lights, instances


def _packed(name: str) -> Packed:
    return pack(parse_scene(SCENES[name]), IMAGES)


def test_every_flag_has_its_scene() -> None:
    assert {f"HAS_{name}" for name in (*SCENES, *ELSEWHERE)} == set(FLAGS)


@pytest.mark.parametrize("name", SCENES)
def test_the_scene_raises_it_and_the_plain_one_does_not(name: str) -> None:
    plain = flags(pack(parse_scene(document([])), IMAGES).arrays)
    assert f"HAS_{name}" in flags(_packed(name).arrays) - plain


def _render(gpu: Renderer, name: str, **how: Any) -> np.ndarray:
    return _seen(gpu, RenderSettings(48, 32, 3, roulette_depth=99), _packed(name).arrays, **how)


def _seen(gpu: Renderer, settings: RenderSettings, arrays: SceneArrays, **how: Any) -> np.ndarray:
    loaded = gpu.load(arrays, **how)
    assert loaded.flags >= how.get("raised", frozenset())
    made = gpu.picture(loaded, settings)
    made.trace(60.0, 8)
    image = made.read()
    made.release()
    loaded.release()
    return image


@pytest.mark.skipif(not LONG, reason="LLVM takes a minute for each; test_fallback compares with a kernel like it")
@pytest.mark.parametrize("name", SCENES)
def test_the_kernel_with_everything_shows_the_same(gpu: Renderer, name: str) -> None:
    images = [_render(gpu, name, everything=everything) for everything in (False, True)]
    # A rounding may turn a path at an edge: all but a few pixels agree to rounding, and their mean does.
    assert np.isclose(*images, rtol=1e-3, atol=1e-5).all(2).mean() > 0.985
    assert images[0].mean() == pytest.approx(images[1].mean(), rel=2e-3)


@pytest.mark.parametrize(
    ("name", "more"),
    [
        ("TEXTURES", ["TRANSMISSION"]),
        pytest.param("TRIANGLES", ["TEXTURES", "VERTEX_COLORS"], marks=pytest.mark.slow),
        pytest.param("TRANSMISSION", ["THIN_WALLS", "STRAIGHT"], marks=pytest.mark.slow),
    ],
)
def test_a_flag_more_shows_the_same(gpu: Renderer, name: str, more: list[str]) -> None:
    """Glass elsewhere does not change how opaque surfaces are sampled; corners without colours are white."""
    added = frozenset(f"HAS_{flag}" for flag in more)
    images = [_render(gpu, name, editing=True, raised=raised) for raised in (frozenset[str](), added)]
    assert np.isclose(*images, rtol=1e-3, atol=1e-5).all(2).mean() > 0.985


CLEAR = {"type": "principled", "transmission": 1, "roughness": 0}
CHECKS = {"type": "checker", "a": 0.1, "b": 0.9}


@pytest.mark.parametrize("estimator", seldom(["mis", "light"], ["light"]))
@pytest.mark.parametrize(
    "more",
    [
        {"attenuation_color": [0.5, 0.8, 0.9], "attenuation_distance": 1},
        *(pytest.param(more, marks=pytest.mark.slow) for more in ({}, {"alpha": 0.5}, {"base_color": T})),
    ],
)
def test_paths_go_through_mirrors_as_they_are_scattered(
    gpu: Renderer, monkeypatch: pytest.MonkeyPatch, more: Doc, estimator: Any
) -> None:
    """The loop of their own changes no picture but for the chances of glints: glass, a metal that mirrors, a lamp
    inside of the glass."""
    monkeypatch.setattr("gpu.device.scene.GLINT_CHANCE", 0.0)
    materials = {"glass": {**CLEAR, **more}, "metal": {"type": "principled", "metallic": 1, "roughness": 0},
                 "m": {"type": "diffuse", "albedo": 0.6}, "lamp": LAMP}  # fmt: skip
    shapes = [ball("glass"), FLOOR, ball("metal", (1.5, 0, -1), 0.7), ball("lamp", (0.2, 0.1, 0), 0.2)]
    scene = pack(parse_scene(lit(*shapes, materials=materials, textures={"t": CHECKS})), IMAGES).arrays
    assert "HAS_MIRRORS" in flags(scene) and "HAS_PRINCIPLED_LOBES" not in flags(scene)
    settings = RenderSettings(48, 32, 8, estimator=estimator, roulette_depth=2)
    images = [_seen(gpu, settings, scene)]
    monkeypatch.setitem(FLAGS, "HAS_MIRRORS", replace(FLAGS["HAS_MIRRORS"], asks=lambda _: False))
    monkeypatch.setitem(FLAGS, "HAS_PRINCIPLED_LOBES", replace(FLAGS["HAS_PRINCIPLED_LOBES"], asks=lambda _: True))
    images.append(_seen(gpu, settings, scene))
    assert np.isclose(*images, rtol=1e-3, atol=1e-5).all(2).mean() > 0.985
    assert images[0].mean() == pytest.approx(images[1].mean(), rel=2e-3)


def test_an_edit_waits_for_no_loop_that_it_can_do_without() -> None:
    rough, smooth = (flags(_packed(name).arrays, True) for name in ("TRANSMISSION", "MIRRORS"))
    assert smooth - rough == {"HAS_MIRRORS"}
    assert grown(rough, _packed("MIRRORS").arrays) == rough
    assert grown(smooth, _packed("TRANSMISSION").arrays) == smooth


@pytest.mark.parametrize("more", [{"transmission": 0.5}, {"anisotropic": 0.5}])
@pytest.mark.parametrize("shape", [ball("m"), icosphere("m", 1)], ids=["ball", "mesh"])
def test_the_first_touch_of_a_slider_is_foreseen(shape: Doc, more: Doc) -> None:
    """And whoever touched it already gets nothing compiled for that."""
    plastic, settings = {"type": "principled", "roughness": 0.3}, RenderSettings(48, 32)
    before, after = (pack(parse_scene(made_of({**plastic, **m}, shape)), IMAGES).arrays for m in ({}, more))
    wanted = kernel_key(after, settings, grown(flags(before, True), after))
    assert wanted in keys_after_edit(before, settings)
    assert wanted not in keys_after_edit(after, settings)


@pytest.mark.parametrize("model", ["disney", "diffuse", "principled"])
def test_the_first_touch_of_the_opacity_is_foreseen(model: str) -> None:
    settings, material = RenderSettings(48, 32), {"type": model} | ({"albedo": 0.5} if model == "diffuse" else {})
    before, after = (
        pack(parse_scene(made_of({**material, **m}, ball("m"))), IMAGES).arrays for m in ({}, {"alpha": 0.5})
    )
    wanted = kernel_key(after, settings, grown(flags(before, True), after))
    assert wanted in keys_after_edit(before, settings)
    assert wanted not in keys_after_edit(after, settings)


def test_no_slider_of_the_camera_asks_for_another_kernel() -> None:
    document, settings = made_of({"type": "disney"}, ball("m")), RenderSettings(48, 32)
    open_ = {**document, "camera": {**document["camera"], "aperture_radius": 0.1}}
    before, after = (pack(parse_scene(each), IMAGES).arrays for each in (document, open_))
    raised = flags(before, True)
    assert kernel_key(after, settings, grown(raised, after)) == kernel_key(before, settings, raised)
    assert "HAS_APERTURE" not in flags(before)


@pytest.mark.llvmpipe
def test_the_code_of_the_aperture_changes_no_bit_of_a_pinhole(gpu: Renderer) -> None:
    """A stream has it compiled in; the picture that a render makes of the same scene has the same bits."""
    document = made_of({"type": "diffuse", "albedo": 0.5}, ball("m"))
    camera = {"position": [0.3, 1.1, 4.2], "target": [0.1, 0.2, 0], "vfov": 37, "focus_distance": 2.7}
    arrays, pictures = pack(parse_scene({**document, "camera": camera}), IMAGES).arrays, []
    for editing in (False, True):
        scene = gpu.load(arrays, editing)
        picture = gpu.picture(scene, RenderSettings(48, 32, max_bounces=2))
        picture.trace(60.0, 4)
        pictures.append(picture.read())
        assert ("HAS_APERTURE" in scene.flags) == editing
        picture.release()
        scene.release()
    assert np.array_equal(*pictures)


@pytest.mark.slow
def test_what_a_scene_does_not_need_costs_it_nothing(gpu: Renderer) -> None:
    price = kernel_cost(gpu, _packed("CLEARCOAT").arrays)
    assert {"clearcoat", "disney", "spheres"} <= set(price.raised) and "bvh" in price.spared
    assert price.saving > 0.3  # .9 was measured
