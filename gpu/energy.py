"""Tables of how much light the lobes of `principled` send back, for the terms that put back what they lose.

Computed by `gpu.energy_tables`, kept in `energy.npz`. Runs without GL. The kernels' side is `shaders/energy.glsl`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

FILE = Path(__file__).with_name("energy.npz")

MU_COUNT = 32  # cosines, as squares of equal steps
ETA_COUNT = 16  # indices 1..4; (eta - 1) / (eta + 1) as squares of equal steps
ROUGHNESS_END = 1.8  # the last node: a stretched lobe keeps as little as a round one beyond roughness 1
ALBEDO_SHAPE = (ETA_COUNT, 32, MU_COUNT)  # eta, roughness, cosine
ASPECT_SHAPE = (9, 16, 9, MU_COUNT)  # aspect, roughness, |cos phi|, cosine
MEAN_SHAPE = (ETA_COUNT, ASPECT_SHAPE[0], ALBEDO_SHAPE[1])  # eta, aspect, roughness
COMMON_ETA = 1.5  # what stretched glass loses is tabled for this index
SHEEN_SHAPE = (16, MU_COUNT)  # sheen roughness, cosine
LEAST_ASPECT = float(np.sqrt(0.1))  # at anisotropic = 1
LARGEST_ETA = 4.0
LEAST_SHEEN_ROUGHNESS = 0.27  # below, the sheen's masking lets it send back more than it receives
_X_END = (LARGEST_ETA - 1) / (LARGEST_ETA + 1)


@dataclass(frozen=True)
class Tables:
    """Shares of the light from a direction, float32.

    `albedo` (eta, roughness, mu, 4): reflected with Fresnel 1; with eta's, never too low; lost where glass is
    entered; lost where it is left. `mean` (eta, aspect, roughness, 4): their cosine-weighted means.
    `alike` (aspect, roughness, phi, mu, 4): the round roughness that stands for a stretched lobe, in units of
    ROUGHNESS_END; what that reflects with Fresnel 1; what it loses at COMMON_ETA, entered and left.
    `sheen` (roughness, mu): the sheen's, never too low.
    """

    albedo: np.ndarray
    alike: np.ndarray
    mean: np.ndarray
    sheen: np.ndarray


def mu_nodes() -> np.ndarray:
    return np.linspace(0, 1, MU_COUNT) ** 2


def roughness_nodes(count: int = ALBEDO_SHAPE[1], end: float = ROUGHNESS_END) -> np.ndarray:
    """Denser where lobes are narrow."""
    nodes: np.ndarray = np.linspace(0, 1, count) ** 1.5 * end
    return nodes


def eta_nodes() -> np.ndarray:
    x = np.linspace(0, 1, ETA_COUNT) ** 2 * _X_END
    return (1 + x) / (1 - x)


def sheen_nodes() -> np.ndarray:
    return np.linspace(LEAST_SHEEN_ROUGHNESS, 1, SHEEN_SHAPE[0])


@lru_cache(maxsize=1)
def tables() -> Tables:
    """The tables that travel with the package."""
    with np.load(FILE) as kept:
        return Tables(**{n: v if v.dtype == np.float32 else v / np.float32(65535) for n, v in kept.items()})
