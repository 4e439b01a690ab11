"""Computes the tables of `gpu.tables.energy`: `python -m gpu.tables.build.energy_tables`.

Quadrature over visible normals takes nine minutes of two cores; `energy.npz` holds the result, in steps of 1/65535.

The tables were compared with quadrature at 6 000 random places (stretched lobes: 4 096) from 0 to 87 degrees and
index 1 to 4. Round lobes put back at most 0.002 more than is lost, and at most 0.005 less (index above 1.2: 0.011;
near 1: 0.024). Stretched ones put back no less on average, 0.003 less in one direction of a hundred, 0.013 at worst;
and at most 0.002 more, except where light leaves glass: 0.003 in one of a thousand, 0.005 in one. The shortfall on
average is corrected by the means: for round lobes all of it, for stretched ones as far as no direction gains energy.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from gpu.jit import jit
from gpu.tables import energy
from gpu.tables.build.energy_fit import Samples, between, fitted, raised
from gpu.tables.build.energy_quadrature import albedos, sheen_albedo, sheen_fit
from gpu.tables.energy import ALBEDO_SHAPE, ETA_COUNT, MEAN_SHAPE, STRETCHED_SHAPE

_FINE = 120  # points a side of the quadrature over visible normals at the nodes: an error of 0.0005
_CHECKED = 40  # points a side between the nodes: an error of 0.001, at some places 0.003
_STRETCHED = 42  # points a side for stretched lobes
SLACK = 0.001  # by how much the energy put back may exceed the loss between nodes: a third of what a furnace allows
SLACK_RESTORED = 0.002  # the same where the mean is corrected
_MEDIUM = 60  # points a side of the quadrature for that
_NOT_RESTORED = 5e-5  # share of the mean that is not put back: the quadrature's error
_GRAZING = 0.05  # least cosine for stretched lobes: beyond 87 degrees their mean is not bounded
_LEAST_LOST = 0.003  # mean loss below which nothing is corrected
_MARGIN_STRETCHED = 0.0015  # how far below the truth the fit of stretched lobes costs nothing more
_SLACK_STRETCHED = 0.002  # how far below it they are raised
_PLACES = 8  # places in each cell of the stretched tables, spread over its five axes [Roberts 2018]
_SPREAD = 1.1347241384015194  # the root of x^6 = x + 1


@jit
def _fill(out: Any, eta: float, aspect: float, roughness: Any, cos_phi: Any, mu: Any, n: int) -> None:
    for r in range(len(roughness)):
        a = max(roughness[r] ** 2, 1e-7)
        for p in range(len(cos_phi)):
            for m in range(len(mu)):
                out[r, p, m] = albedos(mu[m], cos_phi[p], a / aspect, a * aspect, eta, n)


def _grid(axes: Sequence[np.ndarray], n: int) -> np.ndarray:
    """(eta, aspect, roughness, azimuth, mu, 4): the `albedos` of the lobes on the grid of these axes."""
    eta, aspect, roughness, cos_phi, mu = axes
    out = np.empty((*map(len, axes), 4))

    def fill(at: int) -> None:
        e, s = divmod(at, len(aspect))
        _fill(out[e, s], eta[e], aspect[s], roughness, cos_phi, mu, n)

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(fill, range(len(eta) * len(aspect))))
    return out


def _round(eta: np.ndarray, roughness: np.ndarray, mu: np.ndarray, n: int) -> np.ndarray:
    """(eta, roughness, mu, 4): the same of round lobes."""
    return np.asarray(_grid((eta, np.ones(1), roughness, np.ones(1), mu), n)[:, 0, :, 0])


def _lerp(table: np.ndarray, at: np.ndarray, axis: int) -> np.ndarray:
    """`table` at the fractional indices `at` along `axis`."""
    k = np.clip(at.astype(int), 0, table.shape[axis] - 2)
    low, high = np.take(table, k, axis), np.take(table, k + 1, axis)
    shape = [1] * low.ndim
    shape[axis] = len(at)
    f = (at - k).reshape(shape)
    out: np.ndarray = low * (1 - f) + high * f
    return out


def _resized(table: np.ndarray, *at: np.ndarray) -> np.ndarray:
    """`table` at the fractional indices `at` along its first axes."""
    for axis, places in enumerate(at):
        table = _lerp(table, places, axis)
    return table


def _doubled(table: np.ndarray) -> np.ndarray:
    """The table with the means between neighbours, along all its axes."""
    for axis in range(table.ndim):
        table = _lerp(table, np.arange(2 * table.shape[axis] - 1) / 2, axis)
    return table


def _above(nodes: np.ndarray, fine: np.ndarray) -> np.ndarray:
    """Values at the nodes whose linear interpolation is nowhere below `fine`, at the halves of all axes."""
    out = nodes.copy()
    for _ in range(4):
        lack = np.pad(np.clip(fine - _doubled(out), 0, None), 1)
        near = np.zeros_like(out)
        for at in np.ndindex(*(3,) * out.ndim):
            near = np.maximum(near, lack[tuple(slice(k, k + n, 2) for k, n in zip(at, fine.shape, strict=True))])
        out = np.clip(out + near, 0.0, 1.0)
    return out


def _round_table() -> np.ndarray:
    """`Tables.albedo`: halfway between nodes the energy put back is at most the loss, and E by eta is never too
    low."""
    mu, roughness = energy.mu_nodes(), energy.roughness_nodes()
    out = _round(energy.eta_nodes(), roughness, mu, _FINE)
    steps = [2 * n - 1 for n in ALBEDO_SHAPE]
    fine = _round(energy.eta_nodes(steps[0]), energy.roughness_nodes(steps[1]), energy.mu_nodes(steps[2]), _CHECKED)
    out[..., 0] = _above(out[:1, ..., 0], fine[:1, ..., 0] - SLACK)
    out[..., 1] = _above(out[..., 1], fine[..., 1])
    for c in (2, 3):
        out[..., c] = 1 - _above(1 - out[..., c], 1 - fine[..., c] - SLACK)
    return out


# The quantities for which places 0..1 along the axes of Tables.stretched stand.
AXES: tuple[Callable[[np.ndarray], np.ndarray], ...] = (
    energy.eta_at,
    lambda x: energy.LEAST_ASPECT**x,
    lambda x: x**1.5,
    lambda x: np.sin(x ** (1 / energy.AZIMUTH_POWER) * np.pi / 2),
    lambda x: x**2,
)


def _fractions() -> list[np.ndarray]:
    """Fractions of each axis' step at which the stretched tables are compared with quadrature.

    They are the nodes, places in the cells, and places in whole planes of nodes, as people set 1, not 0.97.
    """
    inner = [(0.5 + k * _SPREAD ** -np.arange(1.0, 6.0)) % 1.0 for k in range(_PLACES)]
    planes = [np.where(np.arange(5) < 3, 0.0, f) for f in inner[:4]]
    for k, axis in ((2, 1), (5, 1), (3, 2), (6, 2)):
        planes.append(np.where(np.arange(5) == axis, 0.0, inner[k]))
    return [np.zeros(5), *inner, *planes]


def _stretched_at(f: np.ndarray) -> np.ndarray:
    """The albedos of stretched lobes, float32, at those places of all cells."""
    counts = zip(STRETCHED_SHAPE, f, strict=True)
    places = [(np.arange(n - 1) + x) / (n - 1) if x > 0 else np.linspace(0, 1, n) for n, x in counts]
    found = _grid([at(x) for at, x in zip(AXES, places, strict=True)], _STRETCHED)
    found[..., 2:] = 1 - found[..., 2:]
    return found.astype(np.float32)


def _stretched_table(samples: Samples) -> np.ndarray:
    """`Tables.stretched`: between nodes hardly more energy is put back than is lost, and E by eta is hardly too
    low."""
    out = fitted(samples[0][1], samples, _MARGIN_STRETCHED)
    out = raised(out, samples, _SLACK_STRETCHED).astype(float)
    out[..., 0] = out[..., 0].max(axis=0)
    out[..., 2:] = 1 - out[..., 2:]
    return out


def _shares(at: np.ndarray, weight: np.ndarray, count: int) -> np.ndarray:
    """The share of each of `count` nodes in the sum of `weight` times a table interpolated at the indices `at`."""
    k = np.clip(at.astype(int), 0, count - 2)
    f = at - k
    return np.bincount(k, weight * (1 - f), count) + np.bincount(k + 1, weight * f, count)


def _means(albedo: np.ndarray, stretched: np.ndarray) -> np.ndarray:
    """Cosine-weighted means over the hemisphere of the other tables, interpolated as the kernels do it."""
    u = (np.arange(320) + 0.5) / 320  # roots of cosines
    weight = u**3 / (u**3).sum()  # 2 mu dmu with mu = u^2
    turn = (np.arange(32) + 0.5) / 32
    etas, _, steps, azimuths, cosines = STRETCHED_SHAPE
    of_mu = _shares(u * (energy.MU_COUNT - 1), weight, energy.MU_COUNT)
    of_azimuth = _shares(turn**energy.AZIMUTH_POWER * (azimuths - 1), np.full(32, 1 / 32), azimuths)
    of_cosine = _shares(u * (cosines - 1), weight, cosines)
    tables = [(np.einsum("ermc,m->erc", albedo, of_mu), ETA_COUNT, energy.ALBEDO_SHAPE[1])]
    for s in range(STRETCHED_SHAPE[1]):
        tables.append((np.einsum("erpmc,p,m->erc", stretched[:, s], of_azimuth, of_cosine), etas, steps))
    mean = np.empty((*MEAN_SHAPE, 4))
    for s, (table, rows, columns) in enumerate(tables):
        places = np.linspace(0, rows - 1, MEAN_SHAPE[0]), np.linspace(0, columns - 1, MEAN_SHAPE[2])
        mean[:, s] = _resized(table, *places)
    return mean


def _restored(true: np.ndarray, tabulated: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """How much more is lost on average than the tables say, (..., D, 2) to (..., 2); `weight` (D,) of directions.

    In a dense body light is scattered index^2 times, so that even 0.001 each time would show. Nowhere does this put
    back more than `SLACK_RESTORED` above the loss.
    """
    lost, found = (np.einsum("...dc,d->...c", x, weight / weight.sum()) for x in (true, tabulated))
    ratio = (lost - _NOT_RESTORED) / np.maximum(found, 1e-9)
    bound = ((true + SLACK_RESTORED) / np.maximum(tabulated, 1e-9)).min(-2)
    ratio = np.minimum(ratio, np.maximum(bound, 1.0)).clip(0.9, 1.1)
    return np.asarray(np.where(lost > _LEAST_LOST, ratio, 1.0))


def _restoring(albedo: np.ndarray, stretched: np.ndarray, samples: Samples) -> np.ndarray:
    """`_restored` on the grid of `Tables.mean`."""
    etas, _, steps = MEAN_SHAPE
    mu = np.sqrt((np.arange(96) + 0.5) / 96)
    true = _round(energy.eta_nodes(etas), energy.roughness_nodes(steps), mu, _MEDIUM)[..., 2:]
    at = np.linspace(0, ETA_COUNT - 1, etas), np.linspace(0, energy.ALBEDO_SHAPE[1] - 1, steps)
    tabulated = _resized(albedo[..., 2:], *at, np.sqrt(mu) * (energy.MU_COUNT - 1))
    out = np.empty((*MEAN_SHAPE, 2))
    out[:, 0] = _restored(true, tabulated, np.ones(len(mu)))

    trues: list[np.ndarray] = []
    kepts: list[np.ndarray] = []
    weights: list[np.ndarray] = []
    for f, sent_back in samples:
        if f[:3].any() or not f.any():
            continue
        turn, u = ((np.arange(n - 1) + x) / (n - 1) for n, x in zip(STRETCHED_SHAPE[3:], f[3:], strict=True))
        seen = u**2 >= _GRAZING
        found = between(stretched[..., 2:], f)
        for all_of, values in ((trues, 1 - sent_back[..., 2:].astype(float)), (kepts, found)):
            all_of.append(values[..., seen, :].reshape(*STRETCHED_SHAPE[:3], -1, 2))
        # Cosine times solid angle, in the tables' coordinates.
        weights.append(np.outer(turn ** (1 / energy.AZIMUTH_POWER - 1), u[seen] ** 3).ravel())
    of_nodes = _restored(np.concatenate(trues, -2), np.concatenate(kepts, -2), np.concatenate(weights))
    places = [np.linspace(0, n - 1, m) for n, m in ((STRETCHED_SHAPE[0], etas), (STRETCHED_SHAPE[2], steps))]
    for s in range(STRETCHED_SHAPE[1]):
        out[:, 1 + s] = _resized(of_nodes[:, s], *places)
    return out


def _sheen_table() -> np.ndarray:
    rough, mu = energy.sheen_nodes(2 * energy.SHEEN_SHAPE[0] - 1), energy.mu_nodes(2 * energy.MU_COUNT - 1)
    fine = np.empty((len(rough), len(mu)))
    for r, alpha in enumerate(rough**2):
        fit = np.array(sheen_fit(float(alpha)))
        for m, c in enumerate(mu):
            fine[r, m] = sheen_albedo(float(c), float(alpha), fit, 400)
    return _above(fine[::2, ::2], fine)


def compute() -> dict[str, np.ndarray]:
    """The tables of `gpu.tables.energy.Tables`, float64 in 0..1."""
    samples = [(f, _stretched_at(f)) for f in _fractions()]
    albedo, stretched = _round_table(), _stretched_table(samples)
    mean = _means(albedo, stretched)
    # Both factors of the energy that is put back are too small by that much, and are divided by their mean.
    mean[..., 2:] /= _restoring(albedo, stretched, samples)
    return {"albedo": albedo, "stretched": stretched, "mean": mean, "sheen": _sheen_table()}


if __name__ == "__main__":
    tables = compute()
    packed: dict[str, np.ndarray] = {}
    for name, values in tables.items():
        packed[name] = np.round(np.clip(values, 0, 1) * 65535).astype(np.uint16)
    packed["mean"] = tables["mean"].astype(np.float32)  # divided by, where it is small
    packed["stretched_one"], packed["stretched"] = packed["stretched"][0, ..., 0], packed["stretched"][..., 1:]
    packed["stretched"] = energy.differences(packed["stretched"])
    np.savez_compressed(energy.FILE, **packed)  # type: ignore[arg-type]
