"""A row for each kind of light: how far it reaches in space, and what it shows of itself."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np

from gpu.kernels.shape_kinds import corners, half_axes2, solid_axes
from gpu.layout import LightKind, ShapeKind

Extent = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


class LightRow(NamedTuple):
    """`shape` is the kind of the records of a light that is a shape. `extent` gives their middles (n, 3) and areas
    (n,), m^2; `seen` the middles and, about, the areas that are seen from one side."""

    is_point: bool = False  # it has a position and an intensity
    is_aimed: bool = False  # it does not shine in all directions
    shape: ShapeKind | None = None
    extent: Extent | None = None
    seen: Extent | None = None


def _sphere_extent(spheres: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return spheres["center"], 4 * np.pi * spheres["radius"].astype(float) ** 2


def _sphere_seen(spheres: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return spheres["center"], np.pi * spheres["radius"].astype(float) ** 2


def _quad(quads: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return quads["origin"] + 0.5 * (quads["u"] + quads["v"]), quads["area"]


def _triangle_extent(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    points = corners(triangles)
    sides = points[:, 1:] - points[:, :1]
    return points.mean(axis=1), 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)


def _triangle_seen(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    a, b, c = (triangles[name].astype(float) for name in ("v0", "v1", "v2"))
    return (a + b + c) / 3, 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)


def _ellipsoid_extent(solids: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return solids["center"], 4 * np.pi * half_axes2(solids).mean(axis=1)


def _cylinder_extent(solids: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    lengths = np.linalg.norm(solid_axes(solids), axis=1)
    return solids["center"], 4 * np.pi * lengths[:, 1] * np.sqrt((lengths[:, 0] ** 2 + lengths[:, 2] ** 2) / 2)


def _solid_seen(solids: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """As balls of the same volume."""
    rows = np.stack([solids[f"row_{axis}"] for axis in "xyz"], axis=1).astype(float)  # object from world
    return solids["center"], np.pi * np.maximum(np.abs(np.linalg.det(rows)), 1e-30) ** (-2 / 3)


KINDS = {
    LightKind.POINT: LightRow(is_point=True),
    LightKind.ENVIRONMENT: LightRow(),
    LightKind.SPOT: LightRow(is_point=True, is_aimed=True),
    LightKind.DIRECTIONAL: LightRow(),
    LightKind.SPHERE: LightRow(False, False, ShapeKind.SPHERE, _sphere_extent, _sphere_seen),
    LightKind.QUAD: LightRow(False, True, ShapeKind.QUAD, _quad, _quad),
    LightKind.TRIANGLE: LightRow(False, True, ShapeKind.TRIANGLE, _triangle_extent, _triangle_seen),
    LightKind.ELLIPSOID: LightRow(False, False, ShapeKind.ELLIPSOID, _ellipsoid_extent, _solid_seen),
    LightKind.CYLINDER: LightRow(False, False, ShapeKind.BOX, _cylinder_extent, _solid_seen),
}

POINTS = tuple(kind for kind, row in KINDS.items() if row.is_point)
OF_SHAPES = tuple(kind for kind, row in KINDS.items() if row.shape is not None)


def flags(kinds: Iterable[LightKind]) -> frozenset[str]:
    return frozenset(f"HAS_{kind.name}_LIGHTS" for kind in kinds)


_SOLIDS = (ShapeKind.BOX, ShapeKind.ELLIPSOID)
NEAR = flags((*POINTS, *OF_SHAPES))  # flags of lights that are somewhere
# Defines, and the kinds of which a kernel has some where they are 1.
GROUPS = {
    "ANY_POINT_LIGHTS": POINTS,
    "ANY_AIMED_LIGHTS": tuple(kind for kind, row in KINDS.items() if row.is_aimed),
    "ANY_SOLID_LIGHTS": tuple(kind for kind, row in KINDS.items() if row.shape in _SOLIDS),
}
