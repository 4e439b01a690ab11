"""The lights of a scene (shapes, points, spots, suns and the sky), and the probability of picking each."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from gpu import layout
from gpu.layout import LightKind, ShapeKind
from gpu.tables.alias_table import LUMINANCE, alias_table
from service.document.light import DirectionalLight, Light, PointLight, SpotLight

SHINING = {
    ShapeKind.SPHERE: LightKind.SPHERE,
    ShapeKind.QUAD: LightKind.QUAD,
    ShapeKind.ELLIPSOID: LightKind.ELLIPSOID,
    ShapeKind.TRIANGLE: LightKind.TRIANGLE,
    ShapeKind.BOX: LightKind.CYLINDER,  # a box that shines was packed as quads, so that this is a cylinder's side
}

# Power says little about what reaches a point: a far strong light must not starve a near weak one.
EVEN = 0.05  # share of the picks that is spread evenly over all lights
# Bounds on the share of the sky and the suns where there are nearer lights; a wide floor makes their power look huge
FAR_SHARE = (0.2, 0.8)

# The least share of a spot's cone that its fading rim takes, so that its inverse fits into float32 with some digits
# left.
LEAST_RIM = 1e-6
AROUND = 512  # places at which the outline of a cylinder is measured
# Radians: a disk narrower than this is a point, as float32 directions have no digits for a place on it.
LEAST_DISK = 1e-6

# Bounded lights (n,), their power (n,) and their share of all picks -> as `gpu.accel.light_tree.build`; None: no tree
Grow = Callable[[np.ndarray, np.ndarray, float], tuple[np.ndarray, np.ndarray, float, np.ndarray] | None]


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
        if len(shining):  # others may be shared, and not to be written to
            records["light"][shining] = count + np.arange(len(shining))
        lights.append(light)
        count += len(shining)
    return np.concatenate(lights)


def areas(shapes: dict[ShapeKind, np.ndarray], lights: np.ndarray) -> np.ndarray:
    """(n,) float64: the area (m^2) of each light made by `mark`."""
    measures = {
        LightKind.SPHERE: (ShapeKind.SPHERE, _sphere_area),
        LightKind.QUAD: (ShapeKind.QUAD, lambda quads: quads["area"]),
        LightKind.ELLIPSOID: (ShapeKind.ELLIPSOID, _ellipsoid_area),
        LightKind.TRIANGLE: (ShapeKind.TRIANGLE, _triangle_area),
        LightKind.CYLINDER: (ShapeKind.BOX, _cylinder_area),
    }
    area = np.zeros(len(lights))
    for light_kind, (shape_kind, measure) in measures.items():
        mine = lights["kind"] == light_kind
        area[mine] = measure(shapes[shape_kind][lights["index"][mine]])
    return area


def sides(lights: np.ndarray, materials: np.ndarray) -> np.ndarray:
    """(n,): the number of sides of each light of `mark` that send light to other shapes; the inside of a closed shape
    does not count."""
    is_open = np.isin(lights["kind"], (LightKind.QUAD, LightKind.TRIANGLE, LightKind.CYLINDER))
    return np.where(is_open, materials["emission_sides"][lights["material"]], 1)


def _sphere_area(spheres: np.ndarray) -> np.ndarray:
    return np.asarray(4 * np.pi * spheres["radius"].astype(np.float64) ** 2)


def _triangle_area(triangles: np.ndarray) -> np.ndarray:
    v0 = triangles["v0"].astype(np.float64)
    return np.asarray(0.5 * np.linalg.norm(np.cross(triangles["v1"] - v0, triangles["v2"] - v0), axis=1))


def _ellipsoid_area(solids: np.ndarray) -> np.ndarray:
    """The area by Thomsen's formula (p = 1.6075), within 1.1 %, from the lengths of the half axes."""
    rows = np.stack([solids["row_x"], solids["row_y"], solids["row_z"]], axis=1).astype(np.float64)
    a, b, c = (1.0 / np.linalg.svd(rows, compute_uv=False)).T if len(rows) else np.zeros((3, 0))
    p = 1.6075
    return np.asarray(4 * np.pi * (((a * b) ** p + (a * c) ** p + (b * c) ** p) / 3) ** (1 / p))


def _cylinder_area(solids: np.ndarray) -> np.ndarray:
    """The area of the sides: the length of the ellipse whose half axes are those of the cross-section, each across
    the cylinder's axis and times its length. The mean over evenly spaced angles is exact but for long ellipses."""
    if not len(solids):
        return np.zeros(0)
    axes = np.linalg.inv(np.stack([solids["row_x"], solids["row_y"], solids["row_z"]], axis=1).astype(np.float64))
    across, along = np.cross(axes[:, :, 1], axes[:, :, 0]), np.cross(axes[:, :, 1], axes[:, :, 2])
    turn = np.arange(AROUND)[:, None, None] * (2 * np.pi / AROUND)
    return np.asarray(4 * np.pi * np.linalg.norm(np.cos(turn) * along - np.sin(turn) * across, axis=2).mean(axis=0))


