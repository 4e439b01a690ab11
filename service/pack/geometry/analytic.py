"""Analytic shapes in world space, in float64, before any rounding."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from service.document.numbers import LARGEST
from service.problems import FieldError, InvalidDocument

Vec3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]  # x, y, z, w
Used = tuple[int, int]  # indices of a shape's material and of the shape
Reach = Callable[[np.ndarray], np.ndarray]  # columns (3, 3) of world from object -> how far the solid reaches, (3,)

SAME_SCALE = 1e-6  # relative difference of scales up to which a sphere stays a sphere: typed matrices have 7 digits
SLACK = 2.0  # a box or an edge may reach from one end of the range of coordinates to the other
LEVEL = 1e-6  # sine of the tilt of a disk up to which it is level: where it leans would be noise
LEAST = 1e-12  # m; the cube of a shorter length, or of its inverse, is outside float32

# Corner and edges of the faces of the cube [-1, 1]^3: seen from outside u is right and v up, with +Y up;
# on the top v is -Z, on the bottom +Z.
CUBE_FACES = (
    ((-1, -1, 1), (2, 0, 0), (0, 2, 0)),
    ((1, -1, -1), (-2, 0, 0), (0, 2, 0)),
    ((1, -1, 1), (0, 0, -2), (0, 2, 0)),
    ((-1, -1, -1), (0, 0, 2), (0, 2, 0)),
    ((-1, 1, 1), (2, 0, 0), (0, 0, -2)),
    ((-1, -1, -1), (2, 0, 0), (0, 0, 2)),
)
CUBE_CAPS = CUBE_FACES[4:]  # those at the ends of its y axis


def cube_reach(axes: np.ndarray) -> np.ndarray:
    """How far the cube [-1, 1]^3 reaches along the world's axes: the sum of its own axes' parts."""
    return np.asarray(np.abs(axes).sum(axis=1))


def ball_reach(axes: np.ndarray) -> np.ndarray:
    """How far the unit sphere reaches: the length of its axes' parts."""
    return np.asarray(np.linalg.norm(axes, axis=1))


def pipe_reach(axes: np.ndarray) -> np.ndarray:
    """How far the cylinder in the cube about its y axis reaches: as its cross-section and its axis together."""
    return np.asarray(np.hypot(axes[:, 0], axes[:, 2]) + np.abs(axes[:, 1]))


@dataclass
class Solids:
    """Affine images of the unit sphere, of the cube [-1, 1]^3 or of a shape in it."""

    centers: list[Vec3] = field(default_factory=list)
    axes: list[np.ndarray] = field(default_factory=list)  # (3, 3) world from object
    used: list[Used] = field(default_factory=list)
    bits: list[int] = field(default_factory=list)  # of `layout.SHAPE_BITS`, that say which shape it is
    reaches: list[np.ndarray] = field(default_factory=list)  # half the sides of its box in the world

    def add(self, center: np.ndarray, axes: np.ndarray, used: Used, bits: int, reach: Reach) -> None:
        self.centers.append(tuple(center))
        self.reaches.append(reach(axes))
        self.axes.append(axes)
        self.used.append(used)
        self.bits.append(bits)


