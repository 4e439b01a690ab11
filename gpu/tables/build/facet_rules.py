"""Facets that reflect light from a direction, as a few cosines and weights, for `energy.Tables.facets`.

By these the albedo of any reflectance that depends on the cosine at the facet is a sum of a few values of it: Gauss's
rule for the density of that cosine, of four cosines, which is exact for polynomials of degree 7.
"""

from __future__ import annotations

import numpy as np

from gpu.tables import energy

Rule = tuple[np.ndarray, np.ndarray]
_MEAN_COSINES = 32  # directions that the mean over all of them is made of


def facets(mu: float, roughness: float, n: int) -> Rule:
    """The cosines of light from a direction of cosine `mu` at n * n facets, as visible normals are spread [Dupuy &
    Benyoub 2023], and the share of it that each reflects to the same side [Heitz 2014, eq. 99]."""
    alpha, z = max(roughness, 1e-3) ** 2, max(mu, 1e-5)
    sine = np.sqrt(1 - z * z)
    length = np.hypot(alpha * sine, z)
    u, v = (a.ravel() for a in np.meshgrid(*[(np.arange(n) + 0.5) / n] * 2))
    cap = (1 - v) * (1 + z / length) - z / length
    r = np.sqrt(np.clip(1 - cap * cap, 0, 1))
    normal = np.stack([
        alpha * (r * np.cos(2 * np.pi * u) + alpha * sine / length),
        alpha * r * np.sin(2 * np.pi * u),
        np.maximum(cap + z / length, 0),
    ])  # fmt: skip
    normal /= np.linalg.norm(normal, axis=0)
    cosines = sine * normal[0] + z * normal[2]
    x, y, out = 2 * cosines * normal[0] - sine, 2 * cosines * normal[1], 2 * cosines * normal[2] - z
    stretch = np.sqrt(alpha**2 * (x * x + y * y) + out**2)
    shares = np.where(out > 0, out * (z + length) / (out * length + z * stretch), 0)
    return cosines, shares / len(shares)


def gauss(cosines: np.ndarray, weights: np.ndarray, count: int) -> Rule:
    """The rule of `count` places for a density: the eigenvalues of the matrix of its orthogonal polynomials [Golub &
    Welsch 1969]. The weights sum to 1."""
    density = weights / weights.sum()
    mean = float(density @ cosines)
    spread = float(np.sqrt(density @ (cosines - mean) ** 2))
    x = (cosines - mean) / spread
    before, now, norm, ratio = np.zeros_like(x), np.ones_like(x), 1.0, 0.0
    diagonal, beside = [], []
    for _ in range(count):
        turn = float(density @ (x * now * now)) / norm
        before, now = now, (x - turn) * now - ratio * before
        square = float(density @ (now * now))
        ratio, norm = square / norm, square
        diagonal.append(turn)
        beside.append(np.sqrt(ratio))
    matrix = np.diag(diagonal) + np.diag(beside[:-1], 1) + np.diag(beside[:-1], -1)
    places, vectors = np.linalg.eigh(matrix)
    return mean + spread * places, vectors[0] ** 2


def rules(n: int = 96) -> np.ndarray:
    """`energy.Tables.facets`."""
    layers, steps, cosines, count = energy.FACETS_SHAPE
    out = np.zeros((layers, steps, cosines, count))
    mus = (np.arange(_MEAN_COSINES) + 0.5) / _MEAN_COSINES
    for r, roughness in enumerate(energy.roughness_nodes(steps)):
        for m, mu in enumerate(energy.mu_nodes(cosines)):
            places, shares = facets(float(mu), float(roughness), n)
            out[0, r, m], out[1, r, m] = gauss(places, shares, count)
            out[4, r, m], out[5, r, m] = gauss(places, np.ones_like(places), count)
        found = [facets(float(mu), float(roughness), n // 2) for mu in mus]
        places = np.concatenate([c for c, _ in found])
        met = np.repeat(mus, (n // 2) ** 2)
        out[2, r, :], out[3, r, :] = gauss(places, met * np.concatenate([share for _, share in found]), count)
        out[6, r, :], out[7, r, :] = gauss(places, met, count)
    return np.clip(out, 0, 1).astype(np.float32)


if __name__ == "__main__":
    np.save(energy.FACETS_FILE, rules())
