"""Heights in numbers, where they move a surface: what kernels sample, computed here."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from service.colorimetry import decode_srgb
from service.document import Scene
from service.document.color import LINEAR_OF_BYTE
from service.document.shape import MeshShape
from service.document.texture import CheckerTexture, HeightTexture, ImageTexture, is_projected
from service.formats import Assets, ImageData, at_fault
from service.problems import AssetError, FieldError, InvalidDocument, escaped

CHUNK = 1 << 18  # coordinates at a time, which bounds the memory that they take
LINEAR = np.array(LINEAR_OF_BYTE)


@dataclass(frozen=True)
class HeightField:
    """The heights of one material."""

    reference: HeightTexture
    texture: ImageTexture | CheckerTexture
    assets: Assets

    @property
    def uv_set(self) -> int:
        return self.texture.uv if isinstance(self.texture, ImageTexture) else 0

    def at(self, uvs: np.ndarray) -> np.ndarray:
        """(n,) metres at the coordinates (n, 2)."""
        out = np.empty(len(uvs))
        for start in range(0, len(uvs), CHUNK):
            some = slice(start, start + CHUNK)
            out[some] = self._texels(uvs[some].astype(np.float64))
        return np.asarray(self.reference.scale * (out - self.reference.midlevel))

    @cached_property
    def _image(self) -> tuple[np.ndarray, bool]:
        """The channel that is read (height, width), and whether it is to be decoded."""
        assert isinstance(self.texture, ImageTexture)
        image: ImageData = self.assets.image(self.texture.asset, self.texture.layer or "")
        channel = min("rgba".index(self.reference.channel), image.pixels.shape[2] - 1)
        return image.pixels[..., channel], self.texture.color_space == "srgb" and self.reference.channel != "a"

    def _texels(self, uv: np.ndarray) -> np.ndarray:
        texture = self.texture
        u, v = (factor * column for factor, column in zip(texture.scale, uv.T, strict=True))
        if isinstance(texture, CheckerTexture):
            return np.where((np.floor(u) + np.floor(v)) % 2 == 0, self._value(texture.a), self._value(texture.b))
        angle = math.radians(math.fmod(texture.rotation, 360.0))
        c, s = math.cos(angle), math.sin(angle)
        channel, is_srgb = self._image
        height, width = channel.shape
        x0, x1, x = _axis(c * u - s * v + texture.offset[0], width, texture.wraps[0])
        y0, y1, y = _axis(s * u + c * v + texture.offset[1], height, texture.wraps[1])

        def row(k: np.ndarray) -> np.ndarray:
            a, b = (_decoded(channel[height - 1 - k, at], is_srgb) for at in (x0, x1))
            return np.asarray(a + (b - a) * x)

        low, high = row(y0), row(y1)
        return np.asarray(low + (high - low) * y)

    def _value(self, color: tuple[float, ...]) -> float:
        return (*color, 1.0)["rgba".index(self.reference.channel)]


def wrapped(x: np.ndarray, wrap: str) -> np.ndarray:
    """Coordinates along one axis as a texture wraps them, 0..1."""
    if wrap == "clamp":
        return np.asarray(np.clip(x, 0.0, 1.0))
    if wrap == "mirror":
        return np.asarray(1 - np.abs(x - 2 * np.floor(x / 2) - 1))
    return np.asarray(x - np.floor(x))


def _axis(x: np.ndarray, n: int, wrap: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The two texels around x, and the share of the second, as `texture_axis` has them."""
    t = wrapped(x, wrap) * n - 0.5
    low = np.floor(t)
    first = low.astype(np.int64)
    if wrap == "repeat":
        return first % n, (first + 1) % n, t - low
    return np.clip(first, 0, n - 1), np.clip(first + 1, 0, n - 1), t - low


def _decoded(texels: np.ndarray, is_srgb: bool) -> np.ndarray:
    if texels.dtype == np.uint8:
        return LINEAR[texels] if is_srgb else texels / 255.0
    return np.asarray(decode_srgb(texels) if is_srgb else texels, np.float64)


def height_fields(scene: Scene, assets: Assets) -> dict[str, HeightField]:
    """The heights that move shapes, by material. Raises InvalidDocument."""
    wanted = {shape.material for shape in scene.shapes if isinstance(shape, MeshShape) and shape.displacement}
    out = {}
    for name in wanted:
        reference = scene.materials[name].height
        if reference is not None:
            texture = scene.textures[reference.texture]
            if not isinstance(texture, ImageTexture | CheckerTexture):
                detail = f"moves a mesh with displacement: must be an image or a checker, and not a {texture.type}"
                raise InvalidDocument([FieldError(f"/materials/{escaped(name)}/height/texture", detail)])
            if is_projected(texture):
                detail = f"moves a mesh with displacement: must have mapping 'uv', and not {texture.mapping!r}"
                raise InvalidDocument([FieldError(f"/textures/{escaped(reference.texture)}/mapping", detail)])
            out[name] = HeightField(reference, texture, assets)
            _check_channel(name, out[name])
    return out


def _check_channel(material: str, field: HeightField) -> None:
    if not isinstance(field.texture, ImageTexture):
        return
    try:
        channels = field.assets.image(field.texture.asset, field.texture.layer or "").pixels.shape[2]
    except AssetError as error:
        pointer = at_fault(error.place, f"/textures/{escaped(field.reference.texture)}/asset")
        raise InvalidDocument([FieldError(pointer, error.detail)]) from None
    if field.reference.channel == "a" and channels < 4:
        pointer = f"/materials/{escaped(material)}/height/channel"
        raise InvalidDocument([FieldError(pointer, f"texture {field.reference.texture!r} has no alpha")])
