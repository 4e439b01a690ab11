"""Shapes on which some materials are shown: a shell, a brilliant, a leaf, a lampshade. All are meshes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull, HalfspaceIntersection

AROUND = 72  # steps of a full turn
CROWN, PAVILION = math.radians(34.5), math.radians(40.8)  # of the cut whose light comes back to the eye
TABLE = 0.56  # radius of the table's corners; that of the girdle is 1
STAR, UPPER, LOWER = math.radians(21.5), math.radians(39.5), math.radians(42.2)
GIRDLE = 0.02  # half its height


def shell() -> dict[str, Any]:
    """A ball of radius 1 that is open at the top and hollow, 24 cm thick at its foot and 6 cm at the lip."""
    lip, inner, rise = math.radians(52), 0.86, 0.10
    outside = np.linspace(math.pi, lip, 40)
    hollow = np.linspace(lip, math.pi, 40)
    depth = rise * np.cos(hollow) + np.sqrt(inner**2 - (rise * np.sin(hollow)) ** 2)
    outer = np.stack([np.sin(outside), np.cos(outside)], axis=1)
    cavity = depth[:, None] * np.stack([np.sin(hollow), np.cos(hollow)], axis=1)
    # The lip is half a circle between the two, so that it catches a line of light.
    middle, radius = (outer[-1] + cavity[0]) / 2, float(np.linalg.norm(outer[-1] - cavity[0])) / 2
    turn = np.linspace(0, math.pi, 9)[1:-1]
    away, along = (outer[-1] - middle) / radius, np.array([-math.cos(lip), math.sin(lip)])
    round_lip = middle + radius * (np.cos(turn)[:, None] * away - np.sin(turn)[:, None] * along)
    return lathe(np.concatenate([outer, round_lip, cavity]))


def lampshade() -> dict[str, Any]:
    """A cone open at both ends, 3 cm thick: its rim has radius 1 at y = 0."""
    return lathe(np.array([[0.2, 0.86], [0.98, 0], [1.0, 0.0], [1.0, 0.03], [0.23, 0.9], [0.2, 0.9], [0.2, 0.86]]))


def lathe(profile: np.ndarray) -> dict[str, Any]:
    """A profile of (distance from the axis, height) turned about Y."""
    angles = np.linspace(0, 2 * math.pi, AROUND, endpoint=False)
    x = profile[:, None, 0] * np.sin(angles)
    z = profile[:, None, 0] * np.cos(angles)
    points = np.stack([x, np.broadcast_to(profile[:, None, 1], x.shape), z], axis=-1).reshape(-1, 3)
    corner = np.arange(len(points)).reshape(len(profile), AROUND)
    beside = np.roll(corner, -1, axis=1)
    a, b, c, d = (part.ravel() for part in (corner[:-1], beside[:-1], beside[1:], corner[1:]))
    return mesh(points, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))


def brilliant() -> dict[str, Any]:
    """The round cut with 57 facets, table up, its girdle about the origin."""
    eighth = np.arange(8) * math.pi / 4
    sixteenth = np.arange(16) * math.pi / 8 + math.pi / 16
    height = GIRDLE + (1 - TABLE) * math.tan(CROWN)
    planes = [[0.0, 1.0, 0.0, -height]]
    planes += [_facet(turn, CROWN, 1.0, GIRDLE) for turn in eighth]
    planes += [_facet(turn + math.pi / 8, STAR, TABLE * math.cos(math.pi / 8), height) for turn in eighth]
    planes += [_facet(turn, UPPER, 1.0, GIRDLE) for turn in sixteenth]
    planes += [_facet(turn, PAVILION, 1.0, -GIRDLE, -1.0) for turn in eighth]
    planes += [_facet(turn, LOWER, 1.0, -GIRDLE, -1.0) for turn in sixteenth]
    planes += [_facet(turn, math.pi / 2, 1.0, 0.0) for turn in np.arange(64) * math.pi / 32]
    points = np.unique(HalfspaceIntersection(np.array(planes), np.zeros(3)).intersections.round(7), axis=0)
    hull = ConvexHull(points)
    faces = hull.simplices.copy()
    corners = points[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = (normals * hull.equations[:, :3]).sum(axis=1) < 0
    faces[inward] = faces[inward][:, ::-1]
    return mesh(points, faces) | {"smooth": False}


def _facet(turn: float, slope: float, radius: float, height: float, side: float = 1.0) -> list[float]:
    """The half space below a plane that leans by `slope` from level and goes through a point on its azimuth."""
    normal = np.array([math.sin(slope) * math.sin(turn), side * math.cos(slope), math.sin(slope) * math.cos(turn)])
    return [*normal, -float(normal @ [radius * math.sin(turn), height, radius * math.cos(turn)])]


def leaf() -> dict[str, Any]:
    """A leaf that faces +Z, 2 m from its stalk to its point; it bends backwards to both sides of its rib."""
    length = np.linspace(0, 1, 49)
    half = 0.62 * np.sin(math.pi * length**0.8) ** 0.9 * (1 - 0.25 * length) + 0.012
    across = np.linspace(-1, 1, 33)
    x = half[:, None] * across
    y = np.broadcast_to(2 * length[:, None] - 1, x.shape) + 0.16 * np.abs(x)
    veins = np.abs(((length[:, None] * 9 - 1.6 * np.abs(across)) % 1) - 0.5)
    z = -0.34 * np.abs(x) ** 1.3 - 0.16 * (2 * length[:, None] - 1) ** 2 + 0.035 * veins * (1 - np.abs(across))
    points = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    corner = np.arange(len(points)).reshape(x.shape)
    a, b, c, d = (part.ravel() for part in (corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]))
    return mesh(points, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))


def mesh(points: np.ndarray, faces: np.ndarray) -> dict[str, Any]:
    return {"type": "mesh", "vertices": (points.round(5) + 0.0).tolist(), "faces": faces.tolist()}
