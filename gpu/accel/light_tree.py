"""Bounded lights -> a tree of `layout.LightNode` records, by which they are picked by importance. Runs without GL.

[Conty Estevez & Kulla 2018; Pharr, Jakob, Humphreys 2023, section 12.6.3]. A node holds the place, the directions
and the intensity of its lights; its importance at a point bounds its contribution there. Random numbers go down the
tree as an interval of whole numbers that each pair cuts in two, so that a light is picked exactly as often as its
probability says.

Importing this loads numba (half a second), so import it where a tree is needed.
"""

from __future__ import annotations

import numpy as np

from gpu import layout
from gpu.accel import light_tree_build, light_tree_clusters
from gpu.accel.light_tree_build import AXIS, BEYOND, INTENSITY, NORMALS, RADIUS, WIDTH
from gpu.layout import LightNode, LightTreeHead

# The share of picks, or down to half of it, that is spread evenly over the tree's lights: the tree does not know
# about walls, and must still pick lights of low importance.
EVEN = 0.05
STEPS = 65535  # of the grid that nodes' places are on
PIECE = 1 << 14  # pairs packed at once, which fit into the processor's cache
WIDEST = 2.0**27  # the largest radius of a node that its 8 bits can represent, in steps
FARTHEST = 2.0**38  # steps from one end of the scene to the other: squares times intensities stay inside float32


def build(
    low: np.ndarray, high: np.ndarray, radius: np.ndarray, axis: np.ndarray, normals: np.ndarray, beyond: np.ndarray,
    intensity: np.ndarray, share: float, reach: float,
) -> tuple[np.ndarray, np.ndarray, float, np.ndarray]:  # fmt: skip
    """(words (k, 4) uint32: a head, the pairs of nodes, their clusters from 2 n on, whose entries begin at 3 n;
    trails (n,) uint32; the even part of each light's probability; intensities (n,) float32, 1 for the brightest).

    For n >= 2 lights: boxes `low`, `high` (n, 3) and the `radius` (n,) of a ball around each one's middle; its
    normals lie about the unit `axis` (n, 3) within the angle whose cosine is `normals` (n,), and light leaves within
    the angle whose cosine is `beyond` (n,), >= 0, of a normal; `intensity` (n,) >= 0 has any unit. The tree's lights
    are the first n, picked with probability `share` all together. `reach` is the largest distance between two points
    of the scene.
    """
    n = len(low)
    if n < 2:
        raise ValueError(f"{n} lights: a tree is of two or more")  # else compiled loops would write past their arrays
    lights = np.empty((n, WIDTH), np.float64)
    lights[:, 0:3], lights[:, 3:6], lights[:, AXIS : AXIS + 3] = low, high, axis
    lights[:, NORMALS], lights[:, BEYOND], lights[:, RADIUS] = normals, beyond, radius
    lights[:, INTENSITY] = intensity / (intensity.max() or 1.0)
    children, trails, order = np.empty((n - 1, 2), np.int64), np.empty(n, np.uint32), np.arange(n)
    light_tree_build.grow(lights, order, children, trails)
    bounds = np.empty((n - 1, 2, WIDTH), np.float64)
    light_tree_build.bound(lights, children, bounds)
    origin, step = _grid(lights, reach)
    head = np.zeros(1, LightTreeHead.dtype)
    head["origin"], head["inverse_step"] = origin, 1 / step
    even = _deal(head, n, share)
    clusters, entries, clustered = light_tree_clusters.gather(lights, children, bounds, order, 3 * n)
    words = np.zeros((3 * n + len(entries), 4), np.uint32)
    words[:2] = head.view(np.uint32).reshape(2, 4)
    for first in range(0, n - 1, PIECE):
        last = min(first + PIECE, n - 1)
        some = slice(first, last)
        words[2 + 2 * first : 2 + 2 * last] = _packed(bounds[some], children[some], clustered[some], origin, step)
    words[2 * n + 1 : 3 * n] = clusters.view(np.uint32).reshape(-1, 4)
    words[3 * n :] = entries.view(np.uint32).reshape(-1, 4)
    return words, trails, even, lights[:, INTENSITY].astype(np.float32)


def with_share(words: np.ndarray, n: int, share: float) -> tuple[np.ndarray, float]:
    """(words, the even part of each light's probability) of the same tree, whose n lights are picked with another
    probability all together."""
    head = np.ascontiguousarray(words[:2]).reshape(-1).view(LightTreeHead.dtype).copy()
    even = _deal(head, n, share)
    out = words.copy()
    out[:2] = head.view(np.uint32).reshape(2, 4)
    return out, even


