"""Files of measured reflection, made from a formula: GGX over Lambert, of one colour each."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

SCALES = np.array([1.00, 1.15, 1.66]) / 1500  # of the MERL database
DTYPES = {"|u1": 1, "<f4": 10, "<f8": 11}

Reflection = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Facets:
    """f = diffuse / pi + F D G / (4 cos cos), with GGX of two widths, correlated masking and Schlick's F."""

    diffuse: tuple[float, float, float] = (0.5, 0.3, 0.1)
    f0: float = 0.04
    alpha: tuple[float, float] = (0.3, 0.3)

    def density(self, wm: np.ndarray) -> np.ndarray:
        x, y = self.alpha
        e = (wm[..., 0] / x) ** 2 + (wm[..., 1] / y) ** 2 + wm[..., 2] ** 2
        return np.where(wm[..., 2] >= 0, 1 / (np.pi * x * y * e**2), 0.0)

    def masking(self, w: np.ndarray) -> np.ndarray:
        x, y = self.alpha
        slope2 = ((x * w[..., 0]) ** 2 + (y * w[..., 1]) ** 2) / np.maximum(w[..., 2], 1e-9) ** 2
        return 0.5 * (np.sqrt(1 + slope2) - 1)

    def area(self, w: np.ndarray) -> np.ndarray:
        """Of the facets, as the direction sees them."""
        return np.maximum(w[..., 2], 1e-9) * (1 + self.masking(w))

    def __call__(self, wo: np.ndarray, wi: np.ndarray) -> np.ndarray:
        """(..., 3), 1/sr; 0 below the horizon."""
        wm = wo + wi
        wm = wm / np.maximum(np.linalg.norm(wm, axis=-1, keepdims=True), 1e-12)
        fresnel = self.f0 + (1 - self.f0) * (1 - (wm * wi).sum(axis=-1)) ** 5
        g = 1 / (1 + self.masking(wo) + self.masking(wi))
        above = (wo[..., 2] > 0) & (wi[..., 2] > 0)
        cosines = np.maximum(wo[..., 2] * wi[..., 2], 1e-12)
        facets = np.where(above, self.density(wm) * g * fresnel / (4 * cosines), 0.0)
        return facets[..., None] + np.where(above[..., None], np.array(self.diffuse) / np.pi, 0.0)


def merl(reflection: Reflection, unknown: float = -1.0) -> bytes:
    """A MERL file, each entry that of its cell's middle; below the horizon they are `unknown`."""
    h, d, p = np.meshgrid(*((np.arange(n) + 0.5) / n for n in (90, 90, 180)), indexing="ij")
    theta_h, theta_d, phi_d = 0.5 * np.pi * h**2, 0.5 * np.pi * d, np.pi * p
    half = np.stack([np.sin(theta_h), 0 * theta_h, np.cos(theta_h)], axis=-1)
    x, y, z = np.sin(theta_d) * np.cos(phi_d), np.sin(theta_d) * np.sin(phi_d), np.cos(theta_d)
    wi = np.stack([np.cos(theta_h) * x + np.sin(theta_h) * z, y, np.cos(theta_h) * z - np.sin(theta_h) * x], axis=-1)
    wo = 2 * (wi * half).sum(axis=-1, keepdims=True) * half - wi
    above = (wo[..., 2] > 0) & (wi[..., 2] > 0)
    values = np.where(above[..., None], reflection(wo, wi) / SCALES, unknown)
    return np.array([90, 90, 180], "<i4").tobytes() + np.moveaxis(values, -1, 0).astype("<f8").tobytes()


def tensor_file(arrays: Mapping[str, np.ndarray]) -> bytes:
    """The container of RGL files."""
    size = 18 + sum(2 + len(name) + 11 + 8 * array.ndim for name, array in arrays.items())
    head, body = b"tensor_file\0" + struct.pack("<BBI", 1, 0, len(arrays)), b""
    for name, array in arrays.items():
        head += struct.pack("<H", len(name)) + name.encode()
        head += struct.pack("<HBQ", array.ndim, DTYPES[array.dtype.str], size + len(body))
        head += struct.pack(f"<{array.ndim}Q", *array.shape)
        body += array.tobytes()
    return head + body


