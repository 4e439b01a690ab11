"""The contract's formula of `disney` in float64, written from the page and not from the shaders."""

from __future__ import annotations

import numpy as np


def _schlick(c: np.ndarray) -> np.ndarray:
    return (1 - c) ** 5


def _mix(a: object, b: object, t: object) -> np.ndarray:
    a, b, t = np.asarray(a, float), np.asarray(b, float), np.asarray(t, float)
    return a * (1 - t) + b * t


def bsdf(material: np.void, wo: np.ndarray, wi: np.ndarray, tangent: np.ndarray) -> np.ndarray:
    """f (without the cosine), (n, 3), of a `layout.Material`; wo (3,), wi (n, 3) in the shading frame.

    `tangent` (2,) is the direction in the frame that anisotropy stretches along.
    """
    m = {name: np.asarray(material[name], float) for name in material.dtype.names}
    if material["model"] == 0:
        return np.broadcast_to(m["base_color"] / np.pi, wi.shape)
    nl, nv = wi[:, 2], np.full(len(wi), wo[2])
    h = wo + wi
    h = h / np.linalg.norm(h, axis=1, keepdims=True)
    lh = (wi * h).sum(1)
    fl, fv, fh = _schlick(nl), _schlick(nv), _schlick(lh)
    base = m["base_color"]
    lum = base @ [0.3, 0.6, 0.1]
    tint = base / lum if lum > 0 else np.ones(3)
    spec0 = _mix(m["specular"] * 0.08 * _mix(1, tint, m["specular_tint"]), base, m["metallic"])
    sheen_color = _mix(1, tint, m["sheen_tint"])
    fss90 = lh**2 * m["roughness"]
    fd90 = 0.5 + 2 * fss90
    fd = _mix(1, fd90, fl) * _mix(1, fd90, fv)
    fss = _mix(1, fss90, fl) * _mix(1, fss90, fv)
    ss = 1.25 * (fss * (1 / (nl + nv) - 0.5) + 0.5)
    aspect = np.sqrt(1 - 0.9 * m["anisotropic"])
    ax = max(0.001, m["roughness"] ** 2 / aspect)
    ay = max(0.001, m["roughness"] ** 2 * aspect)
    hx = h[:, 0] * tangent[0] + h[:, 1] * tangent[1]
    hy = h[:, 1] * tangent[0] - h[:, 0] * tangent[1]
    ds = 1 / (np.pi * ax * ay * ((hx / ax) ** 2 + (hy / ay) ** 2 + h[:, 2] ** 2) ** 2)

    def smith(c: np.ndarray, a: float) -> np.ndarray:
        return 1 / (c + np.sqrt(a**2 + c**2 - a**2 * c**2))

    a_mask = (0.5 + m["roughness"] / 2) ** 2
    gs = smith(nl, a_mask) * smith(nv, a_mask)
    fs = _mix(spec0, 1, fh[:, None])
    a_coat = _mix(0.1, 0.001, m["clearcoat_gloss"])
    dr = (a_coat**2 - 1) / (np.pi * np.log(a_coat**2) * (1 + (a_coat**2 - 1) * h[:, 2] ** 2))
    fr = _mix(0.04, 1, fh)
    gr = smith(nl, 0.25) * smith(nv, 0.25)
    matte = _mix(fd, ss, m["subsurface"])[:, None] * base / np.pi + m["sheen"] * sheen_color * fh[:, None]
    return (
        matte * (1 - m["metallic"]) + gs[:, None] * fs * ds[:, None] + (0.25 * m["clearcoat"] * gr * fr * dr)[:, None]
    )
