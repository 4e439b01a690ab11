"""The lights of a scene (shapes, points, spots, suns and the sky), and the probability of picking each."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from gpu import layout
from gpu.layout import LightKind, ShapeKind
from gpu.tables.alias_table import LUMINANCE, alias_table
from service.document.light import Light
from service.pack.lights.light_kinds import FILL, KINDS

# Power says little about what reaches a point: a far strong light must not starve a near weak one.
EVEN = 0.05  # share of the picks that is spread evenly over all lights
# Bounds on the share of the sky and the suns where there are nearer lights; a wide floor makes their power look huge
FAR_SHARE = (0.2, 0.8)

# Bounded lights (n,), their power (n,) and their share of all picks -> as `gpu.accel.light_tree.build`; None: no tree
Grow = Callable[[np.ndarray, np.ndarray, float], tuple[np.ndarray, np.ndarray, float, np.ndarray] | None]


def mark(shapes: dict[ShapeKind, np.ndarray], emissive: np.ndarray) -> np.ndarray:
    """`layout.Light` records of the shapes that shine, not yet weighted; writes their places into the shapes.

    `emissive` (materials,) bool.
    """
    lights: list[np.ndarray] = []
    count = 0
    for light_kind, row in KINDS.items():
        if row.shape is None:
            continue
        records = shapes[row.shape]
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
    area = np.zeros(len(lights))
    for kind, row in KINDS.items():
        if row.shape is not None and row.area is not None:
            mine = lights["kind"] == kind
            area[mine] = row.area(shapes[row.shape][lights["index"][mine]])
    return area


def sides(lights: np.ndarray, materials: np.ndarray) -> np.ndarray:
    """(n,): the number of sides of each light of `mark` that send light to other shapes; the inside of a closed shape
    does not count."""
    is_open = np.isin(lights["kind"], [kind for kind, row in KINDS.items() if row.is_open])
    return np.where(is_open, materials["emission_sides"][lights["material"]], 1)


def analytic_lights(lights: Sequence[Light], origin: Sequence[float], radius: float) -> tuple[np.ndarray, np.ndarray]:
    """`layout.Light` records of the lights that are no shapes and shine, suns with a disk last, and their power, W of
    luminance. The power of a directional light is what passes through a disk of `radius` around the scene.
    """
    records = np.zeros(len(lights), layout.Light.dtype)
    power = np.zeros(len(lights))
    for i, light in enumerate(lights):
        size = FILL[type(light)](records[i], light, np.asarray(origin), radius)
        power[i] = size * luminance(records["intensity"][i])
    shining = np.flatnonzero((records["intensity"] > 0).any(axis=1) & (power > 0))
    order = shining[np.argsort((records["kind"] == LightKind.DIRECTIONAL)[shining], kind="stable")]
    order = order[np.argsort(_has_disk(records[order]), kind="stable")]
    return records[order], power[order]


def _has_disk(records: np.ndarray) -> np.ndarray:
    return np.asarray((records["kind"] == LightKind.DIRECTIONAL) & (records["spread"] > 0))


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
    far = np.isin(lights["kind"], [kind for kind, row in KINDS.items() if row.bound is None])
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
