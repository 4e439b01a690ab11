"""The origin that is subtracted from every position before it becomes float32, and warnings about lost precision."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gpu.layout import ShapeKind
from service.pack.geometry import records
from service.pack.geometry.analytic import AnalyticShapes
from service.pack.geometry.geometry import MeshExtents
from service.pack.geometry.records import Bounds

# Extents from 0 at which a scene's float32 positions begin to lose digits it needs.
FAR = 4.0
# A distance from the origin in units of the shape's own extent: places there are rounded to 1 / 16 000 of the shape,
# which was never visible. Beyond it, an origin nearer to the small shapes is chosen.
NEAR = 2.0**10
# A distance at which rounding becomes visible: 1 to 2 % of a picture's pixels change by more than 0.1 % (spheres,
# boxes and quads 2^15 extents away; with a mesh of 80 triangles 13 % do at 2^13).
LOST = 2.0**14
# Ratio of a shape's least extent (0 for one along an axis) to the smallest shape's: its surface is known to 1 / 128
# of that shape, and shadows begin to separate from the shapes that cast them.
VAST = 2.0**17


@dataclass(frozen=True)
class Rebased:
    """The analytic shapes of a scene relative to the origin that suits all of its shapes."""

    records: dict[ShapeKind, np.ndarray]
    bounds: dict[ShapeKind, Bounds]
    origin: np.ndarray  # float64, world
    radius: float  # of a ball around everything; 1 for an empty scene
    warnings: list[str]  # about shapes that are too small, or too far away for float32


def rebase(placed: AnalyticShapes, meshes: MeshExtents) -> Rebased:
    """These shapes relative to an origin that suits them and the meshes with these extents."""
    found = records.analytic(placed, np.zeros(3))
    low = np.concatenate([*(bounds[0] for _, bounds in found.values()), meshes.low])
    high = np.concatenate([*(bounds[1] for _, bounds in found.values()), meshes.high])
    owners = np.concatenate([*(array["shape"] for array, _ in found.values()), meshes.owners])
    origin, radius = choose_origin(low, high)
    if origin.any():
        found = records.analytic(placed, origin)
    spheres, _ = found[ShapeKind.SPHERE]  # the first kind
    records.only_vast(spheres, low, high)
    records.mark_bits(found, placed)  # last, as the numbers of the shapes were read above
    exact = np.arange(len(owners)) < len(spheres)
    lost = [f"/shapes/{i}: too small to be traced, left out" for i in dict.fromkeys(placed.vanished)]
    return Rebased(
        {kind: array for kind, (array, _) in found.items()},
        {kind: bounds for kind, (_, bounds) in found.items()},
        origin,
        radius,
        [*lost, *warnings(low, high, owners, exact, origin)],
    )


def choose_origin(low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, float]:
    """(origin, radius of a ball around everything) of boxes (n, 3), one for each shape.

    The origin is 0 unless everything, or small shapes, lie far from it: in most scenes no number changes.
    """
    if not len(low):
        return np.zeros(3), 1.0
    least, most = low.min(axis=0), high.max(axis=0)
    radius = float(np.linalg.norm(most - least)) / 2 or 1.0
    size = float((most - least).max())
    middle = (least + most) / 2
    origin = np.zeros(3) if np.abs(middle).max() <= FAR * size else _rounded(middle, size)
    remote = remoteness(low, high, origin).max()
    if remote <= NEAR:
        return origin, radius
    sizes = _sizes(low, high)
    weights: np.ndarray = (sizes.min() / sizes) ** 2  # the origin must be nearer to smaller shapes
    near = _rounded(weights @ ((low + high) / 2) / weights.sum(), float(sizes.min()))
    better = bool(remoteness(low, high, near).max() < remote / 4)
    return (near, radius) if better else (origin, radius)


def remoteness(low: np.ndarray, high: np.ndarray, origin: np.ndarray) -> np.ndarray:
    """(n,) the distance of the farthest point of each box from the origin, in the box's own extents."""
    reach = np.maximum(np.abs(low - origin), np.abs(high - origin)).max(axis=1)
    return np.asarray(reach / _sizes(low, high))


def _sizes(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    sizes = (high - low).max(axis=1)
    return np.asarray(np.maximum(sizes, np.finfo(np.float64).tiny))


def _rounded(place: np.ndarray, size: float) -> np.ndarray:
    """The place rounded to a power of two of about `size`, so that round numbers stay round."""
    step = 2.0 ** math.floor(math.log2(size)) if size else 1.0
    return np.asarray(np.rint(place / step) * step)


def warnings(
    low: np.ndarray, high: np.ndarray, shapes: np.ndarray, exact: np.ndarray, origin: np.ndarray
) -> list[str]:
    """A line for each shape (indices `shapes`, (n,)) whose place is not precise enough in float32; the surface of an
    `exact` one is precise whatever its size."""
    if not len(low):
        return []
    remote, sizes = remoteness(low, high, origin), _sizes(low, high)
    out = {}
    for i in np.flatnonzero(remote > LOST):
        share = remote[i] * 2.0**-24
        out[int(shapes[i])] = (
            f"/shapes/{shapes[i]}: is {sizes[i]:.3g} m across and {remote[i] * sizes[i]:.3g} m from the scene's "
            f"origin; its place is known to {share:.1%} of its size"
        )
    thick = np.where(exact, 0.0, (high - low).min(axis=1))
    for i in np.flatnonzero(thick > VAST * sizes.min()):
        out[int(shapes[i])] = (
            f"/shapes/{shapes[i]}: is {sizes[i]:.3g} m across beside shapes of {sizes.min():.3g} m; its surface is "
            f"known to {sizes[i] * 2.0**-24:.2g} m only, unless it stands along the axes"
        )
    return [out[i] for i in sorted(out)]
