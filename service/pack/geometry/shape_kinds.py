"""A row for each kind of shape but meshes: how it is placed in the world, and what other modules ask of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from gpu.layout import ShapeBit
from service.document.numbers import Vec3
from service.document.shape import BoxShape, CylinderShape, DiskShape, QuadShape, Shape, SphereShape
from service.pack.geometry.analytic import CUBE_CAPS, CUBE_FACES, AnalyticShapes, Used, across, cube, pipe_reach

# Adds a shape under its matrix (None: none) to the placed ones; the last argument is true where it shines.
Place = Callable[[AnalyticShapes, Any, np.ndarray | None, Used, bool], None]


@dataclass(frozen=True)
class ShapeRow:
    place: Place
    middle: Callable[[Any], Vec3]  # the origin of the coordinates of solid textures
    is_open: Callable[[Any], bool] = lambda _: False  # true where light leaves its inside by an opening


def _sphere(
    placed: AnalyticShapes, shape: SphereShape, matrix: np.ndarray | None, used: Used, emissive: bool
) -> None:
    placed.sphere(shape.center, shape.radius, matrix, used)


def _quad(placed: AnalyticShapes, shape: QuadShape, matrix: np.ndarray | None, used: Used, emissive: bool) -> None:
    placed.quad(shape.origin, shape.u, shape.v, matrix, used)


def _disk(placed: AnalyticShapes, shape: DiskShape, matrix: np.ndarray | None, used: Used, emissive: bool) -> None:
    right, up = across(shape.normal)
    u, v = 2 * shape.radius * right, 2 * shape.radius * up
    placed.quad(tuple(shape.center - (u + v) / 2), tuple(u), tuple(v), matrix, used, is_round=True)


def _box(placed: AnalyticShapes, shape: BoxShape, matrix: np.ndarray | None, used: Used, emissive: bool) -> None:
    """One that shines becomes six quads, as lights are sampled face by face."""
    low, high = shape.min, shape.max
    whole = cube(np.add(low, high) / 2, np.diag(np.subtract(high, low) / 2), matrix)
    if not placed.box_fits(whole, used):
        return
    if not emissive:
        placed.box(whole, used)
        return
    for origin, u, v in CUBE_FACES:
        placed.quad(origin, u, v, whole, used)


def _cylinder(
    placed: AnalyticShapes, shape: CylinderShape, matrix: np.ndarray | None, used: Used, emissive: bool
) -> None:
    """One that shines becomes its side and two disks, as lights are sampled face by face."""
    along = np.array(shape.axis)
    right, up = across(shape.axis)
    axes = np.stack([shape.radius * right, along / 2, -shape.radius * up], axis=1)
    whole = cube(np.add(shape.base, along / 2), axes, matrix)
    if not placed.box_fits(whole, used):
        return
    is_open = emissive or not shape.caps
    placed.box(whole, used, ShapeBit.ROUND | (ShapeBit.OPEN if is_open else 0), pipe_reach)
    if emissive and shape.caps:
        for origin, u, v in CUBE_CAPS:
            placed.quad(origin, u, v, whole, used, is_round=True)


def _middle_of_cylinder(shape: CylinderShape) -> Vec3:
    x, y, z = (a + b / 2 for a, b in zip(shape.base, shape.axis, strict=True))
    return x, y, z


def _middle_of_box(shape: BoxShape) -> Vec3:
    x, y, z = ((a + b) / 2 for a, b in zip(shape.min, shape.max, strict=True))
    return x, y, z


KINDS: dict[type[Shape], ShapeRow] = {
    SphereShape: ShapeRow(_sphere, lambda shape: shape.center),
    QuadShape: ShapeRow(_quad, lambda shape: shape.origin),
    DiskShape: ShapeRow(_disk, lambda shape: shape.center),
    CylinderShape: ShapeRow(_cylinder, _middle_of_cylinder, lambda shape: not shape.caps),
    BoxShape: ShapeRow(_box, _middle_of_box),
}
