"""How much of the light a table sends back from each direction, and what takes that down to all of it.

No surface reflects more than arrives, but measurements near grazing angles, where little light is divided by a small
cosine, often say so. Where they do, values are divided by the albedo of both of their directions where that is above
1: so the two directions remain exchangeable, and nothing else changes.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from service.formats.types import Doubles, Floats

ANGLES = 91  # from the normal, a degree apart
EXACT = 1.001  # the albedo to which sums over directions are right
WARNED_ABOVE = 1.01


def limits(theta: Doubles, albedo: Doubles) -> Floats:
    """Factors on values (ANGLES, 3) for each direction's angle, from the albedo (n, 3) at some angles; none where no
    albedo is above 1."""
    if (albedo <= EXACT).all():
        return np.zeros((0, 3), np.float32)
    angles = np.linspace(0, np.pi / 2, ANGLES)
    over = np.stack([np.interp(angles, theta, channel) for channel in albedo.T], axis=1)
    factors: Floats = (1 / np.maximum(over, 1.0)).astype(np.float32)
    return factors


def warnings(theta: Doubles, albedo: Doubles) -> Iterator[str]:
    most = albedo.max(axis=1)
    if (most > WARNED_ABOVE).any():
        at = int(most.argmax())
        first = np.degrees(theta[most > WARNED_ABOVE].min())
        yield (
            f"it reflects more light than arrives from {first:.0f} degrees on, up to {most[at]:.2f} times as much at "
            f"{np.degrees(theta[at]):.0f} degrees: there it is scaled down to all of it"
        )


def mean_albedo(theta: Doubles, albedo: Doubles) -> tuple[float, float, float]:
    """The share of light from all sides that comes back, per channel."""
    angles = np.linspace(0, np.pi / 2, ANGLES)
    weight = np.sin(2 * angles)
    r, g, b = (
        float((weight * np.clip(np.interp(angles, theta, channel), 0, 1)).sum() / weight.sum())
        for channel in albedo.T
    )
    return r, g, b
