"""A picture that was saved and restored goes on as if nothing had been; memory that is not there is refused."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import numpy as np
import pytest

from gpu import OutOfMemory, Picture, Renderer, RenderSettings, picture_bytes, scene_bytes
from gpu import context as contexts
from gpu.picture import picture as pictures
from service.document import parse_scene
from service.pack import pack
from tests.rendering import Images, document, picture

SCENE = document(
    [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "m"}],
    environment={"type": "constant", "radiance": 0.5},
)


def saved(picture: Picture) -> tuple[Any, int]:
    """What was saved, and in how many steps."""
    steps: Generator[None, None, Any] = picture.save()
    count = 0
    while True:
        try:
            next(steps)
            count += 1
        except StopIteration as end:
            return end.value, count


@pytest.mark.parametrize(("samples", "tiles"), [(4, 0), (4, 1), (0, 1)])
def test_it_goes_on_to_the_same_bits(
    gpu: Renderer, monkeypatch: pytest.MonkeyPatch, samples: int, tiles: int
) -> None:
    monkeypatch.setattr(pictures, "PIECE_BYTES", 5000)
    whole = picture(gpu, SCENE, 9)
    half = picture(gpu, SCENE, samples)
    for _ in range(tiles):  # in the middle of a pass
        half._passes._begin_pass(9)
        half._passes.schedule.took((0, 0, 32, 32), 1, 1024.0)  # so dear that a tile is a part of the picture
        half._passes._slice()
    (state, steps), half_way = saved(half), half.under_way
    assert state.samples == samples and steps > 3 * 32 * 32 * 16 // 5000
    half.release()
    again = gpu.picture(half.scene, half.settings)
    again.restore(state)
    assert again.samples == samples and again.under_way == half_way and (again.noise() is not None) == (samples > 0)
    again.trace(60.0, 9)
    for aov in ("color", "variance", "albedo"):
        assert np.array_equal(again.read(aov), whole.read(aov))
    assert again.noise() == whole.noise() and again.guided
    for made in (whole, again):
        made.release()


def test_what_it_takes(gpu: Renderer) -> None:
    small, large = RenderSettings(64, 64), RenderSettings(512, 512)
    assert picture_bytes(large) - picture_bytes(small) == 96 * (512 * 512 - 64 * 64)
    assert picture_bytes(large, guided=True) > picture_bytes(large)
    arrays = pack(parse_scene(SCENE), Images()).arrays
    assert scene_bytes(arrays) >= arrays.materials.nbytes + arrays.spheres.nbytes


def test_memory_that_is_not_there(gpu: Renderer) -> None:
    with pytest.raises(OutOfMemory, match="MiB"):
        contexts.allocate(gpu.context, 1 << 50)
    assert gpu.context.error == "GL_NO_ERROR"
    arrays = pack(parse_scene(SCENE), Images()).arrays
    scene = gpu.load(arrays)
    with pytest.raises(OutOfMemory, match="MiB"):
        gpu.picture(scene, RenderSettings(1 << 24, 1 << 14))
    scene.release()
