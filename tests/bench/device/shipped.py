"""Pictures as the service traces them: paths a second, the share of the best rate, the longest dispatch."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np

from gpu import Picture, Renderer
from gpu.analysis.dispatch_times import dispatch_time
from gpu.analysis.slices import slices_of
from service.bench.device import stage
from tests.bench.device import subjects
from tests.bench.device.part import Options, Row

SCENES = ("cornell-boxes", "sphere-field", "shader-ball", "shader-ball: glass", stage.MESH)
SIZES = ((256, 256), (512, 512), (1280, 720), (1920, 1080))
SLICES_S = (0.015,)
TURN_S = 1.2


def rows(options: Options) -> Iterator[Row]:
    sizes = SIZES if options.scale >= 1 else SIZES[:1]
    with Renderer(options.device) as renderer:
        for name in SCENES if options.scale >= 1 else SCENES[:2]:
            scene = renderer.load(subjects.arrays(name))
            best = _best(renderer, scene, sizes[-1])
            for seconds in SLICES_S:
                for size in sizes:
                    if seconds != SLICES_S[0] and size != (512, 512):
                        continue
                    with slices_of(seconds):
                        picture = renderer.picture(scene, stage.settings(size, max_bounces=8))
                        yield {"scene": name, "width": size[0], "height": size[1], "slice_s": seconds,
                               **_shipped(picture, TURN_S * options.scale, best)}  # fmt: skip
                        picture.release()
            scene.release()


def _best(renderer: Renderer, scene: object, size: tuple[int, int]) -> float:
    """Paths a second of the largest dispatches."""
    picture = renderer.picture(scene, stage.settings(size))  # type: ignore[arg-type]
    rate = 0.0
    for samples in (1, 4, 16, 64):
        took = min(dispatch_time(picture, size[1], samples).wall_s for _ in range(2))
        rate = max(rate, samples * size[0] * size[1] / took)
        if took > 0.15:
            break
    picture.release()
    return rate


def _shipped(picture: Picture, turn_s: float, best: float) -> Row:
    times: list[float] = []
    began, cpu = time.perf_counter(), time.process_time()
    while time.perf_counter() - began < turn_s:
        at = time.perf_counter()
        picture.trace(0.0, 1 << 24)  # one slice
        times.append(time.perf_counter() - at)
    took = time.perf_counter() - began
    pixels = picture.settings.width * picture.settings.height
    done = picture.samples * pixels / took
    return {
        "mpaths_per_s": round(done / 1e6, 2),
        "share": round(done / best, 3),
        "samples": picture.samples,
        "dispatches": len(times),
        "median_ms": round(1e3 * float(np.median(times)), 3),
        "longest_ms": round(1e3 * max(times), 2),
        "first_ms": [round(1e3 * seconds, 2) for seconds in times[:6]],
        "cpu": round((time.process_time() - cpu) / took, 2),
    }
