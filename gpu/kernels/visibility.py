"""How much of a camera's picture shows nothing: what kernels are chosen by, not what is drawn."""

from __future__ import annotations

import numpy as np

from gpu import layout
from gpu.arrays import SceneArrays

_SIDE = 24  # rays a side, over a square picture


def background_share(scene: SceneArrays) -> float:
    """The share of a square picture where camera rays meet nothing, 0..1, where that is soon told: of a few balls.
    0 where anything else stands in the scene, or nothing at all.
    """
    balls = scene.spheres
    others = (scene.quads, scene.boxes, scene.ellipsoids, scene.triangles, scene.instances)
    vast = (balls["power"] < layout.NOT_VAST).any()
    if scene.bvh_kinds or any(len(records) for records in others) or vast or not len(balls):
        return 0.0
    camera = scene.camera
    position, right, up, forward = (camera[name].astype(float) for name in ("position", "right", "up", "forward"))
    across = ((np.arange(_SIDE) + 0.5) / _SIDE * 2 - 1) * float(camera["tan_half_vfov"])
    x, y = np.meshgrid(across, across)
    rays = x[..., None] * right + y[..., None] * up + forward
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    free = np.ones(x.shape, bool)
    for ball in balls:
        to = ball["center"].astype(float) - position
        along = rays @ to
        apart = (to @ to) - along**2  # squared, of the ray's line from the centre
        radius = float(ball["radius"]) ** 2
        inside = to @ to < radius
        free &= ~(inside | ((along > 0) & (apart < radius)))
    return float(free.mean())