def adaptive(
    facets: Facets,
    phis: np.ndarray | None = None,
    thetas: int = 8,
    side: int = 32,
    fine: int = 64,
    wavelengths: np.ndarray | None = None,
) -> dict[str, np.ndarray]:
    """The arrays of an RGL file, over `side` x `side` numbers, and facets over `fine` x `fine`; with `wavelengths`
    spectra, all of them those of red. Without `phis` it looks the same from all sides."""
    theta = np.linspace(0, 0.49 * np.pi, thetas) ** 1.0
    phi = np.zeros(1) if phis is None else phis
    u = np.linspace(0, 1, fine)
    x, y = np.meshgrid(u, u)
    wm = _direction(0.5 * np.pi * x**2, (2 * y - 1) * np.pi)
    density = facets.density(wm)
    steradians = 2 * np.pi**2 * x * np.sin(0.5 * np.pi * x**2)
    visible = np.zeros((len(phi), thetas, fine, fine))
    values = np.zeros((len(phi), thetas, 3, side, side))
    luminance = np.zeros((len(phi), thetas, side, side))
    places = np.stack(np.meshgrid(*2 * [np.linspace(0, 1, side)]), axis=-1).reshape(-1, 2)
    for i, azimuth in enumerate(phi):
        for k, angle in enumerate(theta):
            wo = _direction(angle, azimuth)
            seen = wm if phis is not None else _direction(0.5 * np.pi * x**2, (2 * y - 1) * np.pi + azimuth)
            visible[i, k] = density * np.maximum((seen * wo).sum(axis=-1), 0) / facets.area(wo) * steradians
            at = mapped(visible[i, k], places)
            normals = _direction(
                0.5 * np.pi * at[:, 0] ** 2, (2 * at[:, 1] - 1) * np.pi + (0 if phis is not None else azimuth)
            )
            wi = 2 * (normals @ wo)[:, None] * normals - wo
            lit = facets(np.broadcast_to(wo, wi.shape), wi) * np.maximum(wi[:, 2:], 0)
            relative = lit * (4 * facets.area(wo) / np.maximum(table(density, at), 1e-9))[:, None]
            values[i, k] = relative.T.reshape(3, side, side)
            luminance[i, k] = values[i, k].mean(axis=0)
    flat = _direction(0.5 * np.pi * x**2, (2 * y - 1) * np.pi)
    arrays = {
        "description": np.frombuffer(b"made", np.uint8), "phi_i": phi, "theta_i": theta, "sigma": facets.area(flat),
        "ndf": density, "vndf": visible, "luminance": luminance, "jacobian": np.ones(1, np.uint8), "rgb": values,
    }  # fmt: skip
    if wavelengths is not None:
        del arrays["rgb"]
        arrays |= {"wavelengths": wavelengths, "spectra": np.repeat(values[:, :, :1], len(wavelengths), axis=2)}
    return {name: a if a.dtype == np.uint8 else a.astype("<f4") for name, a in arrays.items()}


def table(nodes: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Between the nodes (rows, columns) of a table over the unit square, at places (n, 2)."""
    rows, columns = nodes.shape
    x, y = at[:, 0] * (columns - 1), at[:, 1] * (rows - 1)
    i, j = np.clip(x.astype(int), 0, columns - 2), np.clip(y.astype(int), 0, rows - 2)
    s, t = x - i, y - j
    upper = nodes[j, i] * (1 - s) + nodes[j, i + 1] * s
    return upper * (1 - t) + (nodes[j + 1, i] * (1 - s) + nodes[j + 1, i + 1] * s) * t


def mapped(density: np.ndarray, u: np.ndarray) -> np.ndarray:
    """The places (n, 2) that a bilinear density over the unit square takes uniform numbers to, by bisection."""
    rows, columns = density.shape
    lines = np.trapezoid(density, dx=1 / (columns - 1), axis=1)
    y = _bisected(np.broadcast_to(lines, (len(u), rows)), u[:, 1])
    j = np.clip((y * (rows - 1)).astype(int), 0, rows - 2)
    t = (y * (rows - 1) - j)[:, None]
    return np.stack([_bisected(density[j] * (1 - t) + density[j + 1] * t, u[:, 0]), y], axis=1)


def _bisected(density: np.ndarray, share: np.ndarray) -> np.ndarray:
    """For each row of nodes, piecewise linear over 0..1, up to where it holds that share of its integral."""
    n = density.shape[1]
    nodes = np.concatenate(
        [np.zeros((len(density), 1)), np.cumsum(0.5 * (density[:, 1:] + density[:, :-1]), axis=1)], 1
    )
    low, high, each = np.zeros(len(share)), np.ones(len(share)), np.arange(len(share))
    for _ in range(50):
        middle = 0.5 * (low + high)
        k = np.clip((middle * (n - 1)).astype(int), 0, n - 2)
        t = middle * (n - 1) - k
        a, b = density[each, k], density[each, k + 1]
        less = nodes[each, k] + t * a + 0.5 * t * t * (b - a) < share * nodes[:, -1]
        low, high = np.where(less, middle, low), np.where(less, high, middle)
    return 0.5 * (low + high)


def _direction(theta: np.ndarray | float, phi: np.ndarray | float) -> np.ndarray:
    theta, phi = np.broadcast_arrays(np.asarray(theta, float), np.asarray(phi, float))
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
