"""Densities over the unit square that are bilinear between their nodes, and the maps that draw from them.

A map takes (u, v), uniform, to a place (x, y): v gives y by the density's marginal, then u gives x along that line.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from service.formats.types import Doubles


@dataclass(frozen=True)
class Warp:
    """A stack of densities (..., rows, columns): `density` integrates to 1 over each square, `across` is its integral
    along each line up to each column, and `down` (..., rows) that of the lines up to each row."""

    density: Doubles
    across: Doubles
    down: Doubles

    @classmethod
    def of(cls, density: np.ndarray) -> Warp:
        """Where a density is 0 everywhere, a uniform one takes its place."""
        given = np.maximum(np.asarray(density, np.float64), 0.0)
        empty = ~given.any(axis=(-2, -1), keepdims=True)
        given = np.where(empty, 1.0, given / np.where(empty, 1.0, given.max(axis=(-2, -1), keepdims=True)))
        across, down = _integrals(given)
        whole = down[..., -1]
        return cls(given / whole[..., None, None], across / whole[..., None, None], down / whole[..., None])

    def draw(self, u: Doubles, v: Doubles) -> tuple[Doubles, Doubles, Doubles]:
        """The places x and y of (n,) numbers, and the density there; of a single density."""
        density, across, down = self.density, self.across, self.down
        rows, columns = density.shape
        row = np.clip(np.searchsorted(down, v, side="right") - 1, 0, rows - 2)
        t = _part(across[row, -1], across[row + 1, -1], (v - down[row]) * (rows - 1))
        lines = across[row] * (1 - t)[:, None] + across[row + 1] * t[:, None]
        rest = u * lines[:, -1]
        column = np.clip((lines <= rest[:, None]).sum(axis=1) - 1, 0, columns - 2)
        at = np.arange(len(u))
        left = density[row, column] * (1 - t) + density[row + 1, column] * t
        right = density[row, column + 1] * (1 - t) + density[row + 1, column + 1] * t
        s = _part(left, right, (rest - lines[at, column]) * (columns - 1))
        return (column + s) / (columns - 1), (row + t) / (rows - 1), left + s * (right - left)


def bilinear(grid: np.ndarray, x: Doubles, y: Doubles) -> Doubles:
    """Values between the nodes of a grid (rows, columns, ...) at (n,) places on the unit square."""
    rows, columns = grid.shape[:2]
    column = np.clip((x * (columns - 1)).astype(int), 0, columns - 2)
    row = np.clip((y * (rows - 1)).astype(int), 0, rows - 2)
    extra = (...,) + (None,) * (grid.ndim - 2)
    s, t = (x * (columns - 1) - column)[extra], (y * (rows - 1) - row)[extra]
    upper = grid[row, column] * (1 - s) + grid[row, column + 1] * s
    lower = grid[row + 1, column] * (1 - s) + grid[row + 1, column + 1] * s
    out: Doubles = upper * (1 - t) + lower * t
    return out


def _integrals(density: Doubles) -> tuple[Doubles, Doubles]:
    rows, columns = density.shape[-2:]
    across = np.zeros_like(density)
    across[..., 1:] = np.cumsum(0.5 * (density[..., 1:] + density[..., :-1]), axis=-1) / (columns - 1)
    whole = across[..., -1]
    down = np.zeros_like(whole)
    down[..., 1:] = np.cumsum(0.5 * (whole[..., 1:] + whole[..., :-1]), axis=-1) / (rows - 1)
    return across, down


def _part(low: Doubles, high: Doubles, area: Doubles) -> Doubles:
    """How far from 0 to 1 the integral of a density, which runs straight from `low` to `high`, comes to `area`."""
    root = low + np.sqrt(np.maximum(low**2 + 2 * area * (high - low), 0.0))
    return np.clip(2 * area / np.where(root > 0, root, 1.0), 0.0, 1.0)
