"""Tables of the albedos of the layered models' lobes, for the terms that compensate the energy that they lose.

`gpu.tables.build.energy_tables` computes them into `energy.npz`. Runs without GL. The kernels' side is
`shaders/bsdf/energy.glsl`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

FILE = Path(__file__).with_name("energy.npz")
FACETS_FILE = Path(__file__).with_name("facets.npy")
FUZZ_FILE = Path(__file__).with_name("fuzz.npy")

MU_COUNT = 40  # cosines, as squares of equal steps
ETA_COUNT = 25  # indices 1..4; (eta - 1) / (eta + 1) as squares of equal steps
ALBEDO_SHAPE = (ETA_COUNT, 40, MU_COUNT)  # eta, roughness, cosine
STRETCHED_SHAPE = (16, 9, 19, 14, 18)  # eta, aspect, roughness, azimuth, cosine
MEAN_SHAPE = (2 * ETA_COUNT - 1, 1 + STRETCHED_SHAPE[1], 2 * ALBEDO_SHAPE[1] - 1)  # eta, round and aspect, roughness
AZIMUTH_POWER = 0.8  # azimuths from the short axis, as this power of equal steps: denser there
FACETS_SHAPE = (8, 24, MU_COUNT, 4)  # layer, roughness, cosine
SHEEN_SHAPE = (16, MU_COUNT)  # sheen roughness, cosine
LEAST_ASPECT = float(np.sqrt(0.1))  # at anisotropic = 1; aspects in the tables are equal ratios apart
LARGEST_ETA = 4.0
LEAST_SHEEN_ROUGHNESS = 0.27  # with less, the sheen's masking would let it reflect more than it receives
_X_END = (LARGEST_ETA - 1) / (LARGEST_ETA + 1)


@dataclass(frozen=True)
class Tables:
    """Shares of the light from a direction, float32.

    `albedo` (eta, roughness, mu, 4): reflected with Fresnel 1; with eta's, never too low; lost where glass is
    entered; lost where it is left. `stretched` (eta, aspect, roughness, azimuth, mu, 4): the same of stretched lobes,
    though seldom a little too low.
    `mean` (eta, round lobes and each aspect of stretched, roughness, 4): their cosine-weighted means; those of the
    loss are divided by the factor by which the true loss is greater, see `energy_tables`. `sheen` (roughness, mu):
    the albedo of sheen. `fuzz` (roughness, cosine, 3), even steps of both: two numbers of a linear transform of a
    cosine and the albedo, of a layer of fibres, fitted by Zeltner, Burley and Chiang in "Practical
    Multiple-Scattering Sheen Using Linearly Transformed Cosines" (2022); the figures are those of
    github.com/tizian/ltc-sheen, Apache-2.0.

    `facets` (layer, roughness, mu, 4): Gauss's rules for means over the facets of round lobes, by the cosine at them.
    Layers 0 and 1 are four cosines and their weights for the facets that reflect light from a direction, 2 and 3 the
    same for the cosine-weighted mean over all directions, 4 to 7 the same for all facets that the light meets.
    """

    albedo: np.ndarray
    stretched: np.ndarray
    mean: np.ndarray
    sheen: np.ndarray
    fuzz: np.ndarray
    facets: np.ndarray


def mu_nodes(count: int = MU_COUNT) -> np.ndarray:
    return np.linspace(0, 1, count) ** 2


def roughness_nodes(count: int = ALBEDO_SHAPE[1]) -> np.ndarray:
    """Roughnesses of the nodes, denser where lobes are narrow."""
    return np.linspace(0, 1, count) ** 1.5


def eta_at(x: np.ndarray) -> np.ndarray:
    """The index at a place 0..1 along the tables' axis: even steps of about the cosine at which all is reflected."""
    y = x**2 * _X_END
    return np.asarray((1 + y) / (1 - y))


def eta_nodes(count: int = ETA_COUNT) -> np.ndarray:
    return eta_at(np.linspace(0, 1, count))


def sheen_nodes(count: int) -> np.ndarray:
    return np.linspace(LEAST_SHEEN_ROUGHNESS, 1, count)


# Of uint16, modulo 65536: of smooth tables they are small and pack well. Along azimuth and cosine.
_SMOOTH = (3, 4)


def differences(table: np.ndarray) -> np.ndarray:
    for axis in _SMOOTH:
        table = np.diff(table, axis=axis, prepend=table.dtype.type(0))
    return table


def _summed(table: np.ndarray) -> np.ndarray:
    for axis in _SMOOTH:
        table = np.cumsum(table, axis=axis, dtype=table.dtype)
    return table


@lru_cache(maxsize=1)
def tables() -> Tables:
    """The tables in the package."""
    with np.load(FILE) as stored:
        found = {n: _summed(v) if n == "stretched" else v for n, v in stored.items()}
    found = {n: v if v.dtype == np.float32 else v / np.float32(65535) for n, v in found.items()}
    # The albedo with Fresnel 1 is the same for every index and is stored once.
    one = np.broadcast_to(found.pop("stretched_one"), STRETCHED_SHAPE)
    found["stretched"] = np.concatenate([one[..., None], found["stretched"]], -1)
    return Tables(**found, fuzz=np.load(FUZZ_FILE), facets=np.load(FACETS_FILE))
