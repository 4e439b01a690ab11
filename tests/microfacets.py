"""The contract's formulas of `microfacet` in float64, written from the page, with scipy's integrals and functions."""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
from scipy import integrate, special

Array = np.ndarray


def _powers(p: float, end: float) -> float:
    """The integral of y^-p over 1 .. end."""
    return math.log(end) if p == 1 else (end ** (1 - p) - 1) / (1 - p)


def upper_gamma(a: float, x: float) -> float:
    """Gamma(a, x) for a in -1..1."""
    if a == 0:
        return float(special.exp1(x))
    if a > 0:
        return float(special.gamma(a) * special.gammaincc(a, x))
    return (upper_gamma(a + 1, x) - x**a * math.exp(-x)) / a


@lru_cache(maxsize=4096)
def factor(distribution: str, alpha: float, gamma: float) -> float:
    """The logarithm of k."""
    if distribution == "gtr":
        if alpha == 1:
            return -math.log(math.pi)
        if gamma == 1:
            return math.log((alpha**2 - 1) / (math.pi * math.log(alpha**2)))
        return math.log((gamma - 1) * (alpha**2 - 1) / (math.pi * (1 - alpha ** (2 - 2 * gamma))))
    if distribution == "abc":
        if alpha > 0.1:
            both = (1 + alpha) * _powers(gamma, 1 + alpha) - _powers(gamma - 1, 1 + alpha)
            return math.log(alpha**2 / (2 * math.pi * both))
        found, _ = integrate.quad(lambda c: c * (1 + alpha * (1 - c)) ** -gamma, 0, 1, epsabs=0, epsrel=1e-11)
        return -math.log(2 * math.pi * found)
    if distribution == "sgd":
        return (gamma - 1) * math.log(alpha) - math.log(upper_gamma(1 - gamma, alpha))
    found, _ = integrate.quad(lambda t: math.exp(-((t / alpha) ** 2)) * math.sin(2 * t), 0, math.pi / 2,
                              epsabs=0, epsrel=1e-11, points=[min(alpha, 1), min(4 * alpha, 1.5)])  # fmt: skip
    return -math.log(math.pi * found)


def d(distribution: str, alpha: float, gamma: float, tan: Any) -> Array:
    """D of facets of that slope."""
    t2 = np.asarray(tan, float) ** 2
    c2, s2 = 1 / (1 + t2), t2 / (1 + t2)
    one = np.log1p(t2)  # -log cos^2
    if distribution == "phong":
        return np.asarray((alpha + 2) / (2 * np.pi) * np.exp(-0.5 * alpha * one))
    if distribution == "beckmann":
        return np.asarray(np.exp(2 * one - t2 / alpha**2) / (np.pi * alpha**2))
    if distribution == "ggx":
        return np.asarray(alpha**2 / (np.pi * (s2 + alpha**2 * c2) ** 2))
    k = factor(distribution, alpha, gamma)
    if distribution == "gtr":
        return np.asarray(np.exp(k - gamma * np.log(s2 + alpha**2 * c2)))
    if distribution == "abc":
        return np.asarray(np.exp(k - gamma * np.log1p(alpha * s2 / (1 + np.sqrt(c2)))))
    if distribution == "sgd":
        return np.asarray(np.exp(k + 2 * one - (alpha**2 + t2) / alpha - gamma * np.log(alpha**2 + t2)) / np.pi)
    return np.asarray(np.exp(k - (np.arctan(np.sqrt(t2)) / alpha) ** 2))


@lru_cache(maxsize=65536)
def g1(distribution: str, alpha: float, gamma: float, cos: float, sin: float) -> float:
    """n.s over the integral of D(m) max(0, s.m): over azimuth in closed form, over log tan theta_m by quadrature."""
    if distribution == "ggx":
        return 2 * cos / (cos + math.sqrt(cos**2 + alpha**2 * sin**2))
    if distribution == "beckmann":
        a = cos / (alpha * max(sin, 1e-300))
        return 1 / (1 + 0.5 * (math.erf(a) - 1) + math.exp(-min(a * a, 700)) / (2 * a * math.sqrt(math.pi)))

    def ring(x: float) -> float:
        c = 1 / math.sqrt(1 + math.exp(2 * x))
        s = c * math.exp(x)
        p, q = cos * c, sin * s
        around = 2 * math.pi * p if p >= q else 2 * (p * math.acos(-p / q) + math.sqrt(q * q - p * p))
        return float(d(distribution, alpha, gamma, math.exp(x))) * around * s * s * c

    kink = math.log(cos / sin) if sin > 1e-12 else 30.0
    ends = sorted({-30.0, 25.0, *[x for x in (*range(-28, 25, 2), kink) if -30 < x < 25]})
    parts = (integrate.quad(ring, low, high, epsabs=1e-12, epsrel=1e-8)[0] for low, high in pairwise(ends))
    return cos / sum(parts)


def geometry(m: dict[str, Any], wo: Array, wi: Array, h: Array) -> Array:
    """G, of (n, 3) directions."""
    nl, nv, nh, vh = wi[:, 2], wo[:, 2], h[:, 2], np.linalg.norm(wo + wi, axis=1) / 2
    kind = m["geometry"]
    if kind == "implicit":
        return nl * nv
    if kind == "neumann":
        return nl * nv / np.maximum(nl, nv)
    if kind == "cook_torrance":
        return np.minimum(1, np.minimum(2 * nh * nv / vh, 2 * nh * nl / vh))
    if kind == "kelemen":
        return nl * nv / vh**2
    if kind == "schlick_ggx":
        k = m["alpha"] / 2
        return nl / (nl * (1 - k) + k) * nv / (nv * (1 - k) + k)
    found = [
        [g1(m["distribution"], m["alpha"], m["gamma"], float(w[2]), math.hypot(w[0], w[1])) for w in each]
        for each in (wi, wo)
    ]
    gi, go = np.array(found)
    return gi * go if kind == "smith" else 1 / (1 / gi + 1 / go - 1)


