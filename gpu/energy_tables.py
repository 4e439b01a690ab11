"""Computes the tables of `gpu.energy`, by quadrature over visible normals: `python -m gpu.energy_tables`.

A minute of one core; the result is kept in `energy.npz` beside this file, in steps of 1/65535. Round metal and glass
made with it hold .99 to 1.003 of a white furnace at cosines from .15, stretched metal and glass of index 1.5 .97.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gpu import energy
from gpu.energy import ALBEDO_SHAPE, ASPECT_SHAPE, ETA_COUNT, MEAN_SHAPE, ROUGHNESS_END
from gpu.jit import jit

_FINE = 72  # points a side of the quadrature over visible normals


@jit
def _fresnel(c: float, eta: float) -> float:
    """Unpolarised reflectance of a dielectric, eta = index beyond over index before."""
    g2 = eta * eta - 1.0 + c * c
    if g2 <= 0.0:
        return 1.0
    g = math.sqrt(g2)
    s, p = (c - g) / (c + g), (eta * eta * c - g) / (eta * eta * c + g)
    return 0.5 * (s * s + p * p)


@jit
def _lambda(x: float, y: float, z: float) -> float:
    return 0.5 * (math.sqrt(x * x + y * y + z * z) / abs(z) - 1.0)


@jit
def _albedos(
    mu: float, cos_phi: float, ax: float, ay: float, eta: float, n: int
) -> tuple[float, float, float, float]:
    """Of single scattering from direction (mu, phi): all reflected, reflected by eta, and lost by eta and by 1 / eta.

    Visible normals by spherical caps [Dupuy & Benyoub 2023]; masking of two directions on one side by heights
    correlated, across the surface by the product of both [Walter et al. 2007].
    """
    z = max(mu, 1e-5)
    sin = math.sqrt(max(0.0, 1.0 - z * z))
    x, y = sin * cos_phi, sin * math.sqrt(max(0.0, 1.0 - cos_phi * cos_phi))
    lam_o = _lambda(ax * x, ay * y, z)
    length = math.sqrt((ax * x) ** 2 + (ay * y) ** 2 + z * z)
    vx, vy, vz = ax * x / length, ay * y / length, z / length
    one = reflected = kept_a = kept_b = 0.0
    # Many rows, each turned against the last: seen head-on a whole row is lost or kept.
    rows, columns = 3 * n, n // 3
    for i in range(rows):
        cap = (1.0 - (i + 0.5) / rows) * (1.0 + vz) - vz
        r = math.sqrt(max(0.0, 1.0 - cap * cap))
        for j in range(columns):
            phi = 2.0 * math.pi * ((j + 0.5) / columns + 0.61803398875 * i)
            mx, my, mz = ax * (r * math.cos(phi) + vx), ay * (r * math.sin(phi) + vy), max(cap + vz, 0.0)
            scale = 1.0 / math.sqrt(mx * mx + my * my + mz * mz + 1e-300)
            mx, my, mz = mx * scale, my * scale, mz * scale
            c = x * mx + y * my + z * mz
            f_a, f_b = _fresnel(c, eta), _fresnel(c, 1.0 / eta)
            ix, iy, iz = 2.0 * c * mx - x, 2.0 * c * my - y, 2.0 * c * mz - z
            if iz > 0.0:
                g = (1.0 + lam_o) / (1.0 + lam_o + _lambda(ax * ix, ay * iy, iz))
                one += g
                reflected += f_a * g
                kept_a += f_a * g
                kept_b += f_b * g
            for side in range(2):
                k = 1.0 / eta if side == 0 else eta
                cos2 = 1.0 - k * k * (1.0 - c * c)
                if cos2 <= 0.0:
                    continue
                along = k * c - math.sqrt(cos2)
                tx, ty, tz = along * mx - k * x, along * my - k * y, along * mz - k * z
                if tz < 0.0:
                    g = 1.0 / (1.0 + _lambda(ax * tx, ay * ty, tz))
                    if side == 0:
                        kept_a += (1.0 - f_a) * g
                    else:
                        kept_b += (1.0 - f_b) * g
    s = 1.0 / (rows * columns)
    return one * s, reflected * s, 1.0 - kept_a * s, 1.0 - kept_b * s


@jit
def _fill_albedo(out: Any, mu: Any, roughness: Any, eta: Any, n: int) -> None:
    for e in range(len(eta)):
        for r in range(len(roughness)):
            a = max(roughness[r] ** 2, 1e-7)
            for m in range(len(mu)):
                out[e, r, m] = _albedos(mu[m], 1.0, a, a, eta[e], n)


@jit
def _fill_stretched(out: Any, mu: Any, cos_phi: Any, roughness: Any, aspect: Any, eta: float, n: int) -> None:
    for s in range(len(aspect)):
        for r in range(len(roughness)):
            a = max(roughness[r] ** 2, 1e-7)
            for p in range(len(cos_phi)):
                for m in range(len(mu)):
                    out[s, r, p, m] = _albedos(mu[m], cos_phi[p], a / aspect[s], a * aspect[s], eta, n)


@jit
def _sheen_lambda(c: float, a: float, b: float, k: float, d: float, e: float) -> float:
    return float(a / (1.0 + b * c**k) + d * c + e)


def sheen_fit(alpha: float) -> list[float]:
    """The five numbers of the sheen's masking, between a rough and a smooth set [Estevez & Kulla 2017, eq. 3]."""
    t = (1.0 - alpha) ** 2
    rough, smooth = (21.5473, 3.82987, 0.19823, -1.97760, -4.32054), (25.3245, 3.32435, 0.16801, -1.27393, -4.85967)
    return [t * s + (1.0 - t) * r for s, r in zip(smooth, rough, strict=True)]


