"""What scenes share on the device is uploaded once, and is there as long as one of them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from gpu import Renderer, RenderSettings, SceneArrays
from gpu.device.uploads import Textures, UploadCache
from service.document import parse_scene
from service.pack import pack
from tests.rendering import Images, document

BALL = {"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "m"}
SETTINGS = RenderSettings(width=16, height=16, max_bounces=3)


def lit(**sky: Any) -> SceneArrays:
    scene = document([BALL], environment={"type": "sky", "sun_azimuth": 0, "sun_elevation": 30, **sky})
    return pack(parse_scene(scene), Images()).arrays


def alone(arrays: SceneArrays) -> SceneArrays:
    assert arrays.environment is not None
    return replace(arrays, environment=replace(arrays.environment, key=""))


def rendered(gpu: Renderer, scene: Any) -> np.ndarray:
    picture = gpu.picture(scene, SETTINGS)
    picture.trace(600.0, 4)
    out = picture.read()
    picture.release()
    return out


def test_scenes_under_one_environment_share_its_upload_and_render_the_same_bits(gpu: Renderer) -> None:
    before = gpu.shared_bytes
    first = gpu.load(lit())
    size = gpu.shared_bytes - before
    turned = lit(rotation=90)
    second, own = gpu.load(turned), gpu.load(alone(turned))
    assert gpu.shared_bytes == before + size > before
    assert own.bytes > second.bytes == first.bytes
    first.release()
    np.testing.assert_array_equal(rendered(gpu, second), rendered(gpu, own))
    third = gpu.load(lit(sun_elevation=60))
    assert before + 1.5 * size < gpu.shared_bytes <= before + 2 * size  # the tables of energy are there once
    for each in (second, third, own):
        each.release()
    assert gpu.shared_bytes == before


def test_an_edit_takes_another_environment_and_leaves_the_old_one_to_the_others(gpu: Renderer) -> None:
    before = gpu.shared_bytes
    stays, edited = gpu.load(lit()), gpu.load(lit())
    size = gpu.shared_bytes - before
    edited.edit(replace(edited.arrays, environment=lit(sun_elevation=60).environment))
    assert before + 1.5 * size < gpu.shared_bytes <= before + 2 * size  # the tables of energy are there once
    picture = rendered(gpu, stays)
    stays.release()
    own = gpu.load(alone(lit()))
    np.testing.assert_array_equal(picture, rendered(gpu, own))
    for each in (edited, own):
        each.release()
    assert gpu.shared_bytes == before


class Upload(Textures):
    """Notes its release."""

    released = 0
    bytes = 3  # type: ignore[assignment]

    def release(self) -> None:
        self.released += 1


def test_the_upload_that_was_given_back_last_stays_until_another_is() -> None:
    cache, made = UploadCache[Textures](), [Upload() for _ in range(3)]
    first, second = cache.take("a", lambda: made[0]), cache.take("b", lambda: made[1])
    again = cache.take("a", lambda: made[2])
    assert again.upload is first.upload and cache.bytes == 6
    first.release()
    again.release()
    assert [each.released for each in made] == [0, 0, 0] and cache.bytes == 3
    second.release()
    assert [each.released for each in made] == [1, 0, 0] and cache.bytes == 0
    assert cache.take("b", lambda: made[2]).upload is made[1]
    cache.take("", lambda: made[2]).release()  # nobody else has it
    assert [each.released for each in made] == [1, 0, 1]
    cache.release()
    assert made[1].released == 1
