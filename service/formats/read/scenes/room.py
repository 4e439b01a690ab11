"""Closed rooms: models whose walls face inwards on all sides, of which a camera outside would show nothing.

Walls are often single-sided. From behind they are not there, and no light of an environment comes in, as their fronts
stop it: a picture from outside is black.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from service.formats.read.scenes import looks
from service.formats.read.scenes.framing import Bounds
from service.formats.read.scenes.rays import Hit, Placed, Scene
from service.formats.types import Doubles

# The share of the box around it that a model must enclose with its walls facing inwards before rays are traced: a
# round room encloses half of its box, and furniture takes some of that away.
LEAST_ENCLOSED = 0.3
LEAST_TWO_SIDED = 0.6  # the same where walls are two-sided: a picture from outside is not black then
GRID = 5  # rays along each edge of a side of the box
MOSTLY = 0.5  # of the rays from each side that hit something: doors and windows take the rest
FURNISHED = 0.02  # of all rays, those that meet more than a wall and the wall across
INSET = 0.12  # from the walls to where the camera may stand, of the box's extents
VFOV = 65.0  # degrees; that of the default camera shows only a corner of a room
VIEW = 5  # rays along each edge of the picture, which measure how much a place sees
EYE, LAMP = 0.5, 0.8  # heights over the floor, of the room's
BRIGHTNESS = 0.7  # by which a lamp at a room's middle gives walls of albedo 0.5 a radiance of about 0.2
CHUNK = 1 << 16  # triangles at once

Document = dict[str, Any]


def stand_inside(document: Document, placed: list[Placed], bounds: Bounds, has_camera: bool = False) -> str | None:
    """Put the document's camera into a closed room, and a lamp where nothing in it shines. What was done, for the
    warnings; None where the model is no room. A file's own camera (`has_camera`) stays.
    """
    enclosed = _enclosed(placed, bounds)
    if enclosed < LEAST_ENCLOSED:
        return None
    scene = Scene([replace(one, is_two_sided=True) for one in placed])  # rays hit walls from behind as well
    if not _is_room(scene, {one.material: one.is_two_sided for one in placed}, bounds, enclosed):
        return None
    camera = None if has_camera else _camera(scene, bounds)
    if camera is not None:
        document["camera"] = camera
    if document.get("lights") or any(looks.emission(material) > 0 for material in document["materials"].values()):
        return None if camera is None else "the model is a closed room: the camera stands inside"
    document["lights"] = [_lamp(scene, document["camera"], bounds)]
    done = "a lamp is added" if camera is None else "the camera stands inside, and a lamp is added"
    return f"the model is a closed room that no light enters: {done}"


def _enclosed(placed: list[Placed], bounds: Bounds) -> float:
    """The share of the box that surfaces enclose which face inwards, less what others enclose: by the divergence
    theorem, with the box's middle as the origin."""
    low, high = (np.asarray(corner, np.float64) for corner in bounds)
    volume = float(np.prod(high - low))
    if not volume > 0:
        return 0.0
    sums = {id(one.faces): one for one in placed}
    by_faces = {key: _sums(one) for key, one in sums.items()}
    worlds = np.array([one.world for one in placed], np.float64)
    dots = np.array([by_faces[id(one.faces)][0] for one in placed])
    areas = np.array([by_faces[id(one.faces)][1] for one in placed])
    linear, moved = worlds[:, :3, :3], worlds[:, :3, 3] - (low + high) / 2
    cofactors = np.stack([np.cross(linear[:, :, k - 2], linear[:, :, k - 1]) for k in range(3)], axis=-1)
    det = np.linalg.det(linear)
    outward = np.sign(det)  # under a mirroring matrix outward stays outward
    found = np.abs(det) * dots + outward * np.einsum("ni,nij,nj->n", moved, cofactors, areas)
    return -float(found.sum()) / 3 / volume


