"""The contract's formulas of `metal_rough`, `blinn_phong` and `phong` in float64, written from the page."""

from __future__ import annotations

import numpy as np


def metal_rough(material: np.void, wo: np.ndarray, wi: np.ndarray) -> np.ndarray:
    """f (without the cosine), (n, 3); wo (3,), wi (n, 3) in the shading frame."""
    m = {name: np.asarray(material[name], float) for name in ("base_color", "metallic", "roughness")}
    h = wo + wi
    h = h / np.linalg.norm(h, axis=1, keepdims=True)
    a = max(0.001, float(m["roughness"]) ** 2)
    f0 = 0.04 * (1 - m["metallic"]) + m["base_color"] * m["metallic"]
    fresnel = f0 + (1 - f0) * (1 - (wi * h).sum(1)[:, None]) ** 5
    # n.h^2 (a^2 - 1) + 1 with the sine in place of what cancels
    d = a**2 / (np.pi * (h[:, 0] ** 2 + h[:, 1] ** 2 + a**2 * h[:, 2] ** 2) ** 2)

    def v(c: np.ndarray) -> np.ndarray:
        return 1 / (c + np.sqrt(a**2 + (1 - a**2) * c**2))

    matte = (1 - fresnel) * m["base_color"] * (1 - m["metallic"]) / np.pi
    return np.asarray(matte + fresnel * (d * v(wi[:, 2]) * v(wo[2]))[:, None])


def blinn_phong(material: np.void, wo: np.ndarray, wi: np.ndarray) -> np.ndarray:
    """As `metal_rough`."""
    h = wo + wi
    h = h / np.linalg.norm(h, axis=1, keepdims=True)
    sin2 = h[:, 0] ** 2 + h[:, 1] ** 2
    power = np.exp(0.5 * float(material["shininess"]) * np.log1p(-sin2))
    diffuse, specular = (np.asarray(material[name], float) for name in ("base_color", "phong_specular"))
    return np.asarray((diffuse + specular * (power / wi[:, 2])[:, None]) / np.pi)


def phong(material: np.void, wo: np.ndarray, wi: np.ndarray) -> np.ndarray:
    """As `metal_rough`."""
    apart = wi * [-1, -1, 1] - wo
    cos = np.maximum(1 - 0.5 * (apart**2).sum(1), 0)  # r.v of unit vectors
    power = cos ** float(material["shininess"])
    diffuse, specular = (np.asarray(material[name], float) for name in ("base_color", "phong_specular"))
    return np.asarray((diffuse + specular * (power / wi[:, 2])[:, None]) / np.pi)
