"""A renderer keeps to its thread and its context, and says what is wrong."""

from __future__ import annotations

import threading
from dataclasses import replace

import numpy as np
import pytest

from gpu import Renderer, RenderSettings, SceneTooLarge, WrongThread, layout
from service.document import parse_scene
from service.pack import pack
from tests.rendering import Images, document, picture

SCENE = document([], environment={"type": "constant", "radiance": 0.5})


def test_two_renderers_of_one_thread_do_not_mix(gpu: Renderer) -> None:
    first = picture(gpu, SCENE, 2)
    with Renderer() as other:
        assert picture(other, SCENE, 2).read()[0, 0, 0] == pytest.approx(0.5)
        first.trace(60, 4)
    assert first.read()[0, 0, 0] == pytest.approx(0.5)
    assert first.display()[0, 0, 3] == 255
    assert first.samples == 4
    first.release()


def test_another_thread_is_refused(gpu: Renderer) -> None:
    caught: list[Exception] = []

    def call() -> None:
        try:
            gpu.load(pack(parse_scene(SCENE), Images()).arrays)
        except WrongThread as error:
            caught.append(error)

    thread = threading.Thread(target=call)
    thread.start()
    thread.join()
    assert len(caught) == 1


def test_more_shapes_than_the_tree_can_name_are_refused(gpu: Renderer) -> None:
    arrays = pack(parse_scene(SCENE), Images()).arrays
    many = np.broadcast_to(np.zeros((), layout.Triangle.dtype), (layout.LEAF_FIRST_MASK + 1,))
    with pytest.raises(SceneTooLarge, match="triangles"):
        gpu.load(replace(arrays, triangles=many))


def test_a_picture_keeps_its_size(gpu: Renderer) -> None:
    made = picture(gpu, SCENE, 1)
    with pytest.raises(ValueError, match="size"):
        made.configure(RenderSettings(8, 8))


def test_the_same_seed_gives_the_same_bits(gpu: Renderer) -> None:
    scene = document(
        [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "m"}],
        environment={"type": "constant", "radiance": 0.5},
        lights=[{"type": "point", "position": [2, 2, 2], "intensity": 9}],
    )
    images = [picture(gpu, scene, 5, seed=seed).read() for seed in (3, 3, 4)]
    assert (images[0] == images[1]).all()
    assert not (images[0] == images[2]).all()
