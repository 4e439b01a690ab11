"""Presets of `microfacet` beside the published fits that they come from: equal at steep angles."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gpu import Renderer, Steps
from service.document import presets
from service.pack import pack_material
from service.server.requests.bsdf_request import parse_material

# As tabulated in Dupuy's dj_brdf: A per channel, B, C and the index of refraction [Loew et al. 2012].
ABC: dict[str, tuple[list[float], float, float, float]] = {
    "teflon-abc": ([1.787717, 1.816174, 1.846979], 41.644257, 2.066234, 1.611215),
    "purple-paint-abc": ([14.006363, 13.769886, 13.753972], 408.684143, 1.776584, 1.48377),
    "alum-bronze-abc": ([51.714554, 37.932693, 27.373095], 10482.133789, 0.816737, 2.236525),
    "blue-acrylic-abc": ([1191.397339, 1099.257202, 1082.125366], 255868.953125, 1.084736, 1.475061),
}
# rho_s, alpha, p, F0, F1 and K_ap of the green channel [Bagher et al. 2012].
SGD: dict[str, tuple[float, float, float, float, float, float]] = {
    "pvc-sgd": (0.317369, 0.0176681, 0.730637, 0.026258, 0.00651989, 26.9026),
    "walnut-sgd": (0.216118, 0.119932, 0.524858, 0.0802614, 0.0324012, 7.41578),
    "oxidized-steel-sgd": (0.344382, 0.195704, 0.706913, 0.086518, 0.0517633, 4.91636),
}


def values(gpu: Renderer, name: str) -> tuple[Any, np.ndarray, np.ndarray, np.ndarray]:
    """The document; f (n, 3) from the normal towards directions in the plane, n.h and n.wi of these."""
    document = presets.get("materials", name)
    theta = np.radians([0.0, 1, 4, 10, 20, 30])
    wi = np.stack([np.sin(theta), np.zeros_like(theta), np.cos(theta)], 1)
    packed = pack_material(parse_material(document))
    f = Steps(gpu.bsdf.values(packed, np.array([[0.0, 0.0, 1.0]]), wi)).finish().f[0]
    return document, f, np.cos(theta / 2), np.cos(theta)


@pytest.mark.parametrize("name", ABC)
def test_abc_fits(gpu: Renderer, name: str) -> None:
    """f = k_d / pi + A / (1 + B (1 - n.h))^C F G / (pi n.l n.v); G is 1 here."""
    a, b, c, ior = ABC[name]
    document, f, cos_h, cos_i = values(gpu, name)
    assert (document["alpha"], document["gamma"]) == (b, c)
    t = np.sqrt(1 - (1 - cos_h**2) / ior**2)
    fresnel = (((cos_h - ior * t) / (cos_h + ior * t)) ** 2 + ((ior * cos_h - t) / (ior * cos_h + t)) ** 2) / 2
    lobe = np.outer(fresnel / (1 + b * (1 - cos_h)) ** c / (np.pi * cos_i), a)
    np.testing.assert_allclose(f, np.array(document["diffuse"]) / np.pi + lobe, rtol=0.01)


@pytest.mark.parametrize("name", SGD)
def test_sgd_fits(gpu: Renderer, name: str) -> None:
    """f = (rho_d + rho_s D G F / (n.l n.v)) / pi of the green channel, pi D being K exp(-x) / (x^p (n.h)^4) with
    x = alpha + tan^2 / alpha; G is 1 at such angles."""
    rho_s, alpha, p, f0, f1, k = SGD[name]
    document, f, cos_h, cos_i = values(gpu, name)
    assert (document["alpha"], document["gamma"]) == (alpha, p)
    x = alpha + (1 / cos_h**2 - 1) / alpha
    fresnel = f0 - f1 * cos_h + (1 - f0) * (1 - cos_h) ** 5
    lobe = rho_s * k * np.exp(-x) / (np.pi * x**p * cos_h**4) * fresnel / cos_i
    np.testing.assert_allclose(f[:, 1], (document["diffuse"][1] + lobe) / np.pi, rtol=0.04)
