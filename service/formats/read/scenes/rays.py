"""Rays against a file's triangles, for metering and to tell rooms from other models: a few hundred rays, so numpy
does, and no tree is built.

A ray tries the boxes of the parts first, then those of runs of triangles (files store neighbours together), then the
triangles. Too many triangles are thinned out, and the rest is enlarged to the same area [Cook et al. 2007,
"Stochastic simplification of aggregate detail"].
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from service.formats.types import Doubles, Indices

MOST_PLACED = 2048  # parts in the world: the largest ones
MOST_TRIANGLES = 1 << 18  # of all parts together
RUN = 32  # triangles that share a box
NEAREST = 1e-6  # of the scene's size: closer hits are the surface that a ray leaves


@dataclass(frozen=True)
class Placed:
    """A part of the scene under its world matrix."""

    vertices: Doubles  # (n, 3)
    faces: Indices  # (m, 3)
    world: Doubles  # (4, 4)
    is_two_sided: bool
    material: str


@dataclass(frozen=True)
class Hit:
    distance: float  # along the ray, in lengths of its direction
    placed: Placed
    normal: Doubles  # (3,), of length one, towards the ray's origin
    is_front: bool  # whether the ray hit the outward side


class Triangles:
    """The triangles of a part, in runs with a box each."""

    def __init__(self, vertices: Doubles, faces: Indices, stride: int) -> None:
        corners = vertices[faces[::stride]].astype(np.float64)
        middles = corners.mean(axis=1, keepdims=True)
        corners = middles + (corners - middles) * np.sqrt(stride)
        self.origin, self.edges = corners[:, 0], corners[:, 1:] - corners[:, :1]
        starts = np.arange(0, len(corners), RUN)
        self.low = np.minimum.reduceat(corners.min(axis=1), starts)
        self.high = np.maximum.reduceat(corners.max(axis=1), starts)

    def nearest(self, origin: Doubles, direction: Doubles, least: float, most: float, side: int) -> tuple[float, int]:
        """The distance of the first hit between `least` and `most`, and its triangle; `most` and -1 where there is
        none. `side` 1 takes triangles seen from the front only, -1 from behind only, 0 both."""
        enters = entry(self.low, self.high, origin, direction, most)
        runs = np.flatnonzero(enters < most)
        rows = (runs[:, None] * RUN + np.arange(RUN)).reshape(-1)
        rows = rows[rows < len(self.origin)]
        first, second = self.edges[rows, 0], self.edges[rows, 1]
        across = np.cross(direction, second)
        det = np.einsum("ij,ij->i", first, across)
        facing = det * side >= 0
        with np.errstate(divide="ignore", invalid="ignore"):
            to = origin - self.origin[rows]
            u = np.einsum("ij,ij->i", to, across) / det
            along = np.cross(to, first)
            v = along @ direction / det
            t = np.einsum("ij,ij->i", second, along) / det
            hits = facing & (u >= 0) & (v >= 0) & (u + v <= 1) & (t > least) & (t < most)
        if not hits.any():
            return most, -1
        best = int(np.where(hits, t, np.inf).argmin())
        return float(t[best]), int(rows[best])


class Scene:
    """The triangles that rays can hit. Parts that stand in many places are prepared once."""

    def __init__(self, placed: list[Placed]) -> None:
        boxes = np.array([_world_box(one) for one in placed])
        largest = np.argsort(-np.ptp(boxes, axis=1).max(axis=1), kind="stable")[:MOST_PLACED]
        self._placed = [placed[k] for k in largest]
        self._low, self._high = boxes[largest, 0], boxes[largest, 1]
        self._least = NEAREST * float(np.ptp(boxes.reshape(-1, 3), axis=0).max())
        shared = {id(one.faces): len(one.faces) for one in self._placed}
        self._stride = -(-sum(shared.values()) // MOST_TRIANGLES)
        self._triangles: dict[int, Triangles] = {}

    def nearest(self, origin: Doubles, direction: Doubles, most: float = np.inf) -> Hit | None:
        """The first hit of a ray before `most` lengths of its direction, or None."""
        enters = entry(self._low, self._high, origin, direction, most)
        found = None
        for k in np.argsort(enters, kind="stable"):
            if not enters[k] < most:
                break
            placed = self._placed[k]
            inverse = np.linalg.inv(placed.world)
            local = inverse[:3, :3] @ origin + inverse[:3, 3], inverse[:3, :3] @ direction
            side = 0 if placed.is_two_sided else int(np.sign(np.linalg.det(placed.world[:3, :3])))
            least = self._least / float(np.linalg.norm(direction))
            distance, row = self._of(placed).nearest(*local, least, most, side)
            if row >= 0:
                most, found = distance, (placed, row, inverse)
        if found is None:
            return None
        outward = self._normal(*found)
        is_front = bool(outward @ direction < 0)
        return Hit(most, found[0], outward if is_front else -outward, is_front)

    def _of(self, placed: Placed) -> Triangles:
        key = id(placed.faces)
        if key not in self._triangles:
            self._triangles[key] = Triangles(placed.vertices, placed.faces, max(self._stride, 1))
        return self._triangles[key]

    def _normal(self, placed: Placed, row: int, inverse: Doubles) -> Doubles:
        first, second = self._of(placed).edges[row]
        normal = inverse[:3, :3].T @ np.cross(first, second)
        return np.asarray(normal / (float(np.linalg.norm(normal)) or 1.0))


def entry(low: Doubles, high: Doubles, origin: Doubles, direction: Doubles, most: float) -> Doubles:
    """(n,): the distances at which the ray enters the boxes (n, 3); infinite where it misses them before `most`."""
    direction = np.where(direction == 0, 1e-30, direction)  # else a ray along a face would give 0 / 0
    a, b = (low - origin) / direction, (high - origin) / direction
    near = np.maximum(np.minimum(a, b).max(axis=1), 0)
    far = np.minimum(np.maximum(a, b).min(axis=1), most)
    return np.where(near <= far * (1 + 1e-9), near, np.inf)  # a flat box must not be lost by rounding


def _world_box(one: Placed) -> Doubles:
    """(2, 3)"""
    low, high = one.vertices.min(axis=0).astype(np.float64), one.vertices.max(axis=0).astype(np.float64)
    middle, half = (
        one.world[:3, :3] @ ((low + high) / 2) + one.world[:3, 3],
        np.abs(one.world[:3, :3]) @ ((high - low) / 2),
    )
    return np.stack([middle - half, middle + half])
