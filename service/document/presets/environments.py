"""Environments as latitude-longitude pictures: painted skies and photographers' studios. Radiance is relative, for
exposure 0.
"""

from __future__ import annotations

import math

import numpy as np

from service.document.presets.encoders import encode_exr

# Skies painted by hand: smooth gradients and a small, bright sun.
# The real sun is .53 degrees across, less than a texel. This one has the same share of the light in a disk of three
# texels, so that its shadows are soft but its place and brightness don't depend on where the texels fall.
SUN_RADIUS_DEGREES = 1.1
WIDTH, HEIGHT = 512, 256  # .7 degrees a texel: a softbox's edge is sharp enough, and a file has 0.8 MB


def clear_sky() -> bytes:
    """Noon: a high sun gives four times the irradiance of the sky."""
    d = directions()
    picture = _gradient(d, zenith=(0.11, 0.21, 0.44), horizon=(0.39, 0.46, 0.55), ground=(0.10, 0.09, 0.08))
    _sun(picture, d, toward(-130, 52), irradiance=(4.3, 4.0, 3.5), glow=(0.45, 0.42, 0.37), glow_power=40)
    return encode_exr(picture)


def sunset() -> bytes:
    """A low sun, red through a long way of air, before a sky from orange to violet."""
    d = directions()
    picture = _gradient(d, zenith=(0.10, 0.13, 0.30), horizon=(0.85, 0.42, 0.22), ground=(0.10, 0.08, 0.075))
    _sun(picture, d, toward(52, 7), irradiance=(6.0, 2.9, 0.95), glow=(2.2, 0.95, 0.30), glow_power=12)
    return encode_exr(picture)


def overcast() -> bytes:
    """The CIE overcast sky: three times as bright at the zenith as at the horizon [Moon and Spencer 1942]."""
    d = directions()
    height = d[:, :, 1]
    sky = (1 + 2 * np.clip(height, 0, 1)) / 3
    above = smoothstep(-0.02, 0.02, height)
    picture = (sky * above + 0.12 * (1 - above))[:, :, None] * np.array([1.18, 1.24, 1.32])
    return encode_exr(picture)


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


# Studios, for a subject seen from +Z: three softboxes in a dark grey room, or a single large one.
SOFTBOX_EDGE = 0.03  # half the width of a softbox's edge: below a texel it would alias into steps


def studio() -> bytes:
    """The classic three lights: a warm key from the left, a cool rim from behind on the right, a wide one above."""
    d = directions()
    # The room brightens from the floor up and never ends in a line: there is no corner in a studio's backdrop.
    room = 0.04 + 0.16 * smoothstep(-0.9, 0.9, d[:, :, 1])
    picture = room[:, :, None] * np.array([0.96, 0.98, 1.0])
    _hang(picture, d, toward(-128, 40), (0.55, 0.42), (5.6, 5.2, 4.7))
    _hang(picture, d, toward(62, 24), (0.13, 0.50), (5.2, 5.7, 6.3))
    _hang(picture, d, toward(180, 84), (0.70, 0.34), (1.5, 1.5, 1.55))
    return encode_exr(picture)


def softbox() -> bytes:
    """One large soft light from the left, and a rim behind on the right, above what a cyclorama hides."""
    d = directions()
    room = 0.08 + 0.2 * smoothstep(-0.6, 1.0, d[:, :, 1])
    picture = room[:, :, None] * np.array([0.97, 0.98, 1.0])
    _hang(picture, d, toward(-118, 40), (0.6, 0.57), (5.8, 5.6, 5.3))
    _hang(picture, d, toward(46, 50), (0.2, 0.5), (15.0, 15.8, 17.0))
    return encode_exr(picture)


def night_studio() -> bytes:
    """Almost dark: a soft glow on the backdrop behind the subject, and what a ceiling sends back."""
    d = directions()
    dark = 0.012 + 0.02 * smoothstep(-0.2, 1.0, d[:, :, 1])
    picture = dark[:, :, None] * np.array([0.85, 0.93, 1.1])
    across = np.degrees(np.arctan2(d[:, :, 0], -d[:, :, 2]))
    height = np.degrees(np.arcsin(d[:, :, 1]))
    glow = np.exp(-((across / 30) ** 2) - (height / 15) ** 2)
    wide = np.exp(-((across / 75) ** 2) - (height / 32) ** 2)
    picture += glow[:, :, None] * np.array([0.4, 0.26, 0.16]) + wide[:, :, None] * np.array([0.045, 0.048, 0.06])
    return encode_exr(picture)


def _hang(
    picture: np.ndarray,
    d: np.ndarray,
    center: np.ndarray,
    half_size: tuple[float, float],
    radiance: tuple[float, float, float],
) -> None:
    """Paints a rectangle that faces the middle from unit distance; `half_size` to the right and up."""
    right = np.cross(center, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, center)
    ahead = d @ center
    with np.errstate(divide="ignore", invalid="ignore"):
        x, y = np.abs(d @ right) / ahead, np.abs(d @ up) / ahead
    inside = (1 - smoothstep(half_size[0] - SOFTBOX_EDGE, half_size[0] + SOFTBOX_EDGE, x)) * (
        1 - smoothstep(half_size[1] - SOFTBOX_EDGE, half_size[1] + SOFTBOX_EDGE, y)
    )
    # A diffuser is brightest before its lamp: half a stop down to the corners.
    falloff = 1 / (1 + 0.4 * ((x / half_size[0]) ** 2 + (y / half_size[1]) ** 2) / 2)
    light = np.where(ahead > 0, inside * falloff, 0.0)[:, :, None]
    picture += light * (np.array(radiance) - picture)


def directions() -> np.ndarray:
    """(HEIGHT, WIDTH, 3): where texel centres lie. Row 0 is straight up, the middle column is -Z."""
    azimuth = ((np.arange(WIDTH) + 0.5) / WIDTH - 0.5) * 2 * math.pi
    polar = (np.arange(HEIGHT)[:, None] + 0.5) / HEIGHT * math.pi
    x, y, z = np.sin(polar) * np.sin(azimuth), np.cos(polar), -np.sin(polar) * np.cos(azimuth)
    return np.stack(np.broadcast_arrays(x, y, z), axis=-1)


def smoothstep(low: float, high: float, x: np.ndarray) -> np.ndarray:
    t = np.clip((x - low) / (high - low), 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def unit(x: float, y: float, z: float) -> np.ndarray:
    return np.array([x, y, z]) / math.sqrt(x * x + y * y + z * z)


def toward(azimuth_degrees: float, elevation_degrees: float) -> np.ndarray:
    """Unit direction; azimuth 0 is -Z, 90 is +X."""
    azimuth, elevation = math.radians(azimuth_degrees), math.radians(elevation_degrees)
    c = math.cos(elevation)
    return np.array([c * math.sin(azimuth), math.sin(elevation), -c * math.cos(azimuth)])
