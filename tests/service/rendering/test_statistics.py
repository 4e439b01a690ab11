"""What is counted of the renderer and its clients."""

from __future__ import annotations

from service.renderers.statistics import Distribution


def test_distribution() -> None:
    d = Distribution((1.0, 2.0))
    assert d.cumulative() == [(1.0, 0), (2.0, 0)]
    for value in (0.5, 1.0, 1.5, 9.0):
        d.add(value)
    assert d.cumulative() == [(1.0, 2), (2.0, 3)] and d.count == 4 and d.total == 12.0
