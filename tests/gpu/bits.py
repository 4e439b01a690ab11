"""Pictures compared bit by bit, saved, and begun anew."""

from __future__ import annotations

import numpy as np

from gpu import Picture, Saved, Steps


def seen(made: Picture) -> dict[str, np.ndarray]:
    """All bits of a picture."""
    out = {aov: made.read(aov) for aov in ("color", "variance")}
    return out | {"display": made.display(), "noise": np.array(made.noise())}


def assert_same(one: Picture, other: Picture) -> None:
    assert one.samples == other.samples
    theirs = seen(other)
    for name, values in seen(one).items():
        assert np.array_equal(values, theirs[name]), name


def beside(made: Picture) -> Picture:
    """A picture on another renderer: as `made`, without samples."""
    other = Picture(made.context, made._passes._kernels, made._dispatcher._uniform_buffer, made.scene, made.settings)
    return other


def saved(made: Picture) -> Saved:
    return Steps(made.save()).finish()


def slice_of(made: Picture, samples: int) -> None:
    made.trace(0.0, samples)
