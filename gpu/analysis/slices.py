"""Dispatches of another length than usual, for measuring which is best."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from gpu.picture import tiles


@contextmanager
def slices_of(seconds: float) -> Iterator[None]:
    """Within this block a dispatch of pictures without `adaptive` takes about that long; at most all samples of a
    pass, and as few pixels as `Tiles` allows."""
    before = tiles.SLICE_S
    tiles.SLICE_S = seconds
    try:
        yield
    finally:
        tiles.SLICE_S = before
