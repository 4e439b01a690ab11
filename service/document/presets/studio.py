"""Photographers' studios, for a subject seen from +Z: three softboxes in a dark grey room, or a single large one."""

from __future__ import annotations

import numpy as np

from service.document.presets import exr
from service.document.presets.latlong import directions, smoothstep, toward

EDGE = 0.03  # half the width of a softbox's edge: below a texel it would alias into steps


def studio() -> bytes:
    """The classic three lights: a warm key from the left, a cool rim from behind on the right, a wide one above."""
    d = directions()
    # The room brightens from the floor up and never ends in a line: there is no corner in a studio's backdrop.
    room = 0.04 + 0.16 * smoothstep(-0.9, 0.9, d[:, :, 1])
    picture = room[:, :, None] * np.array([0.96, 0.98, 1.0])
    _hang(picture, d, toward(-128, 40), (0.55, 0.42), (5.6, 5.2, 4.7))
    _hang(picture, d, toward(62, 24), (0.13, 0.50), (5.2, 5.7, 6.3))
    _hang(picture, d, toward(180, 84), (0.70, 0.34), (1.5, 1.5, 1.55))
    return exr.encode(picture)


def softbox() -> bytes:
    """One large soft light from the left, and a rim behind on the right, above what a cyclorama hides."""
    d = directions()
    room = 0.08 + 0.2 * smoothstep(-0.6, 1.0, d[:, :, 1])
    picture = room[:, :, None] * np.array([0.97, 0.98, 1.0])
    _hang(picture, d, toward(-118, 40), (0.6, 0.57), (5.8, 5.6, 5.3))
    _hang(picture, d, toward(46, 50), (0.2, 0.5), (15.0, 15.8, 17.0))
    return exr.encode(picture)


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
    return exr.encode(picture)


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
    inside = (1 - smoothstep(half_size[0] - EDGE, half_size[0] + EDGE, x)) * (
        1 - smoothstep(half_size[1] - EDGE, half_size[1] + EDGE, y)
    )
    # A diffuser is brightest before its lamp: half a stop down to the corners.
    falloff = 1 / (1 + 0.4 * ((x / half_size[0]) ** 2 + (y / half_size[1]) ** 2) / 2)
    light = np.where(ahead > 0, inside * falloff, 0.0)[:, :, None]
    picture += light * (np.array(radiance) - picture)
