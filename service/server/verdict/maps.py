"""Maps of where two pictures differ, as 8-bit pictures."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from service.colorimetry import LUMINANCE
from service.server.verdict.evidence import Array
from service.server.verdict.figures import displayed, flip_map
from service.views import MapKind

# Magma at equal steps, in bytes of sRGB; linear in between it is 5 % off at most [van der Walt and Smith 2015, CC0].
MAGMA = np.array(
    [
        (0, 0, 4), (16, 11, 45), (44, 17, 95), (81, 18, 124), (114, 31, 129), (147, 43, 128), (183, 55, 121),
        (216, 69, 108), (241, 96, 93), (252, 137, 97), (254, 176, 120), (254, 215, 153), (252, 253, 191),
    ],
    float,
)  # fmt: skip
FAINTEST = 0.35  # of the scale, of a p-value just below the threshold, so that it is seen
CERTAIN = 1e-12  # and less: the end of the scale
LEAST_SCALE = 1 / 255  # of the differences that are shown as the largest: smaller ones cannot be seen in a picture
OF_ALL = 99.9  # per cent of the pixels, whose differences the scale holds: one firefly does not darken the rest


def drawn(kind: MapKind, a: Array, b: Array, p: Array, alpha: float) -> npt.NDArray[np.uint8]:
    """(height, width, 3) of two pictures' mean radiance and their `p_map`.

    p: black where nothing is known to differ, brighter the more certain it is. difference: b - a as displayed, about
    a middle grey. flip: 0 to 1. heat: the difference in linear luminance, of any sign.
    """
    if kind == "difference":
        difference = displayed(b) - displayed(a)
        shown = 0.5 + 0.5 * np.clip(difference / _scale(np.abs(difference), LEAST_SCALE), -1, 1)
        return np.round(255 * shown).astype(np.uint8)
    if kind == "flip":
        return _coloured(flip_map(displayed(a), displayed(b)))
    if kind == "heat":
        heat = np.abs((b - a) @ LUMINANCE)
        return _coloured(heat / _scale(heat, 0.0))
    certain = min(CERTAIN, alpha / 10)
    share = np.log(alpha / np.maximum(p, certain)) / np.log(alpha / certain)
    return np.where((p < alpha)[..., None], _coloured(FAINTEST + (1 - FAINTEST) * share), 0).astype(np.uint8)


def _scale(values: Array, least: float) -> float:
    return max(float(np.percentile(values, OF_ALL)), least) or 1.0


def _coloured(values: Array) -> npt.NDArray[np.uint8]:
    steps = np.linspace(0, 1, len(MAGMA))
    shown = [np.interp(values, steps, MAGMA[:, channel]) for channel in range(3)]
    return np.round(np.stack(shown, axis=-1)).astype(np.uint8)
