"""What a dispatch takes by its pixels and samples: t0, the samples of a full device, and how many fill it."""

from __future__ import annotations

import statistics
from collections.abc import Iterator

from gpu import Renderer
from gpu.analysis.dispatch_times import dispatch_time
from service.bench.device import stage
from tests.bench.device import subjects
from tests.bench.device.part import Options, Row

SCENES = ("cornell-boxes", "shader-ball", "shader-ball: glass", stage.MESH)
WIDTH = 512
ROWS = (1, 32, 64, 128, 256, 512, 1024)
SAMPLES = (1, 4, 16)
MOST_S = 0.4  # of a dispatch
RUNS = 3


def rows(options: Options) -> Iterator[Row]:
    heights = [height for height in ROWS if options.scale >= 1 or height <= 64]
    names = SCENES if options.scale >= 1 else SCENES[:2]
    with Renderer(options.device) as renderer:
        for name in names:
            scene = renderer.load(subjects.arrays(name))
            picture = renderer.picture(scene, stage.settings((WIDTH, heights[-1])))
            dispatch_time(picture, 1, 1)
            for samples in SAMPLES:
                for height in heights:
                    times = [dispatch_time(picture, height, samples) for _ in range(RUNS)]
                    wall_ms = 1e3 * statistics.median(time.wall_s for time in times)
                    device_ms = 1e3 * statistics.median(time.device_s for time in times)
                    yield {"scene": name, "pixels": WIDTH * height, "samples": samples,
                           "wall_ms": round(wall_ms, 4), "device_ms": round(device_ms, 4)}  # fmt: skip
                    if wall_ms > 1e3 * MOST_S / 2:
                        break
            picture.release()
            scene.release()