def _sums(one: Placed) -> tuple[float, Doubles]:
    """Sums over all triangles: of a corner times the area vector, and of the area vectors."""
    dot, area = 0.0, np.zeros(3)
    for at in range(0, len(one.faces), CHUNK):
        a, b, c = (one.vertices[one.faces[at : at + CHUNK, k]].astype(np.float64) for k in range(3))
        across = np.cross(b - a, c - a) / 2
        dot += float(np.einsum("ij,ij->", a, across))
        area += across.sum(axis=0)
    return dot, area


def _is_room(scene: Scene, two_sided: dict[str, bool], bounds: Bounds, enclosed: float) -> bool:
    """True if rays from each side of the box meet the backs of walls first. Two-sided walls count only where there is
    something inside: an empty body that faces inwards is rather a solid turned inside out."""
    low, high = bounds
    extent, backs, more, rays = high - low, list[Hit](), 0, 0
    steps = (np.arange(GRID) + 0.5) / GRID
    for axis in range(3):
        for side in (0.0, 1.0):
            hits = list[Hit]()
            for u in steps:
                for v in steps:
                    at = np.insert(np.array([u, v]), axis, side)
                    direction = (1 - 2 * side) * 1.02 * extent[axis] * np.eye(3)[axis]
                    origin = low + at * extent - 0.01 * direction
                    hit = scene.nearest(origin, direction, 1.0)
                    rays += 1
                    if hit is not None:
                        hits.append(hit)
                        more += _crosses_more(scene, origin, direction, hit)
            behind = [hit for hit in hits if not hit.is_front]
            if len(behind) <= MOSTLY * len(hits) or not hits:
                return False
            backs += behind
    is_two_sided = sum(two_sided[hit.placed.material] for hit in backs) > len(backs) / 2
    return not is_two_sided or (more >= FURNISHED * rays and enclosed >= LEAST_TWO_SIDED)


def _crosses_more(scene: Scene, origin: Doubles, direction: Doubles, first: Hit) -> bool:
    """True if a ray through the box meets more than two surfaces."""
    hit: Hit | None = first
    for _ in range(2):
        assert hit is not None
        origin = origin + hit.distance * direction
        hit = scene.nearest(origin, direction)
        if hit is None:
            return False
    return True


def _camera(scene: Scene, bounds: Bounds) -> Document | None:
    """Where most of the room is seen, from places around it at the height of eyes; None where none is in the room."""
    low, high = bounds
    extent, middle = high - low, (low + high) / 2
    best, chosen = 0.0, None
    target = np.array([middle[0], low[1] + EYE * extent[1], middle[2]])
    for x in (INSET, 0.5, 1 - INSET):
        for z in (INSET, 0.5, 1 - INSET):
            if x == z == 0.5:
                continue
            eye = low + np.array([x, EYE, z]) * extent
            seen = _seen(scene, eye, target)
            if seen > best:
                best, chosen = seen, eye
    if chosen is None:
        return None
    return {"position": chosen.tolist(), "target": target.tolist(), "vfov": VFOV}


def _seen(scene: Scene, eye: Doubles, target: Doubles) -> float:
    """The mean distance that a camera sees; backs, which are seen from within walls and furniture, count as 0."""
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, (0.0, 1.0, 0.0))
    up = np.cross(right, forward)
    slope = math.tan(math.radians(VFOV / 2))
    total = 0.0
    for x in np.linspace(-slope, slope, VIEW):
        for y in np.linspace(-slope, slope, VIEW):
            direction = forward + x * right + y * up
            hit = scene.nearest(eye, direction)
            total += hit.distance if hit is not None and hit.is_front else 0.0
    return total / VIEW**2


def _lamp(scene: Scene, camera: Document, bounds: Bounds) -> Document:
    """A point light high in the middle of the room, or where the camera stands if it does not see that."""
    low, high = bounds
    extent, eye = high - low, np.array(camera["position"])
    place = low + np.array([0.5, LAMP, 0.5]) * extent
    if scene.nearest(eye, place - eye, 1.0) is not None:
        place = eye
    intensity = BRIGHTNESS * float((extent**2).mean()) / 4
    return {"type": "point", "position": place.tolist(), "intensity": intensity}
