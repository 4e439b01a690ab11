"""Albedos of microfacet and sheen lobes, and the energy that they lose, by quadrature, for `energy_tables`."""

from __future__ import annotations

import math
from typing import Any

from gpu.jit import jit_loose


@jit_loose
def _fresnel(c: float, eta: float) -> float:
    """Unpolarised reflectance of a dielectric, eta = index beyond over index before."""
    g2 = eta * eta - 1.0 + c * c
    if g2 <= 0.0:
        return 1.0
    g = math.sqrt(g2)
    s, p = (c - g) / (c + g), (eta * eta * c - g) / (eta * eta * c + g)
    return 0.5 * (s * s + p * p)


@jit_loose
def _lambda(x: float, y: float, z: float) -> float:
    return 0.5 * (math.sqrt(x * x + y * y + z * z) / abs(z) - 1.0)


@jit_loose
def albedos(mu: float, cos_phi: float, ax: float, ay: float, eta: float, n: int) -> tuple[float, float, float, float]:
    """Albedos of single scattering from direction (mu, phi): with Fresnel 1, with the Fresnel of eta, and the shares
    that are lost with eta and with 1 / eta.

    Visible normals by spherical caps [Dupuy & Benyoub 2023]; masking of two directions on one side by heights
    correlated, across the surface by the product of both [Walter et al. 2007].
    """
    z = max(mu, 1e-5)
    sin = math.sqrt(max(0.0, 1.0 - z * z))
    x, y = sin * cos_phi, sin * math.sqrt(max(0.0, 1.0 - cos_phi * cos_phi))
    lam_o = _lambda(ax * x, ay * y, z)
    length = math.sqrt((ax * x) ** 2 + (ay * y) ** 2 + z * z)
    vx, vy, vz = ax * x / length, ay * y / length, z / length
    one = reflected = found_a = found_b = 0.0
    # Many rows, each turned against the last one: head-on, a whole row is masked or not.
    rows, columns = 3 * n, n // 3
    step_x, step_y = math.cos(2.0 * math.pi / columns), math.sin(2.0 * math.pi / columns)
    for i in range(rows):
        cap = (1.0 - (i + 0.5) / rows) * (1.0 + vz) - vz
        r = math.sqrt(max(0.0, 1.0 - cap * cap))
        phi = 2.0 * math.pi * (0.5 / columns + 0.61803398875 * i)
        px, py = r * math.cos(phi), r * math.sin(phi)
        for _ in range(columns):
            mx, my, mz = ax * (px + vx), ay * (py + vy), max(cap + vz, 0.0)
            px, py = px * step_x - py * step_y, px * step_y + py * step_x
            scale = 1.0 / math.sqrt(mx * mx + my * my + mz * mz + 1e-300)
            mx, my, mz = mx * scale, my * scale, mz * scale
            c = x * mx + y * my + z * mz
            f_a, f_b = _fresnel(c, eta), _fresnel(c, 1.0 / eta)
            ix, iy, iz = 2.0 * c * mx - x, 2.0 * c * my - y, 2.0 * c * mz - z
            if iz > 0.0:
                g = (1.0 + lam_o) / (1.0 + lam_o + _lambda(ax * ix, ay * iy, iz))
                one += g
                reflected += f_a * g
                found_a += f_a * g
                found_b += f_b * g
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
                        found_a += (1.0 - f_a) * g
                    else:
                        found_b += (1.0 - f_b) * g
    s = 1.0 / (rows * columns)
    return one * s, reflected * s, 1.0 - found_a * s, 1.0 - found_b * s


@jit_loose
def _sheen_lambda(c: float, a: float, b: float, k: float, d: float, e: float) -> float:
    return float(a / (1.0 + b * c**k) + d * c + e)


def sheen_fit(alpha: float) -> list[float]:
    """The five parameters of the sheen's masking, between a rough and a smooth set [Estevez & Kulla 2017, eq. 3]."""
    t = (1.0 - alpha) ** 2
    rough, smooth = (21.5473, 3.82987, 0.19823, -1.97760, -4.32054), (25.3245, 3.32435, 0.16801, -1.27393, -4.85967)
    return [t * s + (1.0 - t) * r for s, r in zip(smooth, rough, strict=True)]


@jit_loose
def _sheen_mask(c: float, a: float, b: float, k: float, d: float, e: float) -> float:
    if c < 0.5:
        return math.exp(_sheen_lambda(c, a, b, k, d, e))
    return math.exp(2.0 * _sheen_lambda(0.5, a, b, k, d, e) - _sheen_lambda(1.0 - c, a, b, k, d, e))


@jit_loose
def sheen_albedo(mu: float, alpha: float, fit: Any, n: int) -> float:
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
