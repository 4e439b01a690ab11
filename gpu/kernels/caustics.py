"""Starts of paths of light: the lights that they leave, and the targets that they are aimed at. The targets are balls
around all shapes that may mirror or refract perfectly (shaders/lights/emission.glsl)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gpu import layout
from gpu.arrays import SceneArrays
from gpu.kernels.deltas import may_be_specular, throws_caustics
from gpu.kernels.light_kinds import KINDS as LIGHTS
from gpu.kernels.light_kinds import OF_SHAPES, POINTS
from gpu.kernels.shape_kinds import KINDS as SHAPES
from gpu.kernels.shape_kinds import records
from gpu.layout import LightKind, ShapeKind

MOST_TARGETS = 16  # a ray asks each of them for its density
# Light from this solid angle, in sr, or less is better traced from the lights. (A disk of 20 degrees has 0.1 sr.)
SMALL = 0.15
_EVEN = 0.1  # the share of the paths that all lights get alike: what their power brings is a guess
_ROOM = 1.0001  # of a ball, over what is inside: a rounding shall put none of that outside
_FAR = 1e4  # radii of all targets together, from which light from infinity comes at most


class Sources(NamedTuple):
    """Where paths of light begin, and what they are aimed at."""

    targets: np.ndarray  # (n, 4) float64: centre and radius
    lights: np.ndarray  # indices among the scene's
    chances: np.ndarray  # of each of these
    far: float  # m from the first target: nothing that light from infinity could meet lies beyond


def may_throw(scene: SceneArrays) -> bool:
    """True if there are a light and a surface of which paths of light can make something."""
    return bool(may_be_specular(scene.materials).any()) and bool(_shining(scene).any())


def throws(scene: SceneArrays) -> bool:
    """True if caustics are better traced from the lights: smooth glass or a mirror, and a light of small extent."""
    specular = throws_caustics(scene.materials)
    if not specular.any():
        return False
    kinds, lights = scene.lights["kind"], scene.lights
    cap = SMALL / (2 * np.pi)
    if np.isin(kinds, POINTS).any() or ((kinds == LightKind.DIRECTIONAL) & (lights["spread"] < cap)).any():
        return True
    environment = scene.environment
    if environment is not None and environment.sun is not None and environment.sun.cap < cap:
        return True
    shapes = np.isin(kinds, OF_SHAPES)
    if not shapes.any():
        return False
    found = targets(scene, specular)
    centers, areas = _extents(scene, lights[shapes])
    # All triangles of a mesh are one lamp: what counts is the solid angle of all of them.
    away2 = ((centers[:, None] - found[None, :, :3]) ** 2).sum(axis=2)
    return bool(len(found) and ((areas[:, None] / np.maximum(away2, 1e-30)).sum(axis=0) / 4 < SMALL).any())


def hides(scene: SceneArrays) -> bool:
    """True if there are caustics of lamps without extent, which the camera's paths cannot find."""
    kinds, spread = scene.lights["kind"], scene.lights["spread"]
    lamps = np.isin(kinds, POINTS) | ((kinds == LightKind.DIRECTIONAL) & (spread <= 0))
    return bool(lamps.any() and throws_caustics(scene.materials).any())


def _shining(scene: SceneArrays) -> np.ndarray:
    """The lights that paths of light leave: all but the environment, of which only a sun is traced so."""
    kinds = scene.lights["kind"]
    sunny = scene.environment is not None and scene.environment.sun is not None
    return np.asarray((kinds != LightKind.ENVIRONMENT) | sunny)


def words(scene: SceneArrays) -> np.ndarray:
    """The words of shaders/lights/emission.glsl: (n, 4) uint32. No light where there is no target."""
    found = sources(scene)
    count = len(found.targets) if len(found.lights) else 0
    head = np.zeros((1, 4), np.uint32)
    head[0, :2] = count, len(found.lights) if count else 0
    head[0, 2] = np.float32(found.far).view(np.uint32)
    balls = found.targets[:count].astype(np.float32).view(np.uint32)
    rows = np.zeros((len(found.lights) if count else 0, 4), np.uint32)
    if len(rows):
        up_to = np.cumsum(found.chances)
        rows[:, 0] = found.lights
        rows[:, 1] = found.chances.astype(np.float32).view(np.uint32)
        rows[:, 2] = (up_to / up_to[-1]).astype(np.float32).view(np.uint32)
    return np.concatenate([head, balls, rows])


def sources(scene: SceneArrays) -> Sources:
    """The lights that paths of light leave, and their targets."""
    balls = targets(scene, may_be_specular(scene.materials))
    shining = np.flatnonzero(_shining(scene))
    if not len(balls) or not len(shining):
        return Sources(balls, shining[:0], np.zeros(0), 0.0)
    power = _power(scene, scene.lights[shining], balls)
    total = power.sum()
    even = np.full(len(shining), 1 / len(shining))
    chances = even if not total > 0 else (1 - _EVEN) * power / total + _EVEN * even
    return Sources(balls, shining, chances, _far(scene, balls))


