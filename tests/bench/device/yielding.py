"""What waiting for the device costs the processor, as the driver waits and asleep."""

from __future__ import annotations

import os
from collections.abc import Iterator

from gpu import Renderer
from service.bench.device import stage
from service.bench.device.isolated import SPAWN
from tests.bench.device import shipped, subjects
from tests.bench.device.part import Options, Row

SCENE, SIZE = "cornell-boxes", (512, 512)


def rows(options: Options) -> Iterator[Row]:
    for word in ("", "NOTHING", "USLEEP"):
        with SPAWN.Pool(1) as pool:
            yield {"__GL_YIELD": word, **pool.apply(traced, (word, options.device, options.scale))}


def traced(word: str, device: int | None, scale: float) -> Row:
    if word:
        os.environ["__GL_YIELD"] = word
    with Renderer(device) as renderer:
        picture = renderer.picture(renderer.load(subjects.arrays(SCENE)), stage.settings(SIZE))
        picture.trace(0.5, 64)
        picture.reset()
        return shipped._shipped(picture, 1.5 * scale, 1e9)
