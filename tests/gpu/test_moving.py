"""What stands elsewhere is uploaded, and nothing else; the picture is that of a scene that was loaded so."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gpu import Renderer, RenderSettings, SceneArrays
from gpu.kernels import features
from gpu.layout import Instance, Node
from gpu.precompile import kernel_keys
from service.document import parse_scene
from service.pack import PackCache, pack, scene_edit
from service.pack import cache as pack_cache
from service.pack.geometry import instances
from tests.gpu.instanced import IMAGES, two

Doc = dict[str, Any]
MATTE = {"type": "diffuse", "albedo": 0.7}
BALL = {"type": "sphere", "center": [0, -1, 1], "radius": 0.3, "material": "m"}
LAMP = {"type": "quad", "origin": [0, 3, 0], "u": [1, 0, 0], "v": [0, 0, 1], "material": "lamp"}


@pytest.fixture(autouse=True)
def worth(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(instances, "WORTH", 0)


def scene(place: float = 1.1, ball: float = 0.0, lamp: float = 0.0, material: Doc = MATTE) -> Doc:
    made = two(material, {**BALL, "center": [ball, -1, 1]}, {**LAMP, "origin": [lamp, 3, 0]})
    made["shapes"][1]["transform"] = {"translate": [place, 0, 0.2], "rotate": [10, 0, 60], "scale": [-0.6, 1.2, 0.8]}
    made["materials"]["lamp"] = {"type": "diffuse", "albedo": 0, "emission": 4}
    return made


def arrays_of(document: Doc, cache: PackCache) -> SceneArrays:
    return pack(parse_scene(document), IMAGES, cache).arrays


@pytest.mark.parametrize(
    "changes, sent",
    [
        ({"place": 1.5}, Instance.dtype.itemsize + 8 * 3 * Node.dtype.itemsize),
        ({"ball": 0.4}, 48),
        ({"place": 0.6, "ball": -0.4, "lamp": 1.0}, 2000),
    ],
)
def test_what_moves_is_uploaded_and_nothing_else(gpu: Renderer, changes: dict[str, float], sent: int) -> None:
    cache = PackCache()
    old, new = (arrays_of(scene(**given), cache) for given in ({}, changes))
    assert len(new.instances) == 2
    difference = scene_edit(old, new)
    assert difference is not None
    loaded, fresh = gpu.load(old), gpu.load(new)
    loaded.edit(difference.apply(old))
    assert 0 < loaded.uploaded <= sent
    seen = []
    for each in (loaded, fresh):
        picture = gpu.picture(each, RenderSettings(48, 32, max_bounces=3))
        picture.trace(60.0, 4)
        seen.append(picture.read())
        picture.release()
        each.release()
    assert np.array_equal(*seen)


@pytest.mark.parametrize(
    "other",
    [
        {**scene(), "shapes": scene()["shapes"][1:]},
        scene(material={"type": "diffuse", "albedo": {"texture": "t"}}),
        {**scene(), "environment": {"type": "sky", "sun_elevation": 30, "sun_azimuth": 0}},
        {**scene(), "lights": []},
        {**scene(), "shapes": [{**shape, "smooth": False} for shape in scene()["shapes"] if shape["type"] == "mesh"]},
    ],
)
def test_what_else_differs_is_another_scene(other: Doc) -> None:
    cache = PackCache()
    assert scene_edit(arrays_of(scene(), cache), arrays_of(other, cache)) is None


def test_what_has_not_moved_sends_nothing(gpu: Renderer) -> None:
    cache = PackCache()
    old, new = (arrays_of(scene(), cache) for _ in range(2))
    difference = scene_edit(old, new)
    assert difference is not None
    loaded = gpu.load(old)
    loaded.edit(difference.apply(old))
    assert loaded.uploaded == 0
    loaded.release()


def test_a_large_mesh_that_a_stream_moves_becomes_an_instance(monkeypatch: pytest.MonkeyPatch) -> None:
    """From the first move on, with all others that are large; not before, and not where nothing is kept."""
    monkeypatch.setattr(instances, "WORTH", 10**9)
    monkeypatch.setattr(pack_cache, "HEAVY", 1280)
    cache, first = PackCache(), scene()
    assert not len(arrays_of(first, cache).instances)
    assert not len(arrays_of(scene(ball=1), cache).instances)
    turned = arrays_of(scene(place=1.4, ball=1), cache)
    assert len(turned.instances) == 2 and len(turned.triangles) == 1280
    again = arrays_of(scene(place=1.5, ball=1, material={**MATTE, "albedo": 0.3}), cache)
    assert scene_edit(turned, again) is not None and again.triangles is turned.triangles
    back = arrays_of(first, cache)
    assert len(back.instances) == 2 and scene_edit(again, back) is not None
    assert not len(pack(parse_scene(scene(place=1.4)), IMAGES).arrays.instances)
    assert not len(arrays_of({**first, "shapes": first["shapes"][2:]}, cache).instances)
    assert not len(arrays_of(first, cache).instances)


def test_a_small_mesh_that_moves_stays_among_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(instances, "WORTH", 10**9)
    cache = PackCache()
    for place in (1.1, 1.2, 1.3):
        assert not len(arrays_of(scene(place=place), cache).instances)


def test_the_kernel_that_a_move_will_need_is_foreseen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(instances, "WORTH", 10**9)
    for module in (pack_cache, kernel_keys):
        monkeypatch.setattr(module, "HEAVY", 1280)
    cache, settings = PackCache(), RenderSettings(48, 32)
    still, elsewhere = arrays_of(scene(), cache), arrays_of(scene(place=2.0), cache)
    assert len(elsewhere.instances) == 2
    foreseen = kernel_keys.key_after_move(still, settings)
    assert foreseen == kernel_keys.kernel_key(elsewhere, settings, features.flags(elsewhere, editing=True))
    assert kernel_keys.key_after_move(elsewhere, settings) is None
    assert kernel_keys.key_after_move(arrays_of({**scene(), "shapes": [BALL]}, cache), settings) is None
