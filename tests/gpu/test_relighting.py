"""Another environment in the place of one is uploaded, and nothing else; the picture is that of a scene that was
loaded so."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gpu import OutOfMemory, Renderer, RenderSettings, Scene
from gpu.device import buffers
from service.document import parse_scene
from service.pack import PackCache, pack, scene_edit
from tests.documents import Shelf
from tests.documents import picture as image
from tests.rendering import document

Doc = dict[str, Any]
SUNNY = {"type": "sky", "sun_elevation": 30, "sun_azimuth": 0}
IMAGE = {"type": "image", "asset": "sha256:image"}


def lit(environment: Doc | None) -> Doc:
    floor = {"type": "quad", "origin": [-2, -1, 2], "u": [4, 0, 0], "v": [0, 0, -4], "material": "m"}
    lamp = {"type": "point", "position": [0, 3, 0], "intensity": 2}
    return document([floor], lights=[lamp], **({} if environment is None else {"environment": environment}))


@pytest.fixture(scope="module")
def shelf() -> Shelf:
    return Shelf(image=image(np.random.default_rng(1).random((32, 64, 3)) ** 8 * 50))


def seen(gpu: Renderer, scene: Scene) -> np.ndarray:
    picture = gpu.picture(scene, RenderSettings(32, 24, max_bounces=3))
    picture.trace(60.0, 4)
    out: np.ndarray = picture.read().copy()
    picture.release()
    return out


PAIRS: dict[str, tuple[Doc, Doc]] = {
    "a lower sun": (SUNNY, {**SUNNY, "sun_elevation": 5}),
    "a hazier sky": ({**SUNNY, "sun": False}, {**SUNNY, "sun": False, "turbidity": 8}),
    "more blur": ({**IMAGE, "blur": 6}, {**IMAGE, "blur": 25, "rotation": 40, "scale": 2}),
    "blur": (IMAGE, {**IMAGE, "blur": 12}),
    "no background": (IMAGE, {**IMAGE, "background": False}),
    "another colour": ({"type": "constant", "radiance": [1, 1, 1]}, {"type": "constant", "radiance": [3, 1, 0.2]}),
}


@pytest.mark.llvmpipe
@pytest.mark.parametrize("pair", PAIRS)
def test_another_environment_is_uploaded_and_nothing_else(gpu: Renderer, shelf: Shelf, pair: str) -> None:
    cache = PackCache()
    old, new = (pack(parse_scene(lit(environment)), shelf, cache).arrays for environment in PAIRS[pair])
    delta = scene_edit(old, new)
    assert delta is not None and delta.environment_map is new.environment and new.environment is not None
    assert delta.moved is not None and delta.moved.keys() <= {"lights", "radiance_scale"}
    loaded, fresh = gpu.load(old), gpu.load(new)
    loaded.edit(delta.apply(old))
    assert loaded.uploaded <= new.lights.nbytes
    assert np.array_equal(seen(gpu, loaded), seen(gpu, fresh))
    assert loaded.flags >= fresh.flags
    for each in (loaded, fresh):
        each.release()


OTHER_KINDS: dict[str, tuple[Doc | None, Doc | None]] = {
    "a sun": ({**SUNNY, "sun": False}, SUNNY),
    "no sun": (SUNNY, {**SUNNY, "sun": False}),
    "one colour": (IMAGE, {"type": "constant", "radiance": [1, 1, 1]}),
    "none": (IMAGE, None),
    "the first": (None, IMAGE),
}


@pytest.mark.parametrize("pair", OTHER_KINDS)
def test_another_kind_of_environment_is_another_scene(shelf: Shelf, pair: str) -> None:
    """Its kernel is another one."""
    cache = PackCache()
    old, new = (pack(parse_scene(lit(environment)), shelf, cache).arrays for environment in OTHER_KINDS[pair])
    assert scene_edit(old, new) is None


def test_where_memory_is_short_all_stays(gpu: Renderer, shelf: Shelf, monkeypatch: pytest.MonkeyPatch) -> None:
    cache = PackCache()
    old, new = (pack(parse_scene(lit(environment)), shelf, cache).arrays for environment in PAIRS["more blur"])
    loaded = gpu.load(old)
    before = seen(gpu, loaded)

    def full(*_: object) -> int:
        raise OutOfMemory("the device has no 1 MiB left")

    with monkeypatch.context() as patch, pytest.raises(OutOfMemory):
        patch.setattr(buffers, "move", full)
        loaded.edit(replace(old, environment=new.environment, lights=new.lights))
    assert np.array_equal(seen(gpu, loaded), before) and loaded.arrays is old
    loaded.release()
