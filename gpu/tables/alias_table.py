"""Weights -> tables: which light, which texels of the environment. Runs without GL."""

from __future__ import annotations

import numpy as np

from gpu import layout
from gpu.tables.environment_cells import draw_cells

LUMINANCE = np.array(layout.LUMINANCE, np.float32)
UNIFORM_SPHERE = 1.0 / (4.0 * np.pi)


def alias_table(weights: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(threshold float32, alias uint32, probability float64) for weights (n,): finite, >= 0, not all 0.

    Draw i uniformly, keep it where u < threshold[i], else take alias[i]; u must not share bits with i, as n
    may be 2^23. `probability` is what the table does after rounding. An item of weight 0 is never drawn.

    The sweep that fills light items from heavy ones in order [Huebschle-Schneider and Sanders 2019, "Parallel
    Weighted Random Sampling", sec. 3], here as two prefix sums and their merge instead of a loop.
    """
    weights = np.asarray(weights, np.float64)
    n = len(weights)
    share = weights / weights.max()  # first, or the sum of tiny weights would be denormal
    share *= n / share.sum()
    heavy = np.flatnonzero(share > 1.0)
    light = np.flatnonzero(share <= 1.0)
    threshold = np.ones(n)
    alias = np.arange(n, dtype=np.uint32)
    if len(heavy) and len(light):  # all shares may round to just above 1
        need = np.cumsum(1.0 - share[light])  # what the light items up to here take from heavy ones
        spare = np.cumsum(share[heavy] - 1.0)  # what the heavy ones up to here can give
        giver = np.searchsorted(spare, np.concatenate([[0.0], need[:-1]]), side="right")
        threshold[light] = share[light]
        alias[light] = heavy[np.minimum(giver, len(heavy) - 1)]
        # Where a heavy item gave more than it could spare, the next one fills it up.
        taker = np.minimum(np.searchsorted(need, spare[:-1]), len(need) - 1)
        threshold[heavy[:-1]] = np.clip(1.0 + spare[:-1] - need[taker], 0.0, 1.0)
        alias[heavy[:-1]] = heavy[1:]
    rounded = threshold.astype(np.float32)
    stays = rounded.astype(np.float64)
    return rounded, alias, (stays + np.bincount(alias, 1.0 - stays, n)) / n


def _footprint(values: np.ndarray) -> np.ndarray:
    """(h, w): the mean over each texel of `values` interpolated bilinearly; rows clamp, columns repeat."""
    rows = 0.75 * values
    rows[1:] += 0.125 * values[:-1]
    rows[:-1] += 0.125 * values[1:]
    rows[0] += 0.125 * values[0]
    rows[-1] += 0.125 * values[-1]
    columns = 0.75 * rows
    columns[:, 1:] += 0.125 * rows[:, :-1]
    columns[:, :-1] += 0.125 * rows[:, 1:]
    columns[:, 0] += 0.125 * rows[:, -1]
    columns[:, -1] += 0.125 * rows[:, 0]
    return columns


def solid_angles(height: int, width: int) -> np.ndarray:
    """(height,) float64, sr: of one texel in each row of a latitude-longitude map."""
    # cos a - cos b = 2 sin((a + b) / 2) sin((b - a) / 2), which does not cancel at the poles.
    middle = (np.arange(height) + 0.5) * (np.pi / height)
    return np.asarray(2.0 * np.pi / width * 2.0 * np.sin(middle) * np.sin(0.5 * np.pi / height))


def cube_solid_angles(n: int) -> np.ndarray:
    """(n, n) float64, sr: of the texels of a cube's face."""
    edges = np.linspace(-1.0, 1.0, n + 1)
    a, b = edges[:, None], edges
    corner = np.arctan2(a * b, np.sqrt(a * a + b * b + 1.0))  # of the rectangle from the middle of the face
    return np.asarray(corner[1:, 1:] - corner[1:, :-1] - corner[:-1, 1:] + corner[:-1, :-1])


def cube_tables(texels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """As `environment_tables`, for six faces (2 n, 3 n, 3); the probability is per unit of area of the cube -1..1.

    A block of texels is drawn by the luminance of its bilinear footprint, which ends at the face's edge, times its
    solid angle, then a place in it uniformly. A black map is drawn uniformly.
    """
    n = texels.shape[0] // 2
    faces = (texels @ LUMINANCE).astype(np.float64).reshape(2, n, 3, n).transpose(1, 3, 0, 2)  # (n, n, 2, 3)
    solid = cube_solid_angles(n)[:, :, None, None]
    weights = _clamped(_clamped(faces).swapaxes(0, 1)).swapaxes(0, 1) * solid
    if not weights.sum() > 0.0:
        weights = np.broadcast_to(solid, weights.shape)
    places = [(column, row) for row in range(2) for column in range(3)]
    table, densities = draw_cells(
        [weights[:, :, row, column] for column, row in places],
        [(n * column, n * row) for column, row in places],
        [np.full(n, 4.0 / (n * n))] * 6,
    )
    probability = np.empty((2, n, 3, n), np.float32)
    for (column, row), density in zip(places, densities, strict=True):
        probability[row, :, column] = density
    return probability.reshape(2 * n, 3 * n), table


def _clamped(values: np.ndarray) -> np.ndarray:
    """Means over texels along the first axis of `values` interpolated linearly, constant beyond the ends."""
    out = 0.75 * values
    out[1:] += 0.125 * values[:-1]
    out[:-1] += 0.125 * values[1:]
    out[0] += 0.125 * values[0]
    out[-1] += 0.125 * values[-1]
    return np.asarray(out)


def environment_tables(texels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(probability (h, w) float32, `layout.EnvironmentCell` (k,)) for radiance (h, w, 3), not negative.

    A block of texels is drawn by the luminance of its bilinear footprint times its solid angle, then a direction in
    it uniformly in u and in cos theta: the probability, per steradian, is constant within a block. A black map is
    drawn uniformly.
    """
    height, width = texels.shape[:2]
    rows = solid_angles(height, width)
    weights = _footprint((texels @ LUMINANCE).astype(np.float64)) * rows[:, None]
    if not weights.sum() > 0.0:
        weights = np.repeat(rows[:, None], width, axis=1)
    table, (density,) = draw_cells([weights], [(0, 0)], [rows])
    return density.astype(np.float32), table
