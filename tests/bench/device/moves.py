"""What moving a picture's memory takes: clearing, reading, showing, saving, first and after many."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from gpu import Picture, Renderer
from service.bench.device import stage
from tests.bench.device import subjects
from tests.bench.device.part import Options, Row

SIZE, REPEATS = (1920, 1080), 40
SCENE = "shader-ball"


def rows(options: Options) -> Iterator[Row]:
    size = SIZE if options.scale >= 1 else (320, 180)
    repeats = REPEATS if options.scale >= 1 else 5
    with Renderer(options.device) as renderer:
        scene = renderer.load(subjects.arrays(SCENE))
        picture = renderer.picture(scene, stage.settings(size))
        yield {"what": "sample before", "ms": _sample_ms(picture)}
        raw = renderer.context.buffer(reserve=16 * size[0] * size[1])
        zeros = np.zeros(4 * size[0] * size[1], np.float32)
        ways: dict[str, Callable[[], Any]] = {
            "clear 16 bytes a pixel": raw.clear,
            "read 16 bytes a pixel": raw.read,
            "write 16 bytes a pixel": lambda: raw.write(zeros),
            "display": picture.display,
            "read colour": picture.read,
            "noise": picture.noise,
            "reset": picture.reset,
        }
        for name, call in ways.items():
            picture.trace(0.5, 8)
            times = []
            for _ in range(repeats):
                if name == "reset":
                    picture.trace(0.0, 8)
                began = time.perf_counter()
                call()
                renderer.context.finish()
                times.append(1e3 * (time.perf_counter() - began))
            yield {"what": name, "first_ms": round(times[0], 3), "median_ms": round(float(np.median(times)), 3),
                   "worst_ms": round(max(times), 3), "times": repeats}  # fmt: skip
        yield {"what": "sample after", "ms": _sample_ms(picture)}


def _sample_ms(picture: Picture) -> float:
    picture.reset()
    picture.trace(0.3, 1 << 20)
    began, first = time.perf_counter(), picture.samples
    while time.perf_counter() - began < 0.5 or picture.samples == first:
        picture.trace(0.2, 1 << 20)
    return round(1e3 * (time.perf_counter() - began) / (picture.samples - first), 4)