def fresnel(m: dict[str, Any], c: Array) -> Array:
    """F, (n, 3)."""
    kind, c = m["fresnel"], c[:, None]
    if kind == "none":
        return np.ones((len(c), 3))
    f0 = np.broadcast_to(np.asarray(m["f0"], float), 3)
    if kind == "schlick":
        return f0 + (1 - f0) * (1 - c) ** 5
    if kind == "cook_torrance":
        n = (1 + np.sqrt(f0)) / np.where(f0 < 1, 1 - np.sqrt(f0), 1)
        g = np.sqrt(n**2 + c**2 - 1)
        f = 0.5 * ((g - c) / (g + c)) ** 2 * (1 + ((c * (g + c) - 1) / (c * (g - c) + 1)) ** 2)
        return np.where(f0 < 1, f, 1)
    index = complex(m["ior"]) * np.ones(3)
    if kind == "conductor":
        index = np.asarray(m["conductor_eta"], float) + 1j * np.asarray(m["conductor_k"], float)
    inside = np.sqrt(1 - (1 - c**2) / index**2 + 0j)
    s = (c - index * inside) / (c + index * inside)
    p = (index * c - inside) / (index * c + inside)
    return np.asarray(0.5 * (np.abs(s) ** 2 + np.abs(p) ** 2))


def diffuse(m: dict[str, Any], wo: Array, wi: Array, h: Array) -> Array:
    """f_d, (n, 3)."""
    rho = np.broadcast_to(np.asarray(m["diffuse"], float), 3)
    kind, r = m["diffuse_model"], m["diffuse_roughness"]
    nl, nv = wi[:, 2], wo[:, 2]
    if kind == "lambert":
        return np.broadcast_to(rho / np.pi, wi.shape)
    if kind == "disney":
        fd90 = 0.5 + 2 * (wi * h).sum(1) ** 2 * r
        f = (1 + (fd90 - 1) * (1 - nl) ** 5) * (1 + (fd90 - 1) * (1 - nv) ** 5)
        return np.asarray(f[:, None] * rho / np.pi)
    if kind == "oren_nayar":
        ti, to = (np.arctan2(np.hypot(w[:, 0], w[:, 1]), w[:, 2]) for w in (wi, wo))
        phi = np.arctan2(wi[:, 1], wi[:, 0]) - np.arctan2(wo[:, 1], wo[:, 0])
        alpha, beta, cos = np.maximum(ti, to), np.minimum(ti, to), np.cos(phi)
        c1 = 1 - 0.5 * r**2 / (r**2 + 0.33)
        c2 = 0.45 * r**2 / (r**2 + 0.09) * (np.sin(alpha) - np.where(cos >= 0, 0, (2 * beta / np.pi) ** 3))
        c3 = 0.125 * r**2 / (r**2 + 0.09) * (4 * alpha * beta / np.pi**2) ** 2
        once = c1 + cos * c2 * np.tan(beta) + (1 - np.abs(cos)) * c3 * np.tan((alpha + beta) / 2)
        twice = 0.17 * r**2 / (r**2 + 0.13) * (1 - cos * (2 * beta / np.pi) ** 2)
        return np.asarray(np.maximum(rho / np.pi * once[:, None] + rho**2 / np.pi * twice[:, None], 0))
    f1, f2 = 0.5 - 2 / (3 * np.pi), 2 / 3 - 28 / (15 * np.pi)
    af = 1 / (1 + f1 * r)

    def albedo(mu: Array) -> Array:
        x = 1 - mu
        over_pi = x * (0.0571085289 + x * (0.491881867 + x * (-0.332181442 + x * 0.0714429953)))
        return np.asarray((1 + r * over_pi) * af)

    s = (wi * wo).sum(1) - nl * nv
    single = af * (1 + r * np.where(s > 0, s / np.maximum(nl, nv), s))
    mean = af * (1 + f2 * r)
    many = rho**2 * mean / (1 - rho * (1 - mean))
    spread = np.maximum(1 - albedo(nv), 0) * np.maximum(1 - albedo(nl), 0) / (1 - mean) if r > 0 else 0 * nl
    return np.asarray(rho / np.pi * single[:, None] + many / np.pi * np.asarray(spread)[:, None])


def bsdf(m: dict[str, Any], wo: Array, wi: Array) -> Array:
    """f without the cosine, (n, 3); wo (3,) or (n, 3), wi (n, 3) in the shading frame.

    v.h is half the length of wo + wi: at grazing angles a dot product is as uncertain as the directions' lengths.
    """
    wo = np.broadcast_to(wo, wi.shape)
    h = wo + wi
    h = h / np.linalg.norm(h, axis=1, keepdims=True)
    slope = np.hypot(h[:, 0], h[:, 1]) / h[:, 2]
    facets = d(m["distribution"], m["alpha"], m["gamma"], slope) * geometry(m, wo, wi, h) / (4 * wi[:, 2] * wo[:, 2])
    return np.asarray(diffuse(m, wo, wi, h) + facets[:, None] * fresnel(m, np.linalg.norm(wo + wi, axis=1) / 2))
