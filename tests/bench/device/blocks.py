"""Materials, lights and few shapes in uniform blocks, as llvmpipe likes them, or in storage buffers."""

from __future__ import annotations

import statistics
from collections.abc import Iterator
from unittest import mock

from gpu import Picture, Renderer
from gpu.analysis.dispatch_times import dispatch_time
from gpu.kernels import features
from service.bench.device import stage
from tests.bench.device import subjects
from tests.bench.device.part import Options, Row

SCENES = ("cornell-boxes", "shader-ball", "whisky")  # few shapes; few materials; bodies that fetch theirs
SIZE = (1280, 720)
SAMPLES = 8
RUNS = 7  # of either, in turns


def rows(options: Options) -> Iterator[Row]:
    """A row for each scene: the time of a dispatch with blocks and without, and the first over the second."""
    size = (round(SIZE[0] * options.scale), round(SIZE[1] * options.scale))
    for name in SCENES if options.scale >= 1 else SCENES[:1]:
        with Renderer(options.device) as one, Renderer(options.device) as other:
            sides = {1: _picture(one, name, size), 0: _picture(other, name, size)}
            # The first turn compiles.
            turns = [{side: _seconds(picture, side) for side, picture in sides.items()} for _ in range(1 + RUNS)]
        blocks, storage = (statistics.median(turn[side] for turn in turns[1:]) for side in sides)
        yield {"scene": name, "blocks_ms": round(1e3 * blocks, 3), "storage_ms": round(1e3 * storage, 3),
               "ratio": round(blocks / storage, 3)}  # fmt: skip


def _picture(renderer: Renderer, name: str, size: tuple[int, int]) -> Picture:
    return renderer.picture(renderer.load(subjects.arrays(name)), stage.settings(size))


def _seconds(picture: Picture, blocks: int) -> float:
    """Of a dispatch of the kernel that reads from blocks (1) or from storage buffers (0)."""
    with mock.patch.object(features, "UNIFORM_BLOCKS", blocks):
        return dispatch_time(picture, picture.settings.height, SAMPLES).wall_s