def _deal(head: np.ndarray, n: int, share: float) -> float:
    """Distribute the random numbers: fill in the head, and return the even part of each light's probability."""
    near = layout.LIGHT_CODES if share >= 1 else round(share * layout.LIGHT_CODES)
    shift = max(int(np.floor(np.log2(EVEN * near / n))), 0)
    head["near"], head["even"], head["even_shift"], head["far_first"] = near, n << shift, shift, n
    return float(2.0**shift / layout.LIGHT_CODES)


def _grid(lights: np.ndarray, reach: float) -> tuple[np.ndarray, float]:
    """Origin (3,) and step, exact in float32, of a grid that covers the middles of all lights."""
    middle = 0.5 * (lights[:, 0:3] + lights[:, 3:6])
    low, high = middle.min(axis=0), middle.max(axis=0)
    # The step is at least the rounding of places in float32, and large enough that float32 can square the distance to
    # the other end of the scene in steps.
    finest = max(float(np.abs(middle).max()) * 2.0**-22, reach / FARTHEST, float(lights[:, RADIUS].max()) / WIDEST)
    step = float(np.float32(max(float((high - low).max()) / (STEPS - 4), finest)))
    return (low - 2 * step).astype(np.float32).astype(np.float64), step


def _packed(
    bounds: np.ndarray, children: np.ndarray, clustered: np.ndarray, origin: np.ndarray, step: float
) -> np.ndarray:
    """(2 (n - 1), 4) uint32: `layout.LightNode` records, whose bounds are rounded outwards."""
    nodes = np.zeros(children.shape, LightNode.dtype)
    place = (0.5 * (bounds[..., 0:3] + bounds[..., 3:6]) - origin) / step
    grid = np.clip(np.rint(place), 0, STEPS)
    away = np.linalg.norm(place - grid, axis=-1)
    # A tenth of a step and a share of the radius cover the rounding in the shader's float32.
    radius = _upwards(bounds[..., RADIUS] / step * (1 + 1e-5) + away + 0.1)
    axis, turned = _octahedral(bounds[..., AXIS : AXIS + 3])
    half = 0.5 * (np.arccos(np.clip(bounds[..., NORMALS], -1, 1)) + turned)
    normals = np.minimum(np.ceil(255 * np.sin(np.minimum(half, 0.5 * np.pi)) + 1e-6), 255)
    beyond = np.minimum(np.ceil(31 * np.sin(0.5 * np.arccos(bounds[..., BEYOND])) * np.sqrt(2) - 1e-9), 31)
    x, y, z = np.moveaxis(grid.astype(np.uint32), -1, 0)
    nodes["place"] = x | y << 16
    nodes["reach"] = z | radius << 16 | normals.astype(np.uint32) << 24
    nodes["shine"] = axis | beyond.astype(np.uint32) << 16 | _brightness(bounds[..., INTENSITY]) << 21
    nodes["link"] = np.where(children < 0, layout.LEAF_BIT | ~children, children + 1).astype(np.uint32)
    nodes["link"][clustered] |= layout.CLUSTER_BIT
    return nodes.view(np.uint32).reshape(-1, 4)


def _upwards(radius: np.ndarray) -> np.ndarray:
    """8 bits, rounded up: 5 of an exponent from 2^-4 and 3 of a mantissa."""
    bits = np.asarray(radius, np.float32).view(np.uint32).astype(np.int64) - (123 << 23)
    return np.asarray(np.clip(-(-bits >> 20), 0, 255), np.uint32)


def _brightness(intensity: np.ndarray) -> np.ndarray:
    """11 bits, rounded: 7 of an exponent from 2^-87 and 4 of a mantissa; fainter lights count as 2^-87."""
    bits = np.asarray(intensity, np.float32).view(np.uint32).astype(np.int64) - (40 << 23)
    return np.asarray(np.clip((bits + (1 << 18)) >> 19, 0, 2047), np.uint32)


def _octahedral(axis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(2 x 8 bits of octahedral coordinates, the angle between the axis and the direction that they decode to)."""
    e = axis / np.abs(axis).sum(axis=-1, keepdims=True)
    folded = (1 - np.abs(e[..., 1::-1])) * np.where(e[..., :2] >= 0, 1, -1)
    uv = np.where(e[..., 2:] < 0, folded, e[..., :2])
    q = np.clip(np.rint(uv * 127 + 127), 0, 254)
    back = (q - 127) / 127
    z = 1 - np.abs(back).sum(axis=-1)
    fold = np.maximum(-z, 0)[..., None] * np.where(back >= 0, 1, -1)
    w = np.concatenate([back - fold, z[..., None]], axis=-1)
    w /= np.linalg.norm(w, axis=-1, keepdims=True)
    across = np.linalg.norm(np.cross(w, axis), axis=-1)
    angle = np.arctan2(across, (w * axis).sum(axis=-1))
    bits = q.astype(np.uint32)
    return bits[..., 0] | bits[..., 1] << 8, angle
