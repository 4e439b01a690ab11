"""Small and large, near and far: the same picture, sample by sample, wherever float32 can hold it."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from gpu import Renderer
from tests.extremes.scenes import Seen, everything, moved, rows, scaled


@pytest.fixture(scope="module")
def seen(gpu: Renderer) -> Seen:
    return Seen(gpu, everything())


SCALES = rows({"1e-4": 1e-4, "2^10": 2.0**10, "1e5": 1e5}, {"2^-13": 2.0**-13, "0.01": 0.01, "100": 100.0})


@pytest.mark.parametrize("row", SCALES)
def test_scaled_with_its_lights_it_looks_the_same(gpu: Renderer, seen: Seen, row: str) -> None:
    other = Seen(gpu, scaled(everything(), SCALES[row]))
    assert other.warnings == []
    assert other.alike(seen) > 0.995  # paths that a rounding sends elsewhere
    assert other.deviation(seen) < 0.05
    if row.startswith("2^"):
        assert (other.color == seen.color).all()  # nothing hangs on an absolute length


PLACES: dict[str, float | Sequence[float]] = rows(
    {"2^0": 1.0, "2^4": 16.0, "2^17": 2.0**17, "1e6": [1e6, -1e6, 3e5]},
    {f"2^{k}": 2.0**k for k in (*range(1, 4), *range(5, 17))} | {"-1e6": -1e6},
)


@pytest.mark.parametrize("row", PLACES)
def test_moved_it_looks_the_same(gpu: Renderer, seen: Seen, row: str) -> None:
    other = Seen(gpu, moved(everything(), PLACES[row]))
    assert other.warnings == []
    assert other.alike(seen) > 0.99
    assert other.deviation(seen) < 0.05