def analytic_lights(lights: Sequence[Light], origin: Sequence[float], radius: float) -> tuple[np.ndarray, np.ndarray]:
    """`layout.Light` records of the lights that are no shapes and shine, suns with a disk last, and their power, W of
    luminance. The power of a directional light is what passes through a disk of `radius` around the scene.
    """
    records = np.zeros(len(lights), layout.Light.dtype)
    power = np.zeros(len(lights))
    for i, light in enumerate(lights):
        record = records[i]
        match light:
            case PointLight():
                record["kind"], size = LightKind.POINT, 4 * math.pi
            case SpotLight():
                size = _spot(record, light)
            case DirectionalLight():
                size = _sun(record, light, radius)
        if not isinstance(light, DirectionalLight):
            record["position"] = np.subtract(light.position, origin)
            record["intensity"] = light.intensity
        power[i] = size * luminance(record["intensity"])
    shining = np.flatnonzero((records["intensity"] > 0).any(axis=1) & (power > 0))
    order = shining[np.argsort((records["kind"] == LightKind.DIRECTIONAL)[shining], kind="stable")]
    order = order[np.argsort(_has_disk(records[order]), kind="stable")]
    return records[order], power[order]


def _has_disk(records: np.ndarray) -> np.ndarray:
    return np.asarray((records["kind"] == LightKind.DIRECTIONAL) & (records["spread"] > 0))


def _spot(record: np.ndarray, light: SpotLight) -> float:
    """Fill the record. Returns the solid angle (sr) that holds as much light as the cone with its rim, as smoothstep
    has a mean of a half."""
    inner, outer = (2 * math.sin(math.radians(a) / 2) ** 2 for a in (light.inner_angle, light.outer_angle))
    record["kind"] = LightKind.SPOT
    if outer == 0:
        return 0.0
    rim = max(outer - inner, LEAST_RIM * outer)
    record["direction"] = _unit(light.direction) / math.sqrt(2 * rim)
    record["spread"] = outer / rim
    return math.pi * (inner + outer)


def _sun(record: np.ndarray, light: DirectionalLight, radius: float) -> float:
    """Fill the record. Returns the area in m^2 (times sr where there is a disk) that gives the power when multiplied
    by the record's intensity."""
    half = math.radians(light.angular_diameter) / 2
    record["kind"], record["direction"] = LightKind.DIRECTIONAL, _unit(light.direction)
    facing = 1.0
    if half > LEAST_DISK:
        record["spread"] = 2 * math.sin(half / 2) ** 2
        facing = math.pi * math.sin(half) ** 2  # the integral of the cosine over the disk
    record["intensity"] = np.divide(light.irradiance, facing)
    return facing * math.pi * radius**2


def _unit(v: Sequence[float]) -> np.ndarray:
    return np.divide(v, math.hypot(*v))


def weigh(
    lights: np.ndarray, power: np.ndarray, sky_power: float, grow: Grow | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """The records with their probabilities, the sky's appended where it has power; and the words of the tree by which
    bounded lights are picked, none where a tree would not pay and an alias table picks among all of them.

    `power` (n,), W of luminance, is positive. The sky's power is for a brightness of 1: changing the brightness edits
    no table, and the picture is the same as that of a scene packed anew.
    """
    power = power.astype(np.float64)
    words = np.zeros((0, 4), np.uint32)
    if sky_power > 0:
        sky = np.zeros(1, layout.Light.dtype)
        sky["kind"] = LightKind.ENVIRONMENT
        lights, power = np.concatenate([lights, sky]), np.append(power, sky_power)
    if not len(lights):
        return lights, words
    far = (lights["kind"] == LightKind.ENVIRONMENT) | (lights["kind"] == LightKind.DIRECTIONAL)
    low, high = FAR_SHARE if far.any() and not far.all() else (0.0, 1.0)
    share = min(max(float(power[far].sum() / power.sum()), low), high)
    weights = np.zeros(len(lights))
    for group, part in ((far, share), (~far, 1 - share)):
        if group.any():
            mine = power[group]
            weights[group] = part * ((1 - EVEN) * mine / mine.sum() + EVEN / len(mine))
    n = int((~far).sum())  # they come first
    grown = grow(lights[:n], power[:n], 1 - share) if grow is not None else None
    if grown is None:
        lights["threshold"], lights["alias"], lights["probability"] = alias_table(weights)
        return lights, words
    words, lights["alias"][:n], lights["probability"][:n], lights["threshold"][:n] = grown
    if n < len(lights):
        threshold, alias, probability = alias_table(weights[n:])
        lights["threshold"][n:], lights["alias"][n:] = threshold, n + alias
        lights["probability"][n:] = share * probability
    return lights, words


def luminance(color: np.ndarray) -> np.ndarray:
    return np.asarray(color.astype(np.float64) @ LUMINANCE.astype(np.float64))


def radiance_scale(peak: float) -> float:
    """The power of two next to the greatest radiance, so that second moments stay inside float32."""
    return 2.0 ** min(max(round(math.log2(peak)), -100), 100) if peak > 0 else 1.0