@dataclass
class AnalyticShapes:
    """The analytic shapes of a scene, by kind, in the document's order. `used` holds (material, shape) indices."""

    spheres: list[tuple[Vec3, float, Quaternion]] = field(default_factory=list)
    spheres_used: list[Used] = field(default_factory=list)
    quads: list[tuple[Vec3, Vec3, Vec3, bool]] = field(default_factory=list)  # origin, u, v, mirrored
    quads_used: list[Used] = field(default_factory=list)
    quads_round: list[bool] = field(default_factory=list)  # disks: of the quad only the ellipse in it is there
    boxes: Solids = field(default_factory=Solids)
    ellipsoids: Solids = field(default_factory=Solids)
    vanished: list[int] = field(default_factory=list)  # shapes too small to be traced

    def sphere(self, center: Vec3, radius: float, matrix: np.ndarray | None, used: Used) -> None:
        if matrix is None:
            if self._fits(used, center, radius):
                self._add_sphere(center, radius, (0.0, 0.0, 0.0, 1.0), used)
            return
        axes = matrix[:3, :3]
        middle = axes @ center + matrix[:3, 3]
        scale = math.cbrt(np.linalg.det(axes))
        turn = axes / scale
        if not self._fits(used, middle, *np.linalg.norm(axes, axis=0) * radius):
            return
        if scale > 0 and np.abs(turn.T @ turn - np.eye(3)).max() < SAME_SCALE:
            self._add_sphere(tuple(middle), scale * radius, quaternion(turn), used)
        else:
            self.ellipsoids.add(middle, axes * radius, used, 0, ball_reach)

    def _add_sphere(self, center: Vec3, radius: float, rotation: Quaternion, used: Used) -> None:
        self.spheres.append((center, radius, rotation))
        self.spheres_used.append(used)

    def quad(
        self, origin: Vec3, u: Vec3, v: Vec3, matrix: np.ndarray | None, used: Used, is_round: bool = False
    ) -> None:
        mirrored = False
        if matrix is not None:
            axes = matrix[:3, :3]
            mirrored = bool(np.linalg.det(axes) < 0)
            origin, u, v = tuple(axes @ origin + matrix[:3, 3]), tuple(axes @ u), tuple(axes @ v)
        if self._fits(used, origin, math.hypot(*u), math.hypot(*v)):
            self.quads.append((origin, u, v, mirrored))
            self.quads_used.append(used)
            self.quads_round.append(is_round)

    def box(self, whole: np.ndarray, used: Used, bits: int = 0, reach: Reach = cube_reach) -> None:
        """Add a box, the image of the cube [-1, 1]^3 under `whole`, or what its bits say is there of it."""
        self.boxes.add(whole[:3, 3], whole[:3, :3], used, bits, reach)

    def box_fits(self, whole: np.ndarray, used: Used) -> bool:
        return self._fits(used, whole[:3, 3], *np.linalg.norm(whole[:3, :3], axis=0))

    def _fits(self, used: Used, position: Vec3 | np.ndarray, *lengths: float) -> bool:
        """True if the shape is large enough for float32; records one that is not. Raises InvalidDocument where its
        transform puts it out of range."""
        check_reach(used[1], max(*map(abs, position), *lengths))
        if min(lengths) < LEAST:
            self.vanished.append(used[1])
            return False
        return True


def cube(center: np.ndarray, axes: np.ndarray, matrix: np.ndarray | None) -> np.ndarray:
    """(4, 4): the map of the cube [-1, 1]^3 to one with this middle and these half edges, and on by `matrix`."""
    placed = np.eye(4)
    placed[:3, :3], placed[:3, 3] = axes, center
    return placed if matrix is None else np.asarray(matrix @ placed)


def across(normal: Vec3) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors to the right and up, seen from where the normal points, with +Y up; of a level disk -Z is up from
    above and +Z from below, as on a box."""
    n = np.divide(normal, math.hypot(*normal))
    right = np.array([n[2], 0.0, -n[0]])
    length = math.hypot(*right)
    right = right / length if length > LEVEL else np.array([1.0, 0.0, 0.0])
    return right, np.cross(n, right) / math.hypot(*np.cross(n, right))


def check_reach(shape: int, reach: float) -> None:
    """Raise InvalidDocument where a transform moves or stretches a shape beyond the range of a document's numbers."""
    if not reach <= SLACK * LARGEST:
        detail = f"takes the shape {reach:.3g} m far; at most {LARGEST:g}"
        raise InvalidDocument([FieldError(f"/shapes/{shape}/transform", detail)])


def quaternion(m: np.ndarray) -> Quaternion:
    """(x, y, z, w) of a rotation matrix, by its greatest component, so that nothing cancels [Shepperd 1978]."""
    squares = np.array([
        1 + m[0, 0] - m[1, 1] - m[2, 2],
        1 - m[0, 0] + m[1, 1] - m[2, 2],
        1 - m[0, 0] - m[1, 1] + m[2, 2],
        1 + m[0, 0] + m[1, 1] + m[2, 2],
    ])  # fmt: skip
    rows = np.array([
        [squares[0], m[0, 1] + m[1, 0], m[0, 2] + m[2, 0], m[2, 1] - m[1, 2]],
        [m[0, 1] + m[1, 0], squares[1], m[1, 2] + m[2, 1], m[0, 2] - m[2, 0]],
        [m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], squares[2], m[1, 0] - m[0, 1]],
        [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], squares[3]],
    ])  # fmt: skip
    x, y, z, w = rows[int(np.argmax(squares))]
    length = math.sqrt(x * x + y * y + z * z + w * w)
    return float(x / length), float(y / length), float(z / length), float(w / length)
