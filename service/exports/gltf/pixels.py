"""Computed images: channels moved, colours encoded, a checker painted; all as 8-bit PNG."""

from __future__ import annotations

import io

import numpy as np

from service.colorimetry import decode_srgb, encode_srgb
from service.formats import ImageData
from service.formats.types import Floats

CHECKER = 256  # texels along a side of a painted checker, whose period is two squares
_LINEAR = decode_srgb(np.arange(256) / 255).astype(np.float32)


def channel(image: ImageData, k: int) -> np.ndarray:
    """(h, w): a channel as stored; a grey image has its one in place of red, green and blue, and alpha is 1."""
    count = image.pixels.shape[2]
    if k == 3 and count < 4:
        return np.full(image.pixels.shape[:2], 255 if image.is_8bit else 1, image.pixels.dtype)
    return np.asarray(image.pixels[..., k if k == 3 else min(k, count - 1)])


def encoded(stored: np.ndarray, is_srgb: bool, wants_srgb: bool) -> tuple[np.ndarray, bool]:
    """(h, w) bytes in the wanted encoding, and whether they stand for the same values."""
    if stored.dtype == np.uint8 and is_srgb == wants_srgb:
        return stored, True
    values: Floats = stored.astype(np.float32) / np.float32(255) if stored.dtype == np.uint8 else stored
    if is_srgb and not wants_srgb:
        values = _LINEAR[stored] if stored.dtype == np.uint8 else decode_srgb(values)
    values = np.clip(values, 0, 1)
    if wants_srgb and not is_srgb:
        values = encode_srgb(values)
    return np.rint(values * 255).astype(np.uint8), False


def constant(value: float, wants_srgb: bool) -> int:
    """A value within 0..1 as a byte."""
    return round(float(encode_srgb(np.array(value)) if wants_srgb else value) * 255)


def resized(texels: np.ndarray, height: int, width: int) -> np.ndarray:
    """(h, w) bytes at another size."""
    from PIL import Image

    return np.asarray(Image.fromarray(texels).resize((width, height), Image.Resampling.BILINEAR))


def checker() -> np.ndarray:
    """(n, n) of 0 and 1: one period, two squares by two, row 0 at v = 1. 0 is where u and v begin."""
    half = np.arange(CHECKER) >= CHECKER // 2
    return np.asarray(half[None, :] ^ ~half[:, None], np.uint8)


def png(planes: list[np.ndarray]) -> bytes:
    """A PNG of three or four planes (h, w) of bytes."""
    from PIL import Image

    out = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(np.stack(planes, axis=-1))).save(out, "PNG", compress_level=1)
    return out.getvalue()
