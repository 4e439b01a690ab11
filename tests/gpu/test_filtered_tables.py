"""What tables lose that a GPU's texture unit filters: it weighs two texels by one of 256 shares, llvmpipe by a float.

Fetched and interpolated in the shaders they would lose nothing; samples took 1.2 to 1.75 times as long on llvmpipe.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from gpu.device import tables as device_tables
from gpu.kernels.source import SHADERS
from gpu.layout import bindings
from gpu.tables import energy, film

GPU = Path(device_tables.__file__).parents[1]
STEPS = 256  # between two texels; Direct3D asks for no more, and an H200 has as many


@dataclass(frozen=True)
class Filtered:
    """A table, the axes along which the texture unit filters it, and by how much each of its values may be off: at
    most, and in 99 of 100 cells. The others lie at grazing angles and in narrow lobes, where albedos are steepest."""

    read: Callable[[], np.ndarray]
    axes: tuple[int, ...]
    most: float
    mostly: float


def _energy(name: str) -> np.ndarray:
    table = np.asarray(getattr(energy.tables(), name), float)
    return table[..., None] if name == "sheen" else table


TABLES = {
    "energy_albedo_table": Filtered(partial(_energy, "albedo"), (0, 1, 2), 2.4e-3, 3.5e-4),
    "energy_stretched_table": Filtered(partial(_energy, "stretched"), (2, 3, 4), 3.6e-3, 5.5e-4),
    "energy_mean_table": Filtered(partial(_energy, "mean"), (0, 1, 2), 2e-4, 2e-4),
    "energy_sheen_table": Filtered(partial(_energy, "sheen"), (0, 1), 4e-4, 3e-4),
    "energy_fuzz_table": Filtered(partial(_energy, "fuzz"), (0, 1), 1.8e-3, 6e-4),
    "energy_facets_table": Filtered(partial(_energy, "facets"), (1, 2), 2.9e-3, 7e-4),
    "film_table": Filtered(lambda: film.table()[..., :3].astype(float), (0, 1), 2.1e-3, 1.5e-4),
}


def looked_up(table: np.ndarray, axes: tuple[int, ...], at: np.ndarray, steps: int | None) -> np.ndarray:
    """The table at places (n, axes) among its texels; the other axes but the last are drawn evenly by the row number.
    Weights are one of `steps` shares, or floats."""
    moved = np.moveaxis(table, axes, range(len(axes)))
    moved = moved.reshape(*moved.shape[: len(axes)], -1, table.shape[-1])
    low = np.minimum(at.astype(int), np.array(moved.shape[: len(axes)]) - 2)
    share = at - low
    if steps:
        share = np.round(share * steps) / steps
    other = np.arange(len(at)) % moved.shape[len(axes)]
    out = np.zeros((len(at), table.shape[-1]))
    for corner in product((0, 1), repeat=len(axes)):
        weight = np.prod(np.where(corner, share, 1 - share), axis=1)
        out += weight[:, None] * moved[(*(low + corner).T, other)]
    return out


def steepest(table: np.ndarray, axes: tuple[int, ...]) -> np.ndarray:
    """By how much a value may be off in each cell: half a step along each axis, where that counts most."""
    total: np.ndarray | float = 0.0
    for axis in axes:
        along = np.abs(np.diff(table, axis=axis))
        for other in set(axes) - {axis}:
            parts = [np.take(along, np.arange(along.shape[other] - 1) + k, other) for k in (0, 1)]
            along = np.maximum(*parts)
        total = total + along / (2 * STEPS)
    return np.asarray(total)


@pytest.mark.parametrize("name", TABLES)
def test_a_table_is_off_by_less_than_it_errs_anyway(name: str) -> None:
    """Nodes lack up to 0.015 of an albedo (test_energy.py), and furnaces are allowed 1.003."""
    row = TABLES[name]
    table = row.read()
    off = steepest(table, row.axes)
    often = np.quantile(off, 0.99)
    assert off.max() < row.most and often < row.mostly, (off.max(), often)
    rng = np.random.default_rng(1)
    at = rng.random((1 << 16, len(row.axes))) * (np.array(table.shape)[list(row.axes)] - 1)
    found, exact = (looked_up(table, row.axes, at, steps) for steps in (STEPS, None))
    difference = np.abs(found - exact)
    assert 0.1 * row.most < difference.max() < off.max() + 1e-12, "the model is that of the bound"
    assert abs((found - exact).mean()) < 1e-6, "to both sides alike"


def white_furnace(steps: int | None) -> np.ndarray:
    """What rough white metal reflects in a furnace, (roughnesses, cosines): what its facets do, exactly as the table
    has it, and what is put back by looked-up albedos [Kulla and Conty 2017]."""
    places = np.linspace(0, energy.MU_COUNT - 1, 1024)
    roughness = np.linspace(8, energy.ALBEDO_SHAPE[1] - 1, 97)
    mu = (places / (energy.MU_COUNT - 1)) ** 2
    table = _energy("albedo")[0, ..., :1]
    at = np.stack(np.meshgrid(roughness, places, indexing="ij"), -1)
    shape = at.shape[:2]
    single, seen = (looked_up(table, (0, 1), at.reshape(-1, 2), s).reshape(shape) for s in (None, steps))
    mean = 2 * np.trapezoid(single * mu, mu, axis=1)[:, None]
    lost = 2 * np.trapezoid((1 - seen) * mu, mu, axis=1)[:, None]
    return np.asarray(single + (1 - seen) * lost / (1 - mean))


def test_a_white_furnace_is_as_white() -> None:
    """The bound counts the rounding of both axes at the steepest corner; what it comes to in a furnace is less."""
    exact, found = white_furnace(None), white_furnace(STEPS)
    off = found - exact
    assert 1e-5 < np.abs(off).max() < 2e-4, np.abs(off).max()
    assert np.abs(off.mean(axis=1)).max() < 7e-5, np.abs(off.mean(axis=1)).max()


def test_no_other_table_is_filtered() -> None:
    """Textures of scenes are fetched and interpolated in the shaders; a table more needs its row."""
    text = "\n".join(path.read_text() for path in SHADERS.rglob("*.*"))
    asked = set(re.findall(r"\btexture(?:Lod|Grad|Proj|Gather|Offset)?\((\w+),", text))
    samplers = set(re.findall(r"\buniform \w*sampler\w+ (\w+)", text))
    assert asked & samplers == set(TABLES) and not asked - samplers, asked
    assert len(bindings.ENERGY_TEXTURES) + 1 == len(TABLES)
    linear = [path.name for path in GPU.rglob("*.py") if re.search(r"\b[\w.]+\.LINEAR\b", path.read_text())]
    assert linear == ["tables.py"], linear
