"""Skies painted by hand: smooth gradients and a small, bright sun. Radiance is relative, for exposure 0."""

from __future__ import annotations

import math

import numpy as np

from service.document.presets import exr
from service.document.presets.latlong import directions, smoothstep, toward

# The real sun is .53 degrees across, less than a texel. This one has the same share of the light in a disk of three
# texels, so that its shadows are soft but its place and brightness don't depend on where the texels fall.
SUN_RADIUS_DEGREES = 1.1


def clear_sky() -> bytes:
    """Noon: a high sun gives four times the irradiance of the sky."""
    d = directions()
    picture = _gradient(d, zenith=(0.11, 0.21, 0.44), horizon=(0.39, 0.46, 0.55), ground=(0.10, 0.09, 0.08))
    _sun(picture, d, toward(-130, 52), irradiance=(4.3, 4.0, 3.5), glow=(0.45, 0.42, 0.37), glow_power=40)
    return exr.encode(picture)


def sunset() -> bytes:
    """A low sun, red through a long way of air, before a sky from orange to violet."""
    d = directions()
    picture = _gradient(d, zenith=(0.10, 0.13, 0.30), horizon=(0.85, 0.42, 0.22), ground=(0.10, 0.08, 0.075))
    _sun(picture, d, toward(52, 7), irradiance=(6.0, 2.9, 0.95), glow=(2.2, 0.95, 0.30), glow_power=12)
    return exr.encode(picture)


def overcast() -> bytes:
    """The CIE overcast sky: three times as bright at the zenith as at the horizon [Moon and Spencer 1942]."""
    d = directions()
    height = d[:, :, 1]
    sky = (1 + 2 * np.clip(height, 0, 1)) / 3
    above = smoothstep(-0.02, 0.02, height)
    picture = (sky * above + 0.12 * (1 - above))[:, :, None] * np.array([1.18, 1.24, 1.32])
    return exr.encode(picture)


def _gradient(
    d: np.ndarray, zenith: tuple[float, ...], horizon: tuple[float, ...], ground: tuple[float, ...]
) -> np.ndarray:
    height = d[:, :, 1, None]
    # Air thickens towards the horizon as 1 / height: an exponential is close to what is seen, and smooth.
    haze = np.exp(-4.0 * np.clip(height, 0, 1))
    sky = np.array(zenith) * (1 - haze) + np.array(horizon) * haze
    above = smoothstep(-0.03, 0.01, height)
    return np.asarray(sky * above + np.array(ground) * (1 - above))


def _sun(
    picture: np.ndarray,
    d: np.ndarray,
    center: np.ndarray,
    irradiance: tuple[float, ...],
    glow: tuple[float, ...],
    glow_power: float,
) -> None:
    """Adds a disk with this irradiance on a surface that faces it, and forward-scattered light around it."""
    cosine = np.clip(d @ center, 0, 1)
    angle = np.degrees(np.arccos(cosine))
    above = smoothstep(-0.03, 0.01, d[:, :, 1])
    picture += (above * cosine**glow_power)[:, :, None] * np.array(glow)
    disk = 1 - smoothstep(SUN_RADIUS_DEGREES - 0.4, SUN_RADIUS_DEGREES + 0.4, angle)
    height, width = angle.shape
    polar = (np.arange(height)[:, None] + 0.5) / height * math.pi
    solid_angle = np.sin(polar) * (math.pi / height) * (2 * math.pi / width)
    # Divided by what the texels really cover: the same light wherever the disk falls on the grid.
    picture += disk[:, :, None] * (np.array(irradiance) / (disk * solid_angle).sum())
