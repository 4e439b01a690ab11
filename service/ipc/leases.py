"""How one picture is divided: its home leases bands of blocks (gpu/picture/blocks.py) to renderers that assist it.

The server only hands these messages on, from the home to an assistant and back.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Assist:
    """To an assistant: the updates of this task that follow are for tracing leases, not a picture of its own."""

    task: int


@dataclass(frozen=True)
class Assistants:
    """To the home: the renderers that take leases from now on. What others had is lost."""

    task: int
    ids: tuple[int, ...]


@dataclass(frozen=True)
class Lease:
    """From the home to an assistant: trace samples [first, first + count) of rows [top, top + rows)."""

    task: int
    generation: int
    number: int  # unique in this task and home
    assistant: int
    first: int
    count: int
    top: int
    rows: int


@dataclass(frozen=True)
class LeaseDone:
    """From an assistant to the home: the accumulators of these rows, as `gpu.Picture.block.read_band` gives them, and
    the numbers of paths that `gpu.Picture.block.take_counts` gives."""

    task: int
    generation: int
    number: int
    values: np.ndarray
    counts: tuple[int, int] = (0, 0)


@dataclass(frozen=True)
class LeaseFailed:
    """From an assistant: it cannot trace this task's bands, of this generation or any other."""

    task: int
    generation: int
    detail: str


@dataclass(frozen=True)
class LeaseRefuted:
    """From the home: it has traced a band of this assistant again, and got other bits."""

    task: int
    generation: int
    assistant: int


def undivided(adaptive: bool, time_limit: float | None) -> str | None:
    """Why a picture of such settings is traced by one renderer; None where it may be divided."""
    if adaptive:
        return "settings.adaptive: where samples are taken next depends on all samples before."
    if time_limit is not None:
        return "settings.time_limit: how many samples there are in the end depends on the speed of one renderer."
    return None
