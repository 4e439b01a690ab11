"""Placed shapes -> the renderer's records and their bounds, relative to an origin."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gpu import layout
from gpu.layout import ShapeBit, ShapeKind
from gpu.layout.record import Record
from service.pack.geometry.analytic import AnalyticShapes, Solids

VAST = 2.0**8  # ratio of a ball's radius to the distance of its surface from the origin, and to the smallest shape

Bounds = tuple[np.ndarray, np.ndarray]  # (n, 3) each, float64


def analytic(placed: AnalyticShapes, origin: np.ndarray) -> dict[ShapeKind, tuple[np.ndarray, Bounds]]:
    """The records of all analytic shapes by kind, spheres first, with their bounds."""
    return {
        ShapeKind.SPHERE: spheres(placed, origin),
        ShapeKind.QUAD: quads(placed, origin),
        ShapeKind.BOX: boxes(placed, origin),
        ShapeKind.ELLIPSOID: ellipsoids(placed, origin),
    }


def spheres(placed: AnalyticShapes, origin: np.ndarray) -> tuple[np.ndarray, Bounds]:
    records = _records(layout.Sphere, placed.spheres_used)
    if not len(records):
        return records, _no_bounds()
    centers, radii, rotations = zip(*placed.spheres, strict=True)
    center, radius = np.array(centers) - origin, np.array(radii)
    records["center"], records["radius"], records["rotation"] = center, radius, rotations
    # Near the surface of a ball a place in float32 is precise to 2^-24 of the radius at best. Where the scene stands
    # on the ball, around the origin, that is not enough.
    away = np.linalg.norm(center, axis=1)
    power = (away - radius) * (away + radius)
    records["power"] = np.where(np.abs(away - radius) * VAST < radius, power, layout.NOT_VAST)
    return records, (center - radius[:, None], center + radius[:, None])


def only_vast(spheres: np.ndarray, low: np.ndarray, high: np.ndarray) -> None:
    """Clear the power of balls that are not vast beside the smallest of all shapes, which have boxes (n, 3)."""
    if len(spheres):
        least = (high - low).max(axis=1).min()
        spheres["power"] = np.where(spheres["radius"] > VAST * least, spheres["power"], layout.NOT_VAST)


def quads(placed: AnalyticShapes, origin: np.ndarray) -> tuple[np.ndarray, Bounds]:
    records = _records(layout.Quad, placed.quads_used)
    if not len(records):
        return records, _no_bounds()
    corners, us, vs, mirrored = zip(*placed.quads, strict=True)
    corner, u, v = np.array(corners) - origin, np.array(us), np.array(vs)
    cross = np.cross(u, v)
    area = np.linalg.norm(cross, axis=1)
    normal = cross / area[:, None]
    records["origin"], records["u"], records["v"] = corner, u, v
    # A mirroring transform keeps the front in front, and texture coordinates along u and v.
    records["normal"] = np.where(np.array(mirrored)[:, None], -normal, normal)
    records["area"] = area
    u_size, v_size = np.linalg.norm(u, axis=1), np.linalg.norm(v, axis=1)
    records["dual_u"] = np.cross(v, normal) / v_size[:, None]
    records["dual_v"] = np.cross(normal, u) / u_size[:, None]
    records["u_length"], records["v_length"] = area / v_size, area / u_size
    # The half extents of a parallelogram are the sums of its half edges' parts, those of its ellipse their length.
    is_round = np.array(placed.quads_round)[:, None]
    records["area"] *= np.where(is_round[:, 0], np.pi / 4, 1.0)
    corners4 = np.stack([corner, corner + u, corner + v, corner + u + v])
    middle, reach = corner + (u + v) / 2, np.hypot(u, v) / 2
    low = np.where(is_round, middle - reach, corners4.min(axis=0))
    high = np.where(is_round, middle + reach, corners4.max(axis=0))
    return records, (low, high)


def mark_bits(found: dict[ShapeKind, tuple[np.ndarray, Bounds]], placed: AnalyticShapes) -> None:
    """Set the bits of the quads and boxes of which only another shape in them is there."""
    found[ShapeKind.QUAD][0]["shape"] |= np.where(placed.quads_round, ShapeBit.ROUND, 0).astype(np.uint32)
    found[ShapeKind.BOX][0]["shape"] |= np.array(placed.boxes.bits, np.uint32)


def boxes(placed: AnalyticShapes, origin: np.ndarray) -> tuple[np.ndarray, Bounds]:
    return _solids(placed.boxes, origin)


def ellipsoids(placed: AnalyticShapes, origin: np.ndarray) -> tuple[np.ndarray, Bounds]:
    return _solids(placed.ellipsoids, origin)


def _solids(solids: Solids, origin: np.ndarray) -> tuple[np.ndarray, Bounds]:
    records = _records(layout.Solid, solids.used)
    if not len(records):
        return records, _no_bounds()
    center, axes = np.array(solids.centers) - origin, np.array(solids.axes)
    rows = np.linalg.inv(axes)
    records["center"] = center
    records["row_x"], records["row_y"], records["row_z"] = rows[:, 0], rows[:, 1], rows[:, 2]
    reach = np.array(solids.reaches)
    return records, (center - reach, center + reach)


def _records(record: type[Record], used: Sequence[tuple[int, int]]) -> np.ndarray:
    records = np.zeros(len(used), record.dtype)
    if used:
        records["material"], records["shape"] = np.array(used, np.uint32).T
        records["light"] = layout.NONE
    return records


def _no_bounds() -> Bounds:
    return np.zeros((0, 3)), np.zeros((0, 3))
