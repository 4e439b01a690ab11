"""sRGB and linear Rec.709 [IEC 61966-2-1]. This module imports nothing of the service, so that parsers of files may
load it; the renderer has its own in `gpu.layout` and `gpu.picture.display`."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # weights of linear Rec.709


def decode_srgb(encoded: npt.ArrayLike) -> npt.NDArray[Any]:
    """Linear values of sRGB-encoded ones, in the same shape."""
    values = np.asarray(encoded)
    curved = ((np.maximum(values, 0) + 0.055) / 1.055) ** 2.4
    return np.where(values <= 0.04045, values / 12.92, curved)


def encode_srgb(linear: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """sRGB encoding of linear values that are not negative, in the same shape."""
    return np.where(linear <= 0.0031308, linear * 12.92, 1.055 * linear ** (1 / 2.4) - 0.055)
