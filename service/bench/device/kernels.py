"""One kernel for many scenes beside a scene's own."""

from __future__ import annotations

from gpu import Renderer
from gpu.analysis.kernel_cost import kernel_cost
from service.bench.device import stage
from service.bench.device.stage import Options, Row

SCENES = ("sphere-on-floor", "generated-mesh")


def measure(name: str, options: Options) -> Row:
    """A `report.Kernel`."""
    with Renderer(options.device) as renderer:
        cost = kernel_cost(renderer, stage.arrays(name))
    ratio = cost.full_sample_s / cost.sample_s
    return {"scene": name, "full_compile_ms": cost.full_compile_ms, "time_ratio": ratio}
