"""The images of a scene as texels one after another, 8-bit ones and floats apart."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from service.assets import Assets, ImageData
from service.colorimetry import decode_srgb
from service.pack.edits.cache import PackCache, lasting
from service.pack.textures.uses import DECODED
from service.problems import AssetError, FieldError, InvalidDocument, escaped
from service.scene import Scene
from service.scene.texture import (
    ImageTexture,
)

MAX_TEXELS = 2**27  # the texels of a texture of 16384 rows on the device
AT_ONCE = 2  # images that are read at a time, as `AssetLimits` has as many parsers


class TexelLimits(Protocol):
    @property
    def max_texels(self) -> int: ...


@dataclass(frozen=True)
class PackedTexels:
    """All images of a scene; `places`: `TextureReference.key` -> (first texel among those of its kind, image)."""

    texels: np.ndarray
    floats: np.ndarray
    places: dict[str, tuple[int, ImageData]] = field(default_factory=dict)


def images_of(scene: Scene, assets: Assets) -> dict[str, ImageData]:
    """The images of all textures by asset, of unused ones too, so that a broken one is noticed."""
    names = {name: texture.asset for name, texture in scene.textures.items() if isinstance(texture, ImageTexture)}
    out: dict[str, ImageData] = {}
    errors = []
    with ThreadPoolExecutor(AT_ONCE) as pool:
        # In the caller's context, as lines of the log name its request.
        loading = {
            asset: pool.submit(copy_context().run, assets.image, asset) for asset in dict.fromkeys(names.values())
        }
    for name, asset in names.items():
        try:
            out[asset] = loading[asset].result()
        except AssetError as error:
            errors.append(FieldError(f"/textures/{escaped(name)}/asset", error.detail))
    if errors:
        raise InvalidDocument(errors)
    return out


def lay_out(
    wanted: dict[str, tuple[str, ImageData]], cache: PackCache | None, limits: TexelLimits | None
) -> PackedTexels:
    room = MAX_TEXELS if limits is None else min(limits.max_texels, MAX_TEXELS)
    for name, image in wanted.values():
        height, width = image.pixels.shape[:2]
        if width * height > room:
            detail = f"has {width} x {height} texels; this server has room for {room} more in a scene"
            raise InvalidDocument([FieldError(f"/textures/{escaped(name)}/asset", detail)])
        room -= width * height
    images = {kept: image for kept, (_, image) in wanted.items()}
    if cache is None or not images or not all(map(lasting, images)):
        return _laid(images)
    return cache.get(("texels", tuple(images)), lambda: _laid(images))


def _laid(images: dict[str, ImageData]) -> PackedTexels:
    places: dict[str, tuple[int, ImageData]] = {}
    ends = {True: 0, False: 0}
    for kept, image in images.items():
        places[kept] = ends[image.is_8bit], _decoded(image) if kept.endswith(DECODED) else image
        ends[image.is_8bit] += image.pixels.shape[0] * image.pixels.shape[1]
    out: dict[bool, np.ndarray] = {
        True: np.empty((ends[True], 4), np.uint8),
        False: np.empty((ends[False], 4), np.float32),
    }
    for first, image in places.values():
        height, width, channels = image.pixels.shape
        part = out[image.is_8bit][first : first + width * height].reshape(height, width, 4)
        for k in range(3):  # which takes a quarter of the time of all at once; a grey one comes three times
            part[..., k] = image.pixels[..., min(k, channels - 1)]
        part[..., 3] = image.pixels[..., 3] if channels == 4 else 255 if image.is_8bit else 1
    return PackedTexels(out[True], out[False], places)


def _decoded(image: ImageData) -> ImageData:
    """Linear floats from sRGB ones, such as those of a PNG of 16 bits; alpha stays as it is."""
    pixels = np.array(image.pixels, np.float32)
    pixels[..., :3] = decode_srgb(pixels[..., :3])
    return ImageData(pixels)
