"""The experiment that this renderer was founded on: how error falls with samples of the hemisphere, and with time.

A sphere between a studio's lamps, an HDR image, direct light only: matte, and metal of roughness .1. Uniform
directions with independent numbers, as a beginner writes it, beside what Sunbox does by default.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from gpu import Renderer, RenderSettings
from service.bench import machine, timing
from service.bench.scenes import BenchAssets
from service.document import parse_scene, presets
from service.pack import pack

SIZE = 96
MATERIALS = {
    "diffuse": {"type": "diffuse", "albedo": 0.8},
    "metal r=.1": {"type": "disney", "base_color": [1, 0.8, 0.4], "metallic": 1, "roughness": 0.1},
}
WAYS = {"uniform": ("uniform", "independent"), "sunbox": ("mis", "sobol")}
BEYOND = 8  # times as many samples, of another seed, make the picture that errors are taken from
SEEDS = range(4)  # of the renders whose squared errors are averaged: uniform directions seldom meet a mirrored lamp


def measure(most: int, told: Callable[[str], None]) -> dict[str, Any]:
    """Samples 1, 4, 16 ... `most`: root mean square errors over the mean, and seconds, of each material and way."""
    counts = [4**k for k in range(int(math.log(most, 4) + 1e-9) + 1)]
    curves = []
    with Renderer() as renderer:
        for name, material in MATERIALS.items():
            told(f"{name}: {BEYOND * most} samples to compare with")
            truth = _render(renderer, material, "sunbox", [BEYOND * most], seed=len(SEEDS))[0][1]
            for way in WAYS:
                told(f"{name}, {way}")
                taken = [_render(renderer, material, way, counts, seed) for seed in SEEDS]
                squares = [[np.mean((image - truth) ** 2) for _, image in one] for one in taken]
                error = [float(np.sqrt(each) / truth.mean()) for each in np.mean(squares, axis=0)]
                seconds = np.median([[s for s, _ in one] for one in taken], axis=0).tolist()
                curves.append({"material": name, "way": way, "samples": counts, "seconds": seconds, "error": error,
                               "slope": slope(counts, error)})  # fmt: skip
        about = machine.describe(renderer.info)
    return {"machine": about, "size": [SIZE, SIZE], "curves": curves}


def slope(samples: list[int], error: list[float]) -> float:
    """Of log error over log samples: -1/2 is what independent samples give."""
    return float(np.polyfit(np.log(samples), np.log(error), 1)[0]) if len(samples) > 1 else math.nan


def _render(
    renderer: Renderer, material: dict[str, Any], way: str, counts: list[int], seed: int
) -> list[tuple[float, np.ndarray]]:
    """(seconds of tracing, picture) at each count of one render."""
    lamps = presets.get("environments", "studio")
    ball = {"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "m"}
    camera = {"position": [0, 0.6, 3.2], "target": [0, 0, 0], "vfov": 40}
    scene = {"version": 1, "camera": camera, "environment": lamps, "materials": {"m": material}, "shapes": [ball]}
    loaded = renderer.load(pack(parse_scene(scene), BenchAssets()).arrays)
    estimator, sampler = WAYS[way]
    settings = RenderSettings(SIZE, SIZE, 1, estimator=estimator, sampler=sampler, filter="box", seed=seed)
    picture = renderer.picture(loaded, settings)
    out, seconds = [], 0.0
    software = bool(renderer.info["software"])
    for count in counts:
        start = timing.clock(software)
        picture.trace(math.inf, count)
        seconds += timing.clock(software) - start
        out.append((seconds, picture.read()[..., :3].astype(np.float64)))
    picture.release()
    loaded.release()
    return out


def table(document: dict[str, Any]) -> str:
    """A line for each material and number of samples; how much more time uniform directions would need at the end."""
    lines = []
    by_name = {(c["material"], c["way"]): c for c in document["curves"]}
    for material in MATERIALS:
        uniform, ours = by_name[material, "uniform"], by_name[material, "sunbox"]
        lines.append(f"{material}: slope {uniform['slope']:.2f} uniform, {ours['slope']:.2f} sunbox")
        lines.append(f"  {'samples':>8} {'uniform':>9} {'s':>7} {'sunbox':>9} {'s':>7}")
        columns = uniform["samples"], uniform["error"], uniform["seconds"], ours["error"], ours["seconds"]
        lines += [f"  {n:>8} {a:>9.4g} {b:>7.3f} {c:>9.4g} {d:>7.3f}" for n, a, b, c, d in zip(*columns, strict=True)]
        factor = (uniform["error"][-1] / ours["error"][-1]) ** 2 * uniform["seconds"][-1] / ours["seconds"][-1]
        lines.append(f"  for the error of sunbox at its end uniform needs {factor:.3g} times its time")
    return "\n".join(lines)


def figure(document: dict[str, Any], path: Path) -> None:
    """Error over samples and over seconds, a row for each material. Raises ImportError without matplotlib."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    sheet = Figure(figsize=(9, 7), layout="constrained")
    FigureCanvasAgg(sheet)
    for row, material in enumerate(MATERIALS):
        for column, axis in enumerate(("samples", "seconds")):
            plot = sheet.add_subplot(2, 2, 2 * row + column + 1)
            for curve in document["curves"]:
                if curve["material"] == material:
                    plot.loglog(curve[axis], curve["error"], "o-", label=f"{curve['way']} ({curve['slope']:.2f})")
            first = next(c for c in document["curves"] if c["material"] == material)
            guide = [first["error"][0] * math.sqrt(first[axis][0] / x) for x in first[axis]]
            plot.loglog(first[axis], guide, ":", color="grey", label="slope -1/2")
            plot.set_title(f"{material}, at equal {'samples' if axis == 'samples' else 'time'}")
            plot.set_xlabel(axis)
            plot.set_ylabel("RMSE / mean")
            plot.grid(True, which="major", alpha=0.3)
            plot.legend()
    sheet.savefig(path, dpi=110)
