"""Figures of how far two pictures differ, noise included: in linear luminance, and as a screen shows them; with
LDR-FLIP and the filters of both.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from service.colorimetry import LUMINANCE, decode_srgb, encode_srgb
from service.server.verdict.evidence import Array

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
class Differing:  # the pixels that are known to differ
    share: Annotated[float, Field(description="Of the pixels, those that are known to differ: 0 to 1.")]
    difference: Annotated[
        float, Field(description="The mean of their differences as displayed, noise included: 0 to 1.")
    ]


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
    """The figures of two pictures' mean radiance, (height, width, 3) each."""
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
    """The differing pixels of two pictures' mean radiance, by their `p_map`."""
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


# LDR-FLIP: how different two pictures look to somebody who flips between them [Andersson et al. 2020, "FLIP: A
# Difference Evaluator for Alternating Images", HPG]. Equations are those of the paper. The authors' package is not a
# dependency of the server: it brings Matplotlib along, and a test compares with it.
PIXELS_PER_DEGREE = 67.0  # section 4.1: a 0.7 m wide display of 3840 pixels, 0.7 m away
# Table 1: amplitudes and widths of the Gaussians of each channel's contrast sensitivity.
SENSITIVITY = (((1.0, 0.0047),), ((1.0, 0.0053),), ((34.1, 0.04), (13.5, 0.025)))
FEATURE_WIDTH = 0.082  # degrees, section 4.3
COLOUR_EXPONENT, FEATURE_EXPONENT = 0.7, 0.5
KNEE, AT_KNEE = 0.4, 0.95  # of the largest distance, and what it is mapped to: equation 12
XYZ = np.array(  # of linear Rec.709 [IEC 61966-2-1, as the authors' program has it]
    [
        [10135552 / 24577794, 8788810 / 24577794, 4435075 / 24577794],
        [2613072 / 12288897, 8788810 / 12288897, 887015 / 12288897],
        [1425312 / 73733382, 8788810 / 73733382, 70074185 / 73733382],
    ]
)
WHITE = XYZ @ np.ones(3)


def flip(a: Array, b: Array) -> Array:
    """(height, width) of 0 to 1; a and b are linear Rec.709 within 0 to 1 as displayed, (height, width, 3)."""
    opponent_a, opponent_b = _opponent(a), _opponent(b)
    colours = _distance(_hunt(_filtered(opponent_a)), _hunt(_filtered(opponent_b))) ** COLOUR_EXPONENT
    green, blue = _hunt(np.array([0.0, 1.0, 0.0])), _hunt(np.array([0.0, 0.0, 1.0]))
    largest = float(_distance(green, blue)) ** COLOUR_EXPONENT
    low = AT_KNEE / (KNEE * largest) * colours
    high = AT_KNEE + (colours - KNEE * largest) / (largest - KNEE * largest) * (1 - AT_KNEE)
    colours = np.where(colours < KNEE * largest, low, high)
    features = _feature_difference((opponent_a[..., 0] + 16) / 116, (opponent_b[..., 0] + 16) / 116)
    return np.asarray(np.clip(colours, 0.0, 1.0) ** (1 - features))


def _opponent(linear: Array) -> Array:
    """YCxCz, equations 1 to 3."""
    x, y, z = np.moveaxis(linear @ XYZ.T / WHITE, -1, 0)
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)


def _filtered(opponent: Array) -> Array:
    """The picture that the eye resolves, as linear Rec.709 within 0 to 1: equations 4 to 6."""
    radius = math.ceil(3 * math.sqrt(0.04 / (2 * math.pi**2)) * PIXELS_PER_DEGREE)
    seen = []
    for channel, terms in enumerate(SENSITIVITY):
        out, total = np.zeros(opponent.shape[:2]), 0.0
        for amplitude, width in terms:
            weights = gaussian(math.sqrt(width / (2 * math.pi**2)) * PIXELS_PER_DEGREE, radius)
            scale = amplitude * math.sqrt(math.pi / width)
            out += scale * convolved(opponent[..., channel], weights, weights)
            total += scale * float(weights.sum()) ** 2
        seen.append(out / total)
    y = (seen[0] + 16) / 116
    xyz = np.stack([y + seen[1] / 500, y, y - seen[2] / 200], axis=-1) * WHITE
    return np.clip(xyz @ np.linalg.inv(XYZ).T, 0.0, 1.0)


def _hunt(linear: Array) -> Array:
    """CIELAB, less colourful where it is darker: equation 8."""
    relative = linear @ XYZ.T / WHITE
    delta = 6 / 29
    root = np.where(relative > delta**3, np.cbrt(relative), relative / (3 * delta**2) + 4 / 29)
    x, y, z = np.moveaxis(root, -1, 0)
    lightness = 116 * y - 16
    return np.stack([lightness, 0.01 * lightness * 500 * (x - y), 0.01 * lightness * 200 * (y - z)], axis=-1)


def _distance(a: Array, b: Array) -> Array:
    """HyAB, equation 7."""
    d = a - b
    return np.asarray(np.abs(d[..., 0]) + np.hypot(d[..., 1], d[..., 2]))


def _feature_difference(a: Array, b: Array) -> Array:
    """The difference of edges or of points, whichever differ more: equation 13 and section 4.3."""
    sigma = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE
    radius = math.ceil(3 * sigma)
    smooth, x = gaussian(sigma, radius), np.arange(-radius, radius + 1)
    smooth = smooth / smooth.sum()
    edge, point = -x * smooth, ((x / sigma) ** 2 - 1) * smooth
    edge, point = _balanced(edge), _balanced(point)

    def found(luminance: Array, weights: Array) -> Array:
        across, down = convolved(luminance, weights, smooth), convolved(luminance, smooth, weights)
        return np.asarray(np.hypot(across, down))

    edges, points = (np.abs(found(a, weights) - found(b, weights)) for weights in (edge, point))
    return np.asarray((np.maximum(edges, points) / math.sqrt(2)) ** FEATURE_EXPONENT)


def _balanced(weights: Array) -> Array:
    """Weights whose positive ones sum up to 1, and the others to -1."""
    positive, negative = weights[weights > 0].sum(), -weights[weights < 0].sum()
    return np.asarray(np.where(weights > 0, weights / positive, weights / negative))


def convolved(values: Array, across: Array, down: Array) -> Array:
    """(height, width) values, each neighbour weighed by the product; both have an odd number of weights."""
    return _along(_along(values, across, 1), down, 0)


def gaussian(sigma: float, radius: int) -> Array:
    """Weights from -radius to radius, the middle one being 1."""
    x = np.arange(-radius, radius + 1)
    return np.asarray(np.exp(-0.5 * (x / sigma) ** 2))


def _along(values: Array, weights: Array, axis: int) -> Array:
    radius, count = len(weights) // 2, values.shape[axis]
    widths = [(radius, radius) if each == axis else (0, 0) for each in range(values.ndim)]
    padded = np.pad(values, widths, mode="edge")
    out = np.zeros_like(values)
    for k, weight in enumerate(weights):
        shifted = padded[k : k + count] if axis == 0 else padded[:, k : k + count]
        out += weight * shifted
    return out
