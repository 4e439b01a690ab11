"""Angles and directions about the half vector of two directions, and their places on the unit square."""

from __future__ import annotations

import numpy as np

from service.formats.types import Doubles


def from_angles(theta: Doubles, phi: Doubles) -> Doubles:
    """Unit vectors (..., 3) at theta from z and phi from x."""
    sine = np.sin(theta)
    return np.stack([sine * np.cos(phi), sine * np.sin(phi), np.cos(theta) + 0.0 * phi], axis=-1)


def theta_of(u: Doubles) -> Doubles:
    """The angle from the normal at a place on the unit square's first axis, which is dense at the normal."""
    out: Doubles = 0.5 * np.pi * u**2
    return out


def phi_of(u: Doubles) -> Doubles:
    """The angle about the normal at a place on its second axis."""
    out: Doubles = (2 * u - 1) * np.pi
    return out


def area_of(u: Doubles) -> Doubles:
    """Steradians of a facet's normal over the area of the unit square, at a place on the first axis."""
    out: Doubles = 2 * np.pi**2 * u * np.sin(theta_of(u))
    return out


def mirrored(wo: Doubles, wm: Doubles) -> tuple[Doubles, Doubles]:
    """Where facets of the normals `wm` reflect light from `wo`, and the cosines between the two given ones."""
    cosine = (wo * wm).sum(axis=-1)
    return 2 * cosine[..., None] * wm - wo, cosine


def half_and_difference(wo: Doubles, wi: Doubles) -> tuple[Doubles, Doubles, Doubles]:
    """theta of the half vector, theta and phi of `wi` seen from there [Rusinkiewicz 1998]; phi is 0 .. pi, as
    exchanging the directions adds pi."""
    total, apart = wo + wi, wi - wo
    across = np.hypot(total[..., 0], total[..., 1])
    theta_h = np.arctan2(across, total[..., 2])
    theta_d = np.arctan2(np.linalg.norm(apart, axis=-1), np.linalg.norm(total, axis=-1))
    upright = across < 1e-12
    x = np.where(upright, 1.0, total[..., 0] / np.where(upright, 1.0, across))
    y = np.where(upright, 0.0, total[..., 1] / np.where(upright, 1.0, across))
    along = np.cos(theta_h) * (x * wi[..., 0] + y * wi[..., 1]) - np.sin(theta_h) * wi[..., 2]
    return theta_h, theta_d, np.arctan2(x * wi[..., 1] - y * wi[..., 0], along) % np.pi
