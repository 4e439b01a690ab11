"""Images that are turned into others: gloss into roughness, DirectX's normals into OpenGL's."""

from __future__ import annotations

import numpy as np

from service.formats.formats import sniff
from service.formats.images import encode
from service.formats.read.image import parse_image
from service.formats.types import AssetLimits

CHANNELS = "rgba"


def inverted(data: bytes, channel: str, limits: AssetLimits) -> bytes:
    """One minus a channel, as a grey image. Raises ParseError."""
    texels = _texels(data, limits)
    return _png(_complement(texels[..., place(texels, channel)][..., None]))


def turned(data: bytes, limits: AssetLimits) -> bytes:
    """A normal map whose green points the other way. Raises ParseError."""
    texels = _texels(data, limits)[..., :3].copy()
    texels[..., 1] = _complement(texels[..., 1])
    return _png(texels)


def is_transparent(data: bytes, limits: AssetLimits) -> bool:
    """True for an image with an alpha that is not 1 everywhere. Raises ParseError."""
    texels = _texels(data, limits)
    return texels.shape[2] == 4 and bool((texels[..., 3] < (255 if texels.dtype == np.uint8 else 1)).any())


def place(texels: np.ndarray, channel: str) -> int:
    """The last axis' index of a channel; 0 for a grey image, or where there is no alpha."""
    at = CHANNELS.index(channel or "r")
    return at if at < texels.shape[2] else 0


def _texels(data: bytes, limits: AssetLimits) -> np.ndarray:
    format = sniff(data)
    assert format is not None  # the importer takes only what it knows
    return parse_image(format, data, limits).pixels


def _complement(values: np.ndarray) -> np.ndarray:
    return 255 - values if values.dtype == np.uint8 else np.clip(1 - values, 0, 1)


def _png(texels: np.ndarray) -> bytes:
    """A PNG of 8 bits where the image had bytes, else of 16."""
    return encode(texels, "png", bits=8 if texels.dtype == np.uint8 else 16)
