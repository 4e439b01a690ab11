"""Rays, boxes and turns of loops of a path, and how many lanes of a vector take part in them."""

from __future__ import annotations

from dataclasses import dataclass
from types import TracebackType

import numpy as np

from gpu import RenderSettings, SceneArrays
from gpu.analysis.metering import noise_meter_off
from tests.bench.profile.hooks import COUNTERS, EVENTS, FUNCTIONS, HOOKS, KINDS, LANES
from tests.bench.profile.instrumented import InstrumentedRenderer

Table = dict[str, dict[str, float]]  # by kind of ray, or ANY, and event


@dataclass(frozen=True)
class Counts:
    """`a_path` is how often an event happens in a path. `used` is the share of lanes that take part, on average over
    the turns of the loops in which the event happens."""

    a_path: Table
    used: Table


class Counter:
    """Counts in pictures of scenes. Raises LineGone where hooks and shaders do not agree, ContextError."""

    def __init__(self) -> None:
        self._renderer = InstrumentedRenderer(HOOKS, FUNCTIONS, COUNTERS)

    def count(self, arrays: SceneArrays, settings: RenderSettings, samples: int) -> Counts:
        """Counts `samples` paths of every pixel; the size must be a multiple of 8."""
        assert settings.width % LANES == settings.height % LANES == 0
        renderer = self._renderer
        scene = renderer.load(arrays)
        try:
            picture = renderer.picture(scene, settings)
            try:
                with noise_meter_off():
                    found = renderer.count(picture, samples)
            finally:
                picture.release()
        finally:
            scene.release()
        return counts(found, settings.width * settings.height * samples)

    def __enter__(self) -> Counter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None
    ) -> None:
        self._renderer.close()


def counts(found: np.ndarray, paths: int) -> Counts:
    """The counters of that many paths, without events that never happened."""
    turns, lanes = found.reshape(2, len(KINDS), len(EVENTS))
    a_path: Table = {kind: {} for kind in KINDS}
    used: Table = {kind: {} for kind in KINDS}
    for i, kind in enumerate(KINDS):
        for j, event in enumerate(EVENTS):
            if turns[i, j]:
                a_path[kind][event] = float(lanes[i, j] / paths)
                used[kind][event] = float(lanes[i, j] / (LANES * turns[i, j]))
    return Counts(a_path, used)
