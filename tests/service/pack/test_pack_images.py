"""A scene's images are read several at a time, and every broken one is named."""

from __future__ import annotations

import threading
from contextvars import ContextVar

import numpy as np
import pytest

from gpu.layout import texture_records
from service.document import parse_scene
from service.formats import ImageData
from service.pack import pack
from service.problems import AssetError, InvalidDocument
from tests.rendering import Images, document

QUAD = {"type": "quad", "origin": [-1, -1, 0], "u": [2, 0, 0], "v": [0, 2, 0], "material": "m0"}
PIXELS = np.random.default_rng(4).integers(0, 256, (4, 6, 3)).astype(np.uint8)
PATIENCE_S = 30.0
REQUEST = ContextVar("REQUEST", default="")


class Meeting(Images):
    """Each image is given once two are asked for."""

    def __init__(self) -> None:
        super().__init__(a=PIXELS, b=PIXELS[::-1])
        self._both = threading.Barrier(2, timeout=PATIENCE_S)
        self.requests: list[str] = []

    def image(self, ref: str, layer: str = "") -> ImageData:
        self._both.wait()
        self.requests.append(REQUEST.get())
        return super().image(ref, layer)


class Broken(Images):
    """No image whose name begins with "broken" can be read."""

    def image(self, ref: str, layer: str = "") -> ImageData:
        if ref.startswith("broken"):
            raise AssetError(f"{ref} can't be read")
        return super().image(ref, layer)


def textured(**assets: str) -> dict[str, object]:
    materials = {f"m{k}": {"type": "diffuse", "albedo": {"texture": name}} for k, name in enumerate(assets)}
    shapes = [{**QUAD, "material": name} for name in materials]
    return document(shapes, materials, textures={name: {"asset": asset} for name, asset in assets.items()})


def test_two_images_are_read_at_a_time() -> None:
    """For the request that the caller serves, which lines of the log name."""
    assets = Meeting()
    REQUEST.set("mine")
    arrays = pack(parse_scene(textured(first="a", second="b")), assets).arrays
    assert arrays.textures is not None
    height, width = PIXELS.shape[:2]
    assert len(arrays.textures.texels) == 2 * (width * height + texture_records.level_texels(width, height))
    assert assets.requests == ["mine", "mine"]


def test_every_texture_without_an_image_is_named_in_order() -> None:
    scene = parse_scene(textured(x="broken b", y="a", z="broken a", w="broken b"))
    with pytest.raises(InvalidDocument) as caught:
        pack(scene, Broken(a=PIXELS))
    found = [(error.pointer, error.detail) for error in caught.value.errors]
    assert found == [
        ("/textures/x/asset", "broken b can't be read"),
        ("/textures/z/asset", "broken a can't be read"),
        ("/textures/w/asset", "broken b can't be read"),
    ]
