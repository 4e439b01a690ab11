"""Analytic shapes as triangles, with the texture coordinates that the document gives them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from service.document.shape import BoxShape, CylinderShape, DiskShape, QuadShape, Shape, SphereShape
from service.formats.types import Doubles, Indices
from service.pack.geometry.analytic import CUBE_CAPS, CUBE_FACES, across

AROUND, UPWARD = 96, 48  # steps of a sphere: its outline is off by at most 0.0006 of the radius
RIM = 96  # steps of a disk and a cylinder
FACES = np.array(CUBE_FACES, float)
CORNERS = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
HALVES = np.array([[0, 1, 2], [0, 2, 3]])


@dataclass(frozen=True)
class Tessellated:
    """Triangles in a space of their own; `matrix` (4, 4) leads from there to the shape's. Equal keys: equal
    triangles."""

    key: tuple[object, ...]
    vertices: Doubles
    faces: Indices
    uvs: Doubles  # v pointing up
    normals: Doubles | None  # None: flat
    matrix: Doubles
    is_sheet: bool = False  # its back can be seen


def tessellated(shape: Shape) -> Tessellated:
    """The shape, which is no mesh, without its transform."""
    return _KINDS[type(shape)](shape)


def _sphere(shape: SphereShape) -> Tessellated:
    """Rings from the south pole to the north; u = 1/2 + atan2(x, z) / (2 pi), v = 1 - acos(y) / pi. The last vertex
    of a ring repeats the first with u = 1, and at a pole each triangle has a vertex of its own."""
    u, v = np.meshgrid(np.arange(AROUND + 1) / AROUND, np.arange(UPWARD + 1) / UPWARD)
    turn, rise = 2 * math.pi * (u - 0.5), math.pi * (1 - v)
    ring = np.where((v == 0) | (v == 1), 0.0, np.sin(rise))
    points = np.stack([np.sin(turn) * ring, np.cos(rise), np.cos(turn) * ring], axis=-1)
    points[:, -1] = points[:, 0]
    uvs = np.stack([u, v], axis=-1)
    for pole in (0, -1):
        uvs[pole, :, 0] += 0.5 / AROUND
    j, i = np.divmod(np.arange(AROUND * UPWARD), AROUND)
    a = j * (AROUND + 1) + i
    b, d = a + 1, a + AROUND + 1
    last = j == UPWARD - 1
    lower, upper = np.stack([a, b, np.where(last, d, d + 1)], axis=1)[j > 0], np.stack([a, d + 1, d], axis=1)[~last]
    flat = points.reshape(-1, 3)
    matrix = np.diag([shape.radius, shape.radius, shape.radius, 1.0])
    matrix[:3, 3] = shape.center
    faces = _whole(np.concatenate([lower, upper]))
    return Tessellated(("sphere",), flat, faces, uvs.reshape(-1, 2), flat, matrix)


def _box(shape: BoxShape) -> Tessellated:
    low, high = np.array(shape.min), np.array(shape.max)
    vertices = FACES[:, :1] + CORNERS[:, :1] * FACES[:, 1:2] + CORNERS[:, 1:] * FACES[:, 2:]
    faces = np.concatenate([HALVES + 4 * k for k in range(len(FACES))])
    matrix = np.diag([*((high - low) / 2), 1.0])
    matrix[:3, 3] = (low + high) / 2
    uvs = np.tile(CORNERS, (len(FACES), 1))
    return Tessellated(("box",), vertices.reshape(-1, 3), _whole(faces), uvs, None, matrix)


def _quad(shape: QuadShape) -> Tessellated:
    origin, u, v = (np.array(each, float) for each in (shape.origin, shape.u, shape.v))
    vertices = origin + CORNERS[:, :1] * u + CORNERS[:, 1:] * v
    key = ("quad", *shape.origin, *shape.u, *shape.v)
    return Tessellated(key, vertices, _whole(HALVES), CORNERS, None, np.eye(4), is_sheet=True)


def _disk(shape: DiskShape) -> Tessellated:
    """In the plane of its normal, with the coordinates of the square around it."""
    right, up = across(shape.normal)
    flat, faces = _fan()
    vertices = np.column_stack([flat, np.zeros(len(flat))])
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([right, up, np.cross(right, up)], axis=1) * shape.radius
    matrix[:3, 3] = shape.center
    return Tessellated(("disk",), vertices, _whole(faces), (flat + 1) / 2, None, matrix, is_sheet=True)


def _fan() -> tuple[Doubles, np.ndarray]:
    """The unit disk: its middle, its rim, and the triangles between them."""
    turn = 2 * math.pi * np.arange(RIM) / RIM
    k = np.arange(RIM)
    flat = np.concatenate([[[0.0, 0.0]], np.stack([np.cos(turn), np.sin(turn)], axis=1)])
    return flat, np.stack([0 * k, 1 + k, 1 + (k + 1) % RIM], axis=1)


def _cylinder(shape: CylinderShape) -> Tessellated:
    """In the cube [-1, 1]^3, about its y axis: the side, with u as on a sphere, and the caps as of a box."""
    u = np.arange(RIM + 1) / RIM
    turn = 2 * math.pi * (u - 0.5)
    ring = np.stack([np.sin(turn), 0 * turn, np.cos(turn)], axis=1)
    ring[-1] = ring[0]
    up = np.array([0.0, 1.0, 0.0])
    vertices = [ring - up, ring + up]
    normals, uvs = [ring, ring], [np.stack([u, 0 * u + v], axis=1) for v in (0, 1)]
    a = np.arange(RIM)
    faces = [np.stack([a, a + 1, a + RIM + 2], axis=1), np.stack([a, a + RIM + 2, a + RIM + 1], axis=1)]
    if shape.caps:
        flat, fan = _fan()
        for corner, along, upward in np.array(CUBE_CAPS, float):
            faces.append(fan + sum(map(len, vertices)))
            vertices.append(corner + (flat[:, :1] + 1) / 2 * along + (flat[:, 1:] + 1) / 2 * upward)
            normals.append(np.tile(np.cross(along, upward) / 4, (len(flat), 1)))
            uvs.append((flat + 1) / 2)
    right, back = across(shape.axis)
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([shape.radius * right, np.array(shape.axis) / 2, -shape.radius * back], axis=1)
    matrix[:3, 3] = np.array(shape.base) + np.array(shape.axis) / 2
    return Tessellated(
        ("cylinder", shape.caps), np.concatenate(vertices), _whole(np.concatenate(faces)), np.concatenate(uvs),
        np.concatenate(normals), matrix, is_sheet=not shape.caps,
    )  # fmt: skip


def _whole(faces: np.ndarray) -> Indices:
    return faces.astype(np.int32)


_KINDS: dict[type[Shape], Callable[[Any], Tessellated]] = {
    SphereShape: _sphere, QuadShape: _quad, DiskShape: _disk, CylinderShape: _cylinder, BoxShape: _box,
}  # fmt: skip