def _power(scene: SceneArrays, lights: np.ndarray, balls: np.ndarray) -> np.ndarray:
    """About the power of each light that comes to the targets."""
    kinds, luminance = lights["kind"], np.asarray(layout.LUMINANCE)
    intensity = lights["intensity"].astype(float) @ luminance
    disks = float((np.pi * balls[:, 3] ** 2).sum())
    out = np.zeros(len(lights))
    spread = lights["spread"].astype(float)
    sun = (kinds == LightKind.DIRECTIONAL) & (spread > 0)
    out[kinds == LightKind.DIRECTIONAL] = disks * intensity[kinds == LightKind.DIRECTIONAL]
    out[sun] *= np.pi * (spread * (2 - spread))[sun]
    environment = scene.environment
    if environment is not None and environment.sun is not None:
        irradiance = np.asarray(environment.sun.radiance, float) @ luminance * 2 * np.pi * environment.sun.cap
        out[kinds == LightKind.ENVIRONMENT] = disks * irradiance * environment.scale
    lamps = np.isin(kinds, POINTS)
    out[lamps] = intensity[lamps] * _solid_angles(lights["position"][lamps].astype(float), balls)
    shapes = np.isin(kinds, OF_SHAPES)
    emission = scene.materials["emission"][lights["material"][shapes]].astype(float)
    emission[emission == np.float32(layout.TEXTURED)] = 1.0
    centers, areas = _extents(scene, lights[shapes])
    out[shapes] = emission @ luminance * areas * _solid_angles(centers, balls)
    return out


def _solid_angles(p: np.ndarray, balls: np.ndarray) -> np.ndarray:
    """The sum of the solid angles of all balls, as seen from each of the points."""
    out = np.zeros(len(p))
    for ball in balls:
        sin2 = ball[3] ** 2 / np.maximum(((p - ball[:3]) ** 2).sum(axis=1), 1e-300)
        out += 2 * np.pi * np.where(sin2 < 1, 1 - np.sqrt(1 - np.minimum(sin2, 1)), 2.0)
    return out


def _extents(scene: SceneArrays, lights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The centres and the areas of lights that are shapes."""
    centers, areas = np.zeros((len(lights), 3)), np.zeros(len(lights))
    for kind in OF_SHAPES:
        mine, row = lights["kind"] == kind, LIGHTS[kind]
        assert row.shape is not None and row.extent is not None
        centers[mine], areas[mine] = row.extent(records(scene, row.shape)[lights["index"][mine]])
    return centers, areas


def targets(scene: SceneArrays, specular: np.ndarray) -> np.ndarray:
    """Balls around all shapes of the materials that are `specular`, (n, 4): centre and radius."""
    parts = [_of(scene, kind, specular) for kind in ShapeKind]
    return _merged(np.concatenate(parts)) * (1, 1, 1, _ROOM)


def _of(scene: SceneArrays, kind: ShapeKind, chosen: np.ndarray | None) -> np.ndarray:
    """Balls around the shapes of a kind, of some materials or of all."""
    some = records(scene, kind)
    if kind == ShapeKind.TRIANGLE and len(scene.instances):
        some = some[: int(scene.instances["first"].min())]  # the others are of instances
    if chosen is not None:
        some = some[chosen[some["material"]]]
    return SHAPES[kind].around(some) if len(some) else np.zeros((0, 4))


def _around(balls: np.ndarray) -> np.ndarray:
    """A ball around balls."""
    low, high = (balls[:, :3] - balls[:, 3:]).min(axis=0), (balls[:, :3] + balls[:, 3:]).max(axis=0)
    center = 0.5 * (low + high)
    return np.append(center, (np.linalg.norm(balls[:, :3] - center, axis=1) + balls[:, 3]).max())


def _merged(balls: np.ndarray) -> np.ndarray:
    """At most MOST_TARGETS balls around all of them: the largest group is halved until there are that many."""
    if len(balls) <= MOST_TARGETS:
        return balls
    groups = [balls]
    while len(groups) < MOST_TARGETS:
        sizes = [_around(group)[3] if len(group) > 1 else -1.0 for group in groups]
        group = groups.pop(int(np.argmax(sizes)))
        axis = int(np.argmax(np.ptp(group[:, :3], axis=0)))
        ordered = group[np.argsort(group[:, axis], kind="stable")]
        groups += [ordered[: len(ordered) // 2], ordered[len(ordered) // 2 :]]
    return np.array([_around(group) for group in groups])


def _far(scene: SceneArrays, balls: np.ndarray) -> float:
    """The distance from the first target beyond which nothing is."""
    first = balls[0, :3]
    reach = max((np.linalg.norm(b[:, :3] - first, axis=1) + b[:, 3]).max(initial=0.0) for b in _all(scene))
    near = float((np.linalg.norm(balls[:, :3] - first, axis=1) + balls[:, 3]).max())
    return 1.01 * min(float(reach), _FAR * near) + near


def _all(scene: SceneArrays) -> list[np.ndarray]:
    return [_of(scene, kind, None) for kind in ShapeKind]
