"""One and two processes on the device."""

from __future__ import annotations

import time
from multiprocessing.synchronize import Barrier

from gpu import Renderer
from service.bench import timing
from service.bench.device import stage
from service.bench.device.stage import Options

SCENE = "cornell-boxes"
PATIENCE_S = 60.0  # for the other process to compile


def measure(options: Options, together: Barrier) -> float:
    """Millions of paths per second of this process, from when all at the barrier are ready, for `turn_s`."""
    size = options.sizes[0]
    with Renderer(options.device) as renderer:
        picture = renderer.picture(renderer.load(stage.arrays(SCENE)), stage.settings(size))
        samples = timing.samples_in(picture, options.turn_s / 4)
        picture.reset()
        together.wait(PATIENCE_S)
        traced, began = 0, time.perf_counter()
        while (seconds := time.perf_counter() - began) < options.turn_s or traced == 0:
            timing.trace(picture, samples)
            traced += samples
        return traced * size[0] * size[1] / seconds / 1e6
