"""All the experiments, in one go."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from gpu import Renderer
from gpu.analysis.unbounded import UnboundedRenderer
from service.bench import machine
from tests.bench.seeds import blur, bounces, reflection, samples, spheres
from tests.bench.seeds.stage import Stage


def measure(quick: bool, told: Callable[[str], None]) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """(the figures, as JSON; pictures (h, w, 3) of sRGB bytes by name). `quick` runs are small; their figures mean
    nothing.

    Raises GpuError.
    """
    with Renderer() as renderer, UnboundedRenderer() as unbounded:
        stage = Stage(renderer, quick, told)
        began = stage.clock()
        document = {
            "machine": machine.describe(renderer.info),
            "quick": quick,
            "spheres": spheres.measure(replace(stage, renderer=unbounded)),
            "rooms": bounces.rooms(stage),
            "model": bounces.model(stage),
            "samples": samples.measure(stage),
            "blur": blur.measure(stage),
            "reflection": reflection.measure(stage),
        }
        return document | {"took_s": stage.clock() - began}, stage.pictures