@jit
def _sheen_mask(c: float, a: float, b: float, k: float, d: float, e: float) -> float:
    if c < 0.5:
        return math.exp(_sheen_lambda(c, a, b, k, d, e))
    return math.exp(2.0 * _sheen_lambda(0.5, a, b, k, d, e) - _sheen_lambda(1.0 - c, a, b, k, d, e))


@jit
def _sheen_albedo(mu: float, alpha: float, fit: Any, n: int) -> float:
    """Albedo of the sheen lobe, uniform over the hemisphere of incoming light."""
    z = max(mu, 1e-4)
    sin = math.sqrt(1.0 - z * z)
    lam_o = _sheen_mask(z, fit[0], fit[1], fit[2], fit[3], fit[4])
    total = 0.0
    for i in range(n):
        # Towards the horizon the lobe rises: cosines as squares.
        u = (i + 0.5) / n
        iz = u * u
        si = math.sqrt(1.0 - iz * iz)
        lam_i = _sheen_mask(iz, fit[0], fit[1], fit[2], fit[3], fit[4])
        for j in range(n):
            phi = math.pi * (j + 0.5) / n
            hx, hy, hz = sin + si * math.cos(phi), si * math.sin(phi), z + iz
            sin_h = math.sqrt(hx * hx + hy * hy) / math.sqrt(hx * hx + hy * hy + hz * hz)
            density = (2.0 + 1.0 / alpha) * sin_h ** (1.0 / alpha) / (2.0 * math.pi)
            total += density / ((1.0 + lam_o + lam_i) * 4.0 * z) * 2.0 * u * 2.0 * math.pi
    return total / (n * n)


def _halves(nodes: np.ndarray) -> np.ndarray:
    """Nodes with one more between each two."""
    out: np.ndarray = np.interp(np.arange(2 * len(nodes) - 1) / 2, np.arange(len(nodes)), nodes)
    return out


def _above(nodes: np.ndarray, fine: np.ndarray) -> np.ndarray:
    """Values at the nodes (their last two axes) whose linear interpolation is nowhere below `fine`, at the halves."""
    out = nodes.copy()
    for _ in range(4):
        rows = np.repeat(out, 2, axis=-2)[..., :-1, :]
        rows[..., 1::2, :] = (out[..., :-1, :] + out[..., 1:, :]) / 2
        full = np.repeat(rows, 2, axis=-1)[..., :-1]
        full[..., 1::2] = (rows[..., :-1] + rows[..., 1:]) / 2
        lack = np.clip(fine - full, 0, None)
        pad = np.pad(lack, [(0, 0)] * (lack.ndim - 2) + [(1, 1), (1, 1)])
        near = [pad[..., a : a + lack.shape[-2] : 2, b : b + lack.shape[-1] : 2] for a in range(3) for b in range(3)]
        out = np.minimum(out + np.max(near, axis=0), 1.0)
    return out


def _roughness_alike(stretched: np.ndarray, round_: np.ndarray) -> np.ndarray:
    """The roughness of the round lobe that keeps as much as the stretched one, at each direction."""
    nodes = energy.roughness_nodes()
    out = np.empty_like(stretched)
    for m in range(stretched.shape[-1]):
        falling = np.minimum.accumulate(round_[:, m])
        out[..., m] = np.interp(-stretched[..., m], -falling, nodes)
    return out


def _lerp(table: np.ndarray, at: np.ndarray, axis: int) -> np.ndarray:
    """`table` at the fractional index `at`, along `axis` (elementwise with the other axes where `at` has them)."""
    k = np.clip(at.astype(int), 0, table.shape[axis] - 2)
    low, high = np.take(table, k, axis), np.take(table, k + 1, axis)
    shape = [1] * low.ndim
    shape[axis] = len(at)
    f = (at - k).reshape(shape)
    out: np.ndarray = low * (1 - f) + high * f
    return out


