"""Computes the tables of `gpu.energy`, by quadrature over visible normals: `python -m gpu.energy_tables`.

Five minutes of two cores; the result is kept in `energy.npz` beside this file, in steps of 1/65535.

Against quadrature at 6 000 random places from 0 to 87 degrees, index 1 to 4: round lobes put back at most .002 more
than is lost, and at most .005 less (index above 1.2: .011; near 1 .024). Stretched ones put back at most .003 more;
less by .005 on average of glass, by .03 in one direction of a hundred, by .07 at worst. What is less on average is
made good by the means: of round lobes all of it, of stretched ones what no direction gains by.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from gpu import energy
from gpu.energy import ALBEDO_SHAPE, ETA_COUNT, MEAN_SHAPE, STRETCHED_SHAPE
from gpu.energy_quadrature import albedos, sheen_albedo, sheen_fit
from gpu.jit import jit

_FINE = 120  # points a side of the quadrature over visible normals: an error of .0005
_CHECKED = 40  # of that between the nodes, and of stretched lobes: .001, at some places .003
SLACK = 0.001  # how far between nodes what is put back may pass what is lost: a third of what a furnace allows
SLACK_RESTORED = 0.002  # how far it may pass where the mean is made good
_MEDIUM = 60  # of the quadrature's points for that
_HELD_BACK = 5e-5  # of the mean: the quadrature's error
_LEAST_LOST = 0.003  # below, on average, there is nothing to make good
_SLACK_STRETCHED = 0.002  # the same there, where the quadrature is coarser
# At so many places in each cell of the stretched tables that is seen to, spread over its five axes [Roberts 2018].
_PLACES = 10
_SPREAD = 1.1347241384015194  # the root of x^6 = x + 1


@jit
def _fill(out: Any, eta: float, aspect: float, roughness: Any, cos_phi: Any, mu: Any, n: int) -> None:
    for r in range(len(roughness)):
        a = max(roughness[r] ** 2, 1e-7)
        for p in range(len(cos_phi)):
            for m in range(len(mu)):
                out[r, p, m] = albedos(mu[m], cos_phi[p], a / aspect, a * aspect, eta, n)


def _grid(axes: Sequence[np.ndarray], n: int) -> np.ndarray:
    """(eta, aspect, roughness, azimuth, mu, 4): what `albedos` says of the lobes on the grid of these."""
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


def _raised(nodes: np.ndarray, between: np.ndarray, f: np.ndarray) -> np.ndarray:
    """Values whose interpolation at f (a fraction of each axis' step) in every cell is nowhere below `between`."""
    at = [np.arange(n - 1) + x for n, x in zip(nodes.shape, f, strict=False)]
    lack = np.clip(between - _resized(nodes, *at), 0, None)
    for axis in range(len(at)):
        ends = [[(0, 0)] * lack.ndim for _ in range(2)]
        ends[0][axis], ends[1][axis] = (1, 0), (0, 1)
        lack = np.maximum(np.pad(lack, ends[0]), np.pad(lack, ends[1]))
    out: np.ndarray = np.minimum(nodes + lack, 1.0)
    return out


def _round_table() -> np.ndarray:
    """`Tables.albedo`: halfway between nodes no more is put back than is lost, and E by eta is never too low."""
    mu, roughness = energy.mu_nodes(), energy.roughness_nodes()
    out = _round(energy.eta_nodes(), roughness, mu, _FINE)
    steps = [2 * n - 1 for n in ALBEDO_SHAPE]
    fine = _round(energy.eta_nodes(steps[0]), energy.roughness_nodes(steps[1]), energy.mu_nodes(steps[2]), _CHECKED)
    out[..., 0] = _above(out[:1, ..., 0], fine[:1, ..., 0] - SLACK)
    out[..., 1] = _above(out[..., 1], fine[..., 1])
    for c in (2, 3):
        out[..., c] = 1 - _above(1 - out[..., c], 1 - fine[..., c] - SLACK)
    return out


# What places 0..1 along the axes of Tables.stretched stand for.
AXES: tuple[Callable[[np.ndarray], np.ndarray], ...] = (
    energy.eta_at,
    lambda x: 1.0 - x * (1.0 - energy.LEAST_ASPECT),
    lambda x: x**1.5,
    lambda x: np.sin(x ** (1 / energy.AZIMUTH_POWER) * np.pi / 2),
    lambda x: x**2,
)


def _stretched_table() -> np.ndarray:
    """`Tables.stretched`: between nodes no more is put back than is lost, and E by eta is never too low."""

    def kept(f: np.ndarray | None = None) -> np.ndarray:
        places = [np.linspace(0, 1, n) for n in STRETCHED_SHAPE]
        if f is not None:
            places = [(np.arange(n - 1) + x) / (n - 1) for n, x in zip(STRETCHED_SHAPE, f, strict=True)]
        found = _grid([at(x) for at, x in zip(AXES, places, strict=True)], _CHECKED)
        found[..., 2:] = 1 - found[..., 2:]
        return found

    out = kept()
    for k in range(_PLACES):
        f = (0.5 + k * _SPREAD ** -np.arange(1.0, 6.0)) % 1.0
        out = _raised(out, kept(f) - _SLACK_STRETCHED, f)
    out[..., 0] = out[..., 0].max(axis=0)
    out[..., 2:] = 1 - out[..., 2:]
    return out


def _means(albedo: np.ndarray, stretched: np.ndarray) -> np.ndarray:
    """Cosine-weighted means over the hemisphere of what the kernels interpolate of the other tables."""
    u = (np.arange(320) + 0.5) / 320  # roots of cosines
    weight = u**3 / (u**3).sum()  # 2 mu dmu with mu = u^2
    turn = (np.arange(32) + 0.5) / 32
    steps, azimuths, cosines = STRETCHED_SHAPE[2:]
    places = (
        np.linspace(0, steps - 1, MEAN_SHAPE[2]),
        turn**energy.AZIMUTH_POWER * (azimuths - 1),
        u * (cosines - 1),
    )
    rough = np.linspace(0, energy.ALBEDO_SHAPE[1] - 1, MEAN_SHAPE[2])
    mean = np.empty((*MEAN_SHAPE, 4))
    for e, x in enumerate(np.linspace(0, 1, MEAN_SHAPE[0])):
        of_round = _resized(albedo, np.array([x * (ETA_COUNT - 1)]), rough, u * (energy.MU_COUNT - 1))[0]
        mean[e, 0] = np.einsum("rmc,m->rc", of_round, weight)
        for s in range(1, MEAN_SHAPE[1]):
            values = _resized(_lerp(stretched[:, s], np.array([x * (STRETCHED_SHAPE[0] - 1)]), 0)[0], *places)
            mean[e, s] = np.einsum("rpmc,m->rc", values, weight) / len(turn)
    return mean


def _restored(true: np.ndarray, kept: np.ndarray, least: float) -> np.ndarray:
    """How much more is lost on average than the tables say, (..., P, M, 2) to (..., 2): at least `least`.

    In a dense body light is scattered index^2 times: there even .001 a time would show. Nowhere is more put back for
    it than `SLACK_RESTORED` above what is lost.
    """
    lost = true.mean((-3, -2))
    ratio = (lost - _HELD_BACK) / np.maximum(kept.mean((-3, -2)), 1e-9)
    bound = ((true + SLACK_RESTORED) / np.maximum(kept, 1e-9)).min((-3, -2))
    ratio = np.minimum(ratio, np.maximum(bound, 1.0)).clip(least, 1.1)
    return np.asarray(np.where(lost > _LEAST_LOST, ratio, 1.0))


def _restoring(albedo: np.ndarray, stretched: np.ndarray) -> np.ndarray:
    """`_restored` on the grid of `Tables.mean`."""
    etas, aspects, steps = MEAN_SHAPE
    mu = np.sqrt((np.arange(96) + 0.5) / 96)
    true = _round(energy.eta_nodes(etas), energy.roughness_nodes(steps), mu, _MEDIUM)[..., 2:]
    at = np.linspace(0, ETA_COUNT - 1, etas), np.linspace(0, energy.ALBEDO_SHAPE[1] - 1, steps)
    kept = _resized(albedo[..., 2:], *at, np.sqrt(mu) * (energy.MU_COUNT - 1))
    out = np.empty((*MEAN_SHAPE, 2))
    out[:, 0] = _restored(true[:, :, None], kept[:, :, None], 0.9)

    nodes = STRETCHED_SHAPE[0], aspects, 2 * STRETCHED_SHAPE[2] - 1
    of_axes = [np.linspace(0, 1, n) for n in nodes]
    mu, turn = np.sqrt((np.arange(20) + 0.5) / 20), (np.arange(12) + 0.5) / 12
    of_axes[1] = of_axes[1][1:]
    of_axes += [turn**energy.AZIMUTH_POWER, np.sqrt(mu)]
    true = _grid([f(x) for f, x in zip(AXES, of_axes, strict=True)], _MEDIUM)[..., 2:]
    kept = _resized(stretched[..., 2:], *(x * (n - 1) for x, n in zip(of_axes, STRETCHED_SHAPE, strict=True)))
    found = _restored(true, kept, 1.0)
    for s in range(1, aspects):
        places = [np.linspace(0, n - 1, m) for n, m in ((nodes[0], etas), (nodes[2], steps))]
        out[:, s] = _resized(found[:, s - 1], *places)
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
    """The tables of `gpu.energy.Tables`, float64 in 0..1."""
    albedo, stretched = _round_table(), _stretched_table()
    mean = _means(albedo, stretched)
    # Both factors of what is put back are too small by that much, and are divided by their mean.
    mean[..., 2:] /= _restoring(albedo, stretched)
    return {"albedo": albedo, "stretched": stretched, "mean": mean, "sheen": _sheen_table()}


if __name__ == "__main__":
    tables = compute()
    packed: dict[str, np.ndarray] = {}
    for name, values in tables.items():
        packed[name] = np.round(np.clip(values, 0, 1) * 65535).astype(np.uint16)
    packed["mean"] = tables["mean"].astype(np.float32)  # divided by, where it is small
    packed["stretched_one"], packed["stretched"] = packed["stretched"][0, ..., 0], packed["stretched"][..., 1:]
    np.savez_compressed(energy.FILE, **packed)  # type: ignore[arg-type]
