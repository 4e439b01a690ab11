"""Figures of how far two pictures differ, noise included: in linear luminance, and as a screen shows them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from service.colorimetry import LUMINANCE, decode_srgb, encode_srgb
from service.server.verdict.evidence import Array
from service.server.verdict.filters import convolved, gaussian
from service.server.verdict.flip import flip

# Of SSIM [Wang et al. 2004]: the window's standard deviation and radius in pixels, and its two constants.
WINDOW, RADIUS, K1, K2 = 1.5, 5, 0.01, 0.03


@dataclass(frozen=True)
class Figures:
    mean_difference: float  # of b - a, linear luminance
    rmse: float  # of linear luminance
    psnr: float | None  # dB; None where the two are equal
    flip: float
    ssim: float


@dataclass(frozen=True)
class Differing:
    """The pixels that are known to differ."""

    share: float  # of all pixels
    difference: float  # the mean of theirs, of 0 to 1 as displayed, whatever its sign


def displayed(radiance: Array) -> Array:
    """(height, width, 3) of 0 to 1: sRGB as the default view shows it, over black."""
    return encode_srgb(np.clip(pbr_neutral(np.minimum(radiance, 1e37)), 0.0, 1.0))


def pbr_neutral(color: Array) -> Array:
    """The default tone map, as shaders/tonemap/pbr_neutral.glsl has it [Khronos PBR Neutral]."""
    start, desaturation = 0.8 - 0.04, 0.15
    least = color.min(axis=-1, keepdims=True)
    color = color - np.where(least < 0.08, least - 6.25 * least * least, 0.04)
    peak = color.max(axis=-1, keepdims=True)
    d = 1.0 - start
    high = np.maximum(peak, start)
    pressed = 1.0 - d * d / (high + d - start)
    g = 1.0 - 1.0 / (desaturation * (high - pressed) + 1.0)
    rolled = color / high * pressed
    return np.where(peak < start, color, rolled + (pressed - rolled) * g)


def figures(a: Array, b: Array) -> Figures:
    """Of two pictures' mean radiance, (height, width, 3) each."""
    difference = (b - a) @ LUMINANCE
    shown_a, shown_b = displayed(a), displayed(b)
    error = float(((shown_b - shown_a) ** 2).mean())
    return Figures(
        float(difference.mean()),
        float(np.sqrt((difference**2).mean())),
        -10.0 * math.log10(error) if error > 0 else None,
        float(flip_map(shown_a, shown_b).mean()),
        ssim(shown_a @ LUMINANCE, shown_b @ LUMINANCE),
    )


def flip_map(shown_a: Array, shown_b: Array) -> Array:
    """(height, width) of 0 to 1, of what `displayed` gives."""
    return flip(decode_srgb(shown_a), decode_srgb(shown_b))


def differing(a: Array, b: Array, p: Array, alpha: float) -> Differing:
    """Of two pictures' mean radiance and their `p_map`."""
    known = p < alpha
    apart = np.abs(displayed(b) - displayed(a)).mean(axis=-1)
    return Differing(float(known.mean()), float(apart[known].mean()) if known.any() else 0.0)


def ssim(a: Array, b: Array) -> float:
    """The mean structural similarity of two pictures in grey, (height, width) of 0 to 1; 1 where they are equal."""
    return float(ssim_map(a, b).mean())


def ssim_map(a: Array, b: Array) -> Array:
    """(height, width), of windows around each pixel."""
    weights = gaussian(WINDOW, RADIUS)
    weights = weights / weights.sum()

    def mean(values: Array) -> Array:
        return convolved(values, weights, weights)

    mean_a, mean_b = mean(a), mean(b)
    both, squares = mean_a * mean_b, mean_a**2 + mean_b**2
    covariance, variances = mean(a * b) - both, mean(a * a) + mean(b * b) - squares
    of_means, of_shapes = (2 * both + K1**2) / (squares + K1**2), (2 * covariance + K2**2) / (variances + K2**2)
    return np.asarray(of_means * of_shapes)