def _means(albedo: np.ndarray, alike: np.ndarray) -> np.ndarray:
    """Cosine-weighted means over the hemisphere of `albedo` as the kernels interpolate it."""
    fine = 8
    at = (np.arange((energy.MU_COUNT - 1) * fine) + 0.5) / fine
    u = at / (energy.MU_COUNT - 1)
    weight = u**3 / (u**3).sum()  # 2 mu dmu with mu = u^2
    _, steps, azimuths, _ = ASPECT_SHAPE
    cos_phi = np.cos((np.arange(32) + 0.5) / 32 * np.pi / 2)
    place = np.minimum(energy.roughness_nodes(), 1.0) ** (2 / 3) * (steps - 1)
    both = _lerp(_lerp(_lerp(alike, at, 3), cos_phi * (azimuths - 1), 2), place, 1)  # aspect, roughness, phi, mu, 4
    position = both[..., 0] ** (2 / 3) * (ALBEDO_SHAPE[1] - 1)
    k = np.clip(position.astype(int), 0, ALBEDO_SHAPE[1] - 2)
    f = (position - k)[..., None]
    column = np.broadcast_to(np.arange(len(at)), k.shape)

    def round_(e: int) -> np.ndarray:
        table = _lerp(albedo[e], at, 1)
        values: np.ndarray = table[k, column] * (1 - f) + table[k + 1, column] * f
        return values

    common = np.interp(energy.COMMON_ETA, energy.eta_nodes(), np.arange(ETA_COUNT))
    low = int(common)
    usual = round_(low) * (1 - (common - low)) + round_(low + 1) * (common - low)
    mean = np.empty((*MEAN_SHAPE, 4))
    for e in range(ETA_COUNT):
        values = round_(e)
        values[1:, ..., 0] = both[1:, ..., 1]
        ratio = np.minimum(values[..., 2:] / np.maximum(usual[..., 2:], 1e-4), 2.0)
        values[1:, ..., 2:] = np.minimum(both[1:, ..., 2:] * ratio[1:], 1.0)
        mean[e] = np.einsum("arpmc,m->arc", values, weight) / len(cos_phi)
        mean[e, 0] = np.einsum("rmc,m->rc", _lerp(albedo[e], at, 1), weight)
    return mean


def compute() -> dict[str, np.ndarray]:
    """The tables of `gpu.energy.Tables`, float64 in 0..1 (`alike` in units of ROUGHNESS_END)."""
    mu, eta = energy.mu_nodes(), energy.eta_nodes()
    roughness = energy.roughness_nodes()
    albedo = np.empty((*ALBEDO_SHAPE, 4))
    _fill_albedo(albedo, mu, roughness, eta, _FINE)
    aspects, steps, azimuths, _ = ASPECT_SHAPE
    stretched = np.empty((*ASPECT_SHAPE, 4))
    aspect = 1.0 - np.linspace(0, 1, aspects) * (1.0 - energy.LEAST_ASPECT)
    rough, cos_phi = energy.roughness_nodes(steps, 1.0), np.linspace(0, 1, azimuths)
    _fill_stretched(stretched, mu, cos_phi, rough, aspect, energy.COMMON_ETA, _FINE)
    alike = _roughness_alike(stretched[..., 0], albedo[0, :, :, 0]) / ROUGHNESS_END
    fine = np.empty((ETA_COUNT, 2 * len(roughness) - 1, 2 * len(mu) - 1, 4))
    # Halfway in the tables' own coordinates: the square and the power 3/2 of equal steps.
    mu2, rough2 = _halves(np.sqrt(mu)) ** 2, _halves(roughness ** (2 / 3)) ** 1.5
    _fill_albedo(fine, mu2, rough2, eta, _FINE // 2)
    albedo[..., 1] = _above(albedo[..., 1], fine[..., 1])
    sheen_rough = _halves(energy.sheen_nodes())
    fine_sheen = np.empty((len(sheen_rough), len(mu2)))
    for r, alpha in enumerate(sheen_rough**2):
        fit = np.array(sheen_fit(float(alpha)))
        for m, c in enumerate(mu2):
            fine_sheen[r, m] = _sheen_albedo(float(c), float(alpha), fit, 400)
    sheen = fine_sheen[::2, ::2]
    # Where nothing is stretched the roughness is its own: plain lobes see no interpolation of it.
    alike[0] = energy.roughness_nodes(steps, 1 / ROUGHNESS_END)[:, None, None]
    alike = np.concatenate([alike[..., None], stretched[..., [0, 2, 3]]], -1)
    return {"albedo": albedo, "alike": alike, "mean": _means(albedo, alike), "sheen": _above(sheen, fine_sheen)}


if __name__ == "__main__":
    tables = compute()
    packed: dict[str, np.ndarray] = {}
    for name, values in tables.items():
        packed[name] = np.round(np.clip(values, 0, 1) * 65535).astype(np.uint16)
    packed["mean"] = tables["mean"].astype(np.float32)  # divided by, where it is small
    np.savez_compressed(energy.FILE, **packed)  # type: ignore[arg-type]
