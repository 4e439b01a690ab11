"""Which shapes, points and sky shine, and how often each is picked."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from gpu import layout
from gpu.distribution import LUMINANCE, alias_table
from gpu.layout import LightKind, ShapeKind
from service.scene.light import PointLight

SHINING = {
    ShapeKind.SPHERE: LightKind.SPHERE,
    ShapeKind.QUAD: LightKind.QUAD,
    ShapeKind.ELLIPSOID: LightKind.ELLIPSOID,
    ShapeKind.TRIANGLE: LightKind.TRIANGLE,
}  # a box that shines was packed as quads

# Power says little about what reaches a point: a far strong light must not starve a near weak one.
EVEN = 0.05  # share of the picks that goes to all lights alike
SKY_SHARE = (0.2, 0.8)  # bounds on the sky's where there are other lights; a wide floor makes its power look huge


def mark(shapes: dict[ShapeKind, np.ndarray], emissive: np.ndarray) -> np.ndarray:
    """`layout.Light` records of the shapes that shine, not yet weighted; writes their places into the shapes.

    `emissive` (materials,) bool.
    """
    lights: list[np.ndarray] = []
    count = 0
    for shape_kind, light_kind in SHINING.items():
        records = shapes[shape_kind]
        shining = np.flatnonzero(emissive[records["material"]])
        light = np.zeros(len(shining), layout.Light.dtype)
        light["kind"], light["index"], light["material"] = light_kind, shining, records["material"][shining]
        records["light"][shining] = count + np.arange(len(shining))
        lights.append(light)
        count += len(shining)
    return np.concatenate(lights)


def areas(shapes: dict[ShapeKind, np.ndarray], lights: np.ndarray) -> np.ndarray:
    """(n,) float64, m^2: of each light made by `mark`."""
    measures = {
        LightKind.SPHERE: (ShapeKind.SPHERE, _sphere_area),
        LightKind.QUAD: (ShapeKind.QUAD, lambda quads: quads["area"]),
        LightKind.ELLIPSOID: (ShapeKind.ELLIPSOID, _ellipsoid_area),
        LightKind.TRIANGLE: (ShapeKind.TRIANGLE, _triangle_area),
    }
    area = np.zeros(len(lights))
    for light_kind, (shape_kind, measure) in measures.items():
        mine = lights["kind"] == light_kind
        area[mine] = measure(shapes[shape_kind][lights["index"][mine]])
    return area


def _sphere_area(spheres: np.ndarray) -> np.ndarray:
    return np.asarray(4 * np.pi * spheres["radius"].astype(np.float64) ** 2)


def _triangle_area(triangles: np.ndarray) -> np.ndarray:
    v0 = triangles["v0"].astype(np.float64)
    return np.asarray(0.5 * np.linalg.norm(np.cross(triangles["v1"] - v0, triangles["v2"] - v0), axis=1))


def _ellipsoid_area(solids: np.ndarray) -> np.ndarray:
    """Within 1.1 % by Thomsen's formula (p = 1.6075), from the lengths of the half axes."""
    rows = np.stack([solids["row_x"], solids["row_y"], solids["row_z"]], axis=1).astype(np.float64)
    a, b, c = (1.0 / np.linalg.svd(rows, compute_uv=False)).T if len(rows) else np.zeros((3, 0))
    p = 1.6075
    return np.asarray(4 * np.pi * (((a * b) ** p + (a * c) ** p + (b * c) ** p) / 3) ** (1 / p))


def points(lights: Sequence[PointLight], origin: Sequence[float]) -> np.ndarray:
    """`layout.Light` records of the point lights that shine."""
    records = np.zeros(len(lights), layout.Light.dtype)
    for record, light in zip(records, lights, strict=True):
        record["kind"] = LightKind.POINT
        record["position"] = np.subtract(light.position, origin)
        record["intensity"] = light.intensity
    return records[(records["intensity"] > 0).any(axis=1)]


def weigh(lights: np.ndarray, power: np.ndarray, sky_power: float) -> np.ndarray:
    """The records, the sky's appended where it has power, with the alias table by which they are picked.

    `power` (n,), W of luminance, all positive. The sky's is for a brightness of 1: turning that up or down edits no
    table, and the picture stays the same as one packed anew.
    """
    if sky_power > 0:
        sky = np.zeros(1, layout.Light.dtype)
        sky["kind"] = LightKind.ENVIRONMENT
        lights = np.concatenate([lights, sky])
    if not len(lights):
        return lights
    weights = np.zeros(len(lights))
    total = float(power.sum())
    if len(power):
        weights[: len(power)] = (1 - EVEN) * power / total + EVEN / len(power)
    if sky_power > 0:
        low, high = SKY_SHARE if len(power) else (1.0, 1.0)
        share = min(max(sky_power / (sky_power + total), low), high)
        weights[:-1] *= 1 - share
        weights[-1] = share
    lights["threshold"], lights["alias"], lights["probability"] = alias_table(weights)
    return lights


def luminance(color: np.ndarray) -> np.ndarray:
    return np.asarray(color.astype(np.float64) @ LUMINANCE.astype(np.float64))


def radiance_scale(peak: float) -> float:
    """The power of two next to the greatest radiance, so that second moments stay inside float32."""
    return 2.0 ** min(max(round(math.log2(peak)), -100), 100) if peak > 0 else 1.0
