"""The images of a scene as texels one after another, 8-bit ones and floats apart."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from gpu.layout.texture_records import Texels, level_texels
from service.colorimetry import decode_srgb
from service.document import Scene
from service.document.texture import (
    ImageTexture,
)
from service.formats import Assets, ImageData, at_fault
from service.pack.cache import PackCache, lasting
from service.pack.textures.uses import DECODED
from service.problems import AssetError, FieldError, InvalidDocument, escaped
from service.system.memory import takes

MAX_TEXELS = 2**27  # the texels of a texture of 16384 rows on the device
LEVELS_8BIT, LEVELS_FLOAT = 9, 20  # bytes for each texel while the levels of its image are made; measured
AT_ONCE = 2  # images that are read at a time, as `AssetLimits` has as many parsers


class TexelLimits(Protocol):
    @property
    def max_texels(self) -> int: ...


@dataclass(frozen=True)
class PackedTexels:
    """All images of a scene; `places`: `TextureReference.key` -> (first texel among those of its kind, image).

    The mip levels of those in `averaged` follow each image."""

    texels: np.ndarray
    floats: np.ndarray
    places: dict[str, tuple[int, ImageData]] = field(default_factory=dict)
    averaged: Mapping[str, Texels] = field(default_factory=dict)


def images_of(scene: Scene, assets: Assets) -> dict[str, ImageData]:
    """The images of all textures by their content, of unused ones too, so that a broken one is noticed."""
    shown = {name: texture for name, texture in scene.textures.items() if isinstance(texture, ImageTexture)}
    first = {texture.content: texture for texture in shown.values()}
    out: dict[str, ImageData] = {}
    errors = []
    with ThreadPoolExecutor(AT_ONCE) as pool:
        # In the caller's context, as lines of the log name its request.
        loading = {
            content: pool.submit(copy_context().run, assets.image, texture.asset, texture.layer or "")
            for content, texture in first.items()
        }
    for name, texture in shown.items():
        try:
            out[texture.content] = loading[texture.content].result()
        except AssetError as error:
            errors.append(FieldError(at_fault(error.place, f"/textures/{escaped(name)}/asset"), error.detail))
    if errors:
        raise InvalidDocument(errors)
    return out


def lay_out(
    wanted: dict[str, tuple[str, ImageData]],
    averaged: Mapping[str, Texels],
    cache: PackCache | None,
    limits: TexelLimits | None,
) -> PackedTexels:
    """The texels of images, by `TextureReference.key`, and the mip levels of those that are in `averaged`."""
    allowed = MAX_TEXELS if limits is None else limits.max_texels
    room, device_room = allowed, MAX_TEXELS
    for stored, (name, image) in wanted.items():
        height, width = image.pixels.shape[:2]
        whole = width * height + (level_texels(width, height) if stored in averaged else 0)
        if width * height > room or whole > device_room:
            left, setting = (room, " (SUNBOX_MAX_TEXELS)") if width * height > room else (device_room, "")
            detail = f"has {width} x {height} texels; this server has room for {left} more in a scene{setting}"
            raise InvalidDocument([FieldError(f"/textures/{escaped(name)}/asset", detail)])
        room, device_room = room - width * height, device_room - whole
    images = {stored: image for stored, (_, image) in wanted.items()}

    def made() -> PackedTexels:
        takes("texels", _needed(images, averaged))
        return _laid(images, averaged)

    if cache is None or not images or not all(map(lasting, images)):
        return made()
    key = tuple((stored, averaged.get(stored)) for stored in images)
    return cache.get(("texels", key), made)


def _needed(images: Mapping[str, ImageData], averaged: Mapping[str, Texels]) -> int:
    """The bytes that laying out images takes, with what the levels of some take while they are made."""
    total, working = 0, [0] * AT_ONCE
    for stored, image in images.items():
        height, width, channels = image.pixels.shape
        texels, value = width * height, 1 if image.is_8bit else 4
        total += 4 * value * texels + (value * channels * texels if stored.endswith(DECODED) else 0)
        if stored in averaged:
            total += 4 * value * level_texels(width, height)
            working.append((LEVELS_8BIT if image.is_8bit else LEVELS_FLOAT) * texels)
    return total + sum(sorted(working)[-AT_ONCE:])


def _laid(images: dict[str, ImageData], averaged: Mapping[str, Texels]) -> PackedTexels:
    places: dict[str, tuple[int, ImageData]] = {}
    ends = {True: 0, False: 0}
    for stored, image in images.items():
        height, width = image.pixels.shape[:2]
        places[stored] = ends[image.is_8bit], _decoded(image) if stored.endswith(DECODED) else image
        ends[image.is_8bit] += width * height + (level_texels(width, height) if stored in averaged else 0)
    out: dict[bool, np.ndarray] = {
        True: np.empty((ends[True], 4), np.uint8),
        False: np.empty((ends[False], 4), np.float32),
    }
    with ThreadPoolExecutor(AT_ONCE) as pool:
        for done in [
            pool.submit(_fill, out[image.is_8bit][first:], image, averaged.get(stored))
            for stored, (first, image) in places.items()
        ]:
            done.result()
    return PackedTexels(out[True], out[False], places, averaged)


def _fill(out: np.ndarray, image: ImageData, averaged: Texels | None) -> None:
    """Write an image and its mip levels into the first of the texels `out`."""
    height, width, channels = image.pixels.shape
    part = out[: width * height].reshape(height, width, 4)
    for k in range(3):  # which takes a quarter of the time of all at once; a grey one comes three times
        part[..., k] = image.pixels[..., min(k, channels - 1)]
    part[..., 3] = image.pixels[..., 3] if channels == 4 else 255 if image.is_8bit else 1
    if averaged is not None:
        from gpu.tables.mip_levels import mip_levels  # with numba, which scenes without images do not need

        at = width * height
        for level in mip_levels(part, averaged):
            texels = level.reshape(-1, 4)
            out[at : at + len(texels)] = texels
            at += len(texels)


def _decoded(image: ImageData) -> ImageData:
    """Linear floats from sRGB ones, such as those of a PNG of 16 bits; alpha stays as it is."""
    pixels = np.array(image.pixels, np.float32)
    pixels[..., :3] = decode_srgb(pixels[..., :3])
    return ImageData(pixels)
