"""A scene's big arrays are on a software device without a copy, and the picture is the same."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gpu import Renderer, RenderSettings
from gpu.arrays import SceneArrays
from gpu.device.pinned import LEAST, Pinned, pin
from gpu.device.scene import Scene
from service.document import parse_scene
from service.pack import pack

SIDE = 100  # vertices: 19 602 triangles, nearly a megabyte


class NoAssets:
    def mesh(self, ref: str) -> None: ...

    def image(self, ref: str, layer: str = "") -> None: ...

    def measured(self, ref: str) -> None: ...


def waves() -> SceneArrays:
    u, v = np.meshgrid(np.linspace(-1, 1, SIDE), np.linspace(-1, 1, SIDE), indexing="ij")
    vertices = np.stack([u, 0.2 * np.sin(5 * u) * np.cos(7 * v), v], axis=-1).reshape(-1, 3)
    i = np.arange(SIDE * SIDE).reshape(SIDE, SIDE)
    a, b, c, d = (part.ravel() for part in (i[:-1, :-1], i[1:, :-1], i[1:, 1:], i[:-1, 1:]))
    faces = np.concatenate([np.stack([a, d, c], axis=-1), np.stack([a, c, b], axis=-1)])
    document = {
        "version": 1,
        "camera": {"position": [0, 1.5, 2], "target": [0, 0, 0]},
        "environment": {"type": "constant", "radiance": 1},
        "materials": {"m": {"type": "diffuse", "albedo": 0.5}},
        "shapes": [{"type": "mesh", "vertices": vertices.tolist(), "faces": faces.tolist(), "material": "m"}],
    }
    return pack(parse_scene(document), NoAssets()).arrays  # type: ignore[arg-type]


def frozen(arrays: SceneArrays, writeable: bool) -> SceneArrays:
    copies = {name: getattr(arrays, name).copy() for name in ("triangles", "triangle_normals", "nodes")}
    for copy in copies.values():
        copy.flags.writeable = writeable
    return replace(arrays, **copies)


def pictured(gpu: Renderer, scene: Scene) -> np.ndarray:
    picture = gpu.picture(scene, RenderSettings(48, 48, 3))
    picture.trace(60.0, 4)
    pixels = picture.read("color")
    picture.release()
    scene.release()
    return pixels


def test_the_picture_is_the_same(gpu: Renderer) -> None:
    if not gpu.info["software"]:
        pytest.skip("a GPU has memory of its own")
    arrays = waves()
    assert arrays.triangles.nbytes > LEAST
    copied = gpu.load(frozen(arrays, writeable=True))
    assert not any(isinstance(buffer, Pinned) for buffer in copied._buffers.values())
    expected = pictured(gpu, copied)
    for _ in range(2):  # what the first one left must not be in the second one's way
        lent = gpu.load(frozen(arrays, writeable=False))
        assert sum(isinstance(buffer, Pinned) for buffer in lent._buffers.values()) >= 2
        assert np.array_equal(pictured(gpu, lent), expected)


def test_only_large_arrays_that_stay_as_they_are(gpu: Renderer) -> None:
    context = gpu.context
    large = np.zeros(LEAST, np.uint8)
    assert pin(context, large) is None
    large.flags.writeable = False
    assert pin(context, large[: LEAST // 2]) is None
    assert pin(context, np.broadcast_to(np.uint8(0), LEAST)) is None
