"""AOVs that are not colour as pictures for the eye. Runs without GL."""

from __future__ import annotations

import numpy as np

from gpu.settings import ID_AOVS

# Degrees from which an angle of incidence has the colour, display-encoded. Reflectances stay near that of normal
# incidence up to 45 degrees and rise steeply from 75 [Lagarde 2013, "Memo on Fresnel equations"].
ZONES = ((0.0, (0.25, 0.6, 0.35)), (45.0, (0.95, 0.8, 0.3)), (75.0, (0.8, 0.25, 0.2)))


def srgb(linear: np.ndarray) -> np.ndarray:
    """sRGB encoding of 0..1 [IEC 61966-2-1]; clips."""
    x = np.clip(linear, 0, 1)
    out: np.ndarray = np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.maximum(x, 1e-12) ** (1 / 2.4) - 0.055)
    return out


def encode(aov: str, values: np.ndarray, dtype: str = "u1") -> np.ndarray:
    """(h, w, c) of an AOV as (h, w, 4) display values, opaque: albedo sRGB, normal 0.5 + 0.5 n, depth and variance
    divided by their maximum, ids in colours that differ between neighbours, incidence in a colour for each of
    ZONES."""
    if aov in ID_AOVS:
        shown = _coloured(values)
    elif aov == "incidence":
        shown = _zones(values)
    elif aov == "albedo":
        shown = srgb(values)
    elif aov == "normal":
        shown = 0.5 + 0.5 * values
    else:
        top = float(values.max(initial=0))
        shown = values / top if top > 0 else values
    if shown.shape[2] == 1:
        shown = np.repeat(shown, 3, axis=2)
    out = np.ones((*values.shape[:2], 4), np.float32)
    out[..., :3] = np.clip(shown, 0, 1)
    return out if dtype == "f4" else np.round(out * 255).astype(np.uint8)


def _coloured(ids: np.ndarray) -> np.ndarray:
    """(h, w, 1) whole numbers as (h, w, 3): hues a golden section apart, so that a few differ clearly. 0 is black."""
    hue = 2 * np.pi * ((ids.astype(np.float64) * 0.6180339887498949) % 1)
    phase = np.array([0, 2, 4]) * np.pi / 3
    return np.where(ids > 0, 0.55 + 0.4 * np.cos(hue - phase), 0.0)


def _zones(degrees: np.ndarray) -> np.ndarray:
    """(h, w, 1) angles as (h, w, 3) in the colours of ZONES; an angle of 0, where no surface is, is black."""
    shown = np.zeros((*degrees.shape[:2], 3))
    for least, color in ZONES:
        shown[(degrees[..., 0] > 0) & (degrees[..., 0] >= least)] = color
    return shown
