"""sRGB and linear Rec.709 [IEC 61966-2-1], and the colours of spectra. This module imports nothing of the service, so
that parsers of files may load it; the renderer has its own in `gpu.layout` and `gpu.picture.display`."""

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


# Every ten nanometres from 380 on: the CIE 1931 standard observer of 2 degrees, and the illuminant D65 [CIE 018:2019,
# CIE 11664-1 and -2].
_NANOMETRES = np.arange(380.0, 781.0, 10.0)
_OBSERVER = np.array([
    *(0.001368, 0.000039, 0.00645, 0.004243, 0.00012, 0.02005, 0.01431, 0.000396, 0.06785, 0.04351, 0.00121, 0.2074),
    *(0.13438, 0.004, 0.6456, 0.2839, 0.0116, 1.3856, 0.34828, 0.023, 1.74706, 0.3362, 0.038, 1.77211),
    *(0.2908, 0.06, 1.6692, 0.19536, 0.09098, 1.28764, 0.09564, 0.13902, 0.81295, 0.03201, 0.20802, 0.46518),
    *(0.0049, 0.323, 0.272, 0.0093, 0.503, 0.1582, 0.06327, 0.71, 0.07825, 0.1655, 0.862, 0.04216),
    *(0.2904, 0.954, 0.0203, 0.43345, 0.99495, 0.00875, 0.5945, 0.995, 0.0039, 0.7621, 0.952, 0.0021),
    *(0.9163, 0.87, 0.00165, 1.0263, 0.757, 0.0011, 1.0622, 0.631, 0.0008, 1.0026, 0.503, 0.00034),
    *(0.85445, 0.381, 0.00019, 0.6424, 0.265, 0.00005, 0.4479, 0.175, 0.00002, 0.2835, 0.107, 0.0),
    *(0.1649, 0.061, 0.0, 0.0874, 0.032, 0.0, 0.04677, 0.017, 0.0, 0.0227, 0.00821, 0.0),
    *(0.011359, 0.004102, 0.0, 0.00579, 0.002091, 0.0, 0.002899, 0.001047, 0.0, 0.00144, 0.00052, 0.0),
    *(0.00069, 0.000249, 0.0, 0.000332, 0.00012, 0.0, 0.000166, 0.00006, 0.0, 0.000083, 0.00003, 0.0),
    *(0.000042, 0.000015, 0.0),
]).reshape(-1, 3)  # fmt: skip
_D65 = np.array([
    49.9755, 54.6482, 82.7549, 91.486, 93.4318, 86.6823, 104.865, 117.008, 117.812, 114.861, 115.923, 108.811,
    109.354, 107.802, 104.79, 107.689, 104.405, 104.046, 100.0, 96.3342, 95.788, 88.6856, 90.0062, 89.5991,
    87.6987, 83.2886, 83.6992, 80.0268, 80.2146, 82.2778, 78.2842, 69.7213, 71.6091, 74.349, 61.604, 69.8856,
    75.087, 63.5927, 46.4182, 66.8054, 63.3828,
])  # fmt: skip
_REC709_OF_XYZ = np.array(
    [
        [3.2404542, -1.5371385, -0.4985314],
        [-0.969266, 1.8760108, 0.041556],
        [0.0556434, -0.2040259, 1.0572252],
    ]
)
_RADIATION = 1.438776877e7  # nm K, the second constant
SPAN = (420.0, 680.0)  # nm: what a spectrum must have for its colour to be known


def reflected_color(wavelengths: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Weights (n, 3) whose sum over a spectrum is the linear Rec.709 colour in which it reflects daylight (D65): 1
    for a spectrum of ones. It runs straight between its wavelengths (n,), nm, and stays as it is beyond them."""
    fine = np.arange(_NANOMETRES[0], _NANOMETRES[-1] + 0.5, 1.0)
    lit = np.stack([np.interp(fine, _NANOMETRES, each * _D65) for each in _OBSERVER.T], axis=1)
    shares = np.stack([np.interp(fine, wavelengths, each) for each in np.eye(len(wavelengths))])
    weights = shares @ lit @ _REC709_OF_XYZ.T
    out: npt.NDArray[Any] = weights / weights.sum(axis=0)
    return out


def planck_color(kelvin: float) -> tuple[float, float, float]:
    """The colour of a black body, linear Rec.709 of luminance 1: what the observer sees of Planck's law, without what
    would be negative."""
    fine = np.arange(_NANOMETRES[0], _NANOMETRES[-1] + 0.5, 1.0)
    observer = np.stack([np.interp(fine, _NANOMETRES, each) for each in _OBSERVER.T], axis=1)
    spectrum = fine**-5.0 / np.expm1(_RADIATION / (fine * kelvin))
    rgb = np.maximum(_REC709_OF_XYZ @ (spectrum @ observer), 0)
    r, g, b = rgb / (LUMINANCE @ rgb)
    return float(r), float(g), float(b)
