"""The price list: what every knob that buys speed costs in error, against converged references.

Error is relMSE, mean((x - r)^2 / (r^2 + .01)), its part that more samples would not remove (bias), and LDR-FLIP
[Andersson et al. 2020] of the picture as the default view shows it, at 67 pixels per degree (a 70 cm wide 4K screen
from 70 cm). Seconds are processor time over the number of cores on a software renderer, which a busy machine hardly
changes, else wall time; scaled from the measured size to 512 x 512.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from gpu import Renderer, RenderSettings, denoise
from gpu.analysis.metering import noise_meter_off
from service.bench import machine
from service.colorimetry import LUMINANCE
from service.document import parse_scene
from service.document.quality import PRESETS
from service.pack import pack
from tests.bench import pareto
from tests.bench.tradeoff_scenes import Case, TradeoffAssets, cases

FULL = 512  # pixels a side of the pictures whose seconds are reported
EQUAL_SAMPLES = 64  # of the plain render: errors at equal time are at the time that it takes
SEEDS = (1, 2)  # two pictures of each: half their squared difference is noise, what else they err is bias
PPD = 67.0  # pixels per degree, for FLIP
REFERENCE = PRESETS["reference"]


@dataclass(frozen=True)
class Options:
    """`size`: pixels a side; `quick`: a few seconds for one scene, whose figures mean nothing."""

    size: int = 128
    quick: bool = False

    def samples(self, wanted: int) -> int:
        return max(2, wanted // 32) if self.quick else wanted


@dataclass(frozen=True)
class Variation:
    """One knob turned from balanced; its curve over the samples."""

    knob: str
    value: str
    settings: dict[str, Any] = field(default_factory=dict)
    samples: tuple[int, ...] = (16, 64)
    scale: float = 1.0
    denoise: bool = False
    metered: bool = True


def variations() -> list[Variation]:
    plain = Variation("samples", "balanced", samples=(4, 16, 64, 256))
    out = [plain]
    out += [Variation("max_bounces", str(n), {"max_bounces": n}) for n in (2, 3, 5, 16)]
    out += [Variation("estimator", name, {"estimator": name}) for name in ("bsdf", "light", "uniform")]
    out += [Variation("sampler", "independent", {"sampler": "independent"})]
    out += [Variation("clamp", str(c), {"clamp": float(c)}) for c in (1, 10)]
    out += [Variation("resolution_scale", "0.5", scale=0.5, samples=(64, 256))]
    out += [Variation("denoise", "true", denoise=True, samples=(4, 16, 64, 256))]
    out += [Variation("adaptive", "true", {"adaptive": True}, samples=(16, 64, 256))]
    out += [Variation("roulette_depth", str(n), {"roulette_depth": n}) for n in (1, 8)]
    out += [Variation("filter", name, {"filter": name}) for name in ("box", "tent", "gaussian")]
    out += [Variation("noise meter", "off", metered=False)]
    return out


def measure(options: Options, told: Callable[[str], None]) -> dict[str, Any]:
    """Everything, as JSON."""
    renderer = Renderer()
    assets, scenes = TradeoffAssets(), []
    for case in cases()[:1] if options.quick else cases():
        told(case.name)
        scenes.append(Bench(renderer, case, assets, options).measure(told))
    document = {
        "machine": machine.describe(renderer.info),
        "measured_size": options.size,
        "told_size": FULL,
        "flip": {"exposure": 0, "tone_map": "pbr_neutral", "pixels_per_degree": PPD},
        "quick": options.quick,
        "equal_samples": options.samples(EQUAL_SAMPLES),
        "scenes": scenes,
    }
    renderer.close()
    return document | pareto.summary(scenes)


class Bench:
    """One scene: its reference, and the pictures that are compared with it."""

    def __init__(self, renderer: Renderer, case: Case, assets: TradeoffAssets, options: Options) -> None:
        self._renderer, self._options, self._name = renderer, options, case.name
        self._scene = renderer.load(pack(parse_scene(case.scene), assets).arrays)
        self._cores = machine.cores() if renderer.info["software"] else 0

    def measure(self, told: Callable[[str], None]) -> dict[str, Any]:
        self._viewer = self._renderer.picture(self._scene, self._settings())  # only to display others
        self._viewer.trace(600.0, 1)
        knobs = {name: REFERENCE[name] for name in ("max_bounces", "roulette_depth")}
        wanted = self._options.samples(1536)
        halves = [self._picture(self._settings(seed=seed, **knobs), [wanted])[0] for seed in (1001, 1002)]
        self._reference = (halves[0]["pixels"] + halves[1]["pixels"]) / 2
        self._doubt = _relative((halves[0]["pixels"] - halves[1]["pixels"]) / 2, self._reference)
        self._shown = self._display(self._reference)
        rows = []
        for variation in variations():
            told(f"{self._name}: {variation.knob} {variation.value}")
            rows.append({"knob": variation.knob, "value": variation.value, "curve": self._curve(variation)})
        presets = {}
        for name, values in PRESETS.items():
            told(f"{self._name}: preset {name}")
            settings = {key: values[key] for key in ("max_bounces", "roulette_depth")}
            one = Variation("quality", name, settings, (self._options.samples(values["max_samples"]),))
            presets[name] = self._curve(one, SEEDS[:1] if values["max_samples"] > 1024 else SEEDS)[-1]
        self._viewer.release()
        self._scene.release()
        row = {"name": self._name, "reference_relmse": self._doubt, "variations": rows, "presets": presets}
        return row | {"equal_time": pareto.at_equal_time(rows, self._options.samples(EQUAL_SAMPLES))}

    def _settings(self, **knobs: Any) -> RenderSettings:
        size = self._options.size
        plain = {name: PRESETS["balanced"][name] for name in ("max_bounces", "roulette_depth")}
        return RenderSettings(size, size, **{**plain, **knobs})

    def _curve(self, variation: Variation, seeds: tuple[int, ...] = SEEDS) -> list[dict[str, float]]:
        counts = [self._options.samples(n) if variation.knob != "quality" else n for n in variation.samples]
        settings = self._settings(**variation.settings)
        side = max(1, round(self._options.size * variation.scale))
        settings = replace(settings, width=side, height=side)
        with nullcontext() if variation.metered else noise_meter_off():
            runs = [self._picture(replace(settings, seed=s), counts, variation.denoise) for s in seeds]
        return [self._judged([run[k] for run in runs]) for k in range(len(counts))]

    def _picture(self, settings: RenderSettings, counts: list[int], smooth: bool = False) -> list[dict[str, Any]]:
        """Pixels, samples and seconds at each of the counts."""
        picture = self._renderer.picture(self._scene, settings)
        picture.trace(600.0, 1)  # compiles
        picture.reset()
        spent, out = 0.0, []
        for count in counts:
            began = self._clock()
            picture.trace(1e9, count)
            spent += self._clock() - began
            began, pixels = self._clock(), picture.read()
            if smooth:
                pixels = denoise.denoise(pixels, *picture.guides(denoise.GUIDE_SAMPLES))
            extra = self._clock() - began if smooth else 0.0
            scale = (FULL / self._options.size) ** 2
            found = {"pixels": _enlarged(pixels[..., :3], self._options.size), "samples": picture.samples}
            out.append(found | {"seconds": (spent + extra) * scale, "noise": picture.noise()})
        picture.release()
        return out

    def _clock(self) -> float:
        return time.process_time() / self._cores if self._cores else time.perf_counter()

    def _judged(self, same: list[dict[str, Any]]) -> dict[str, float]:
        """Figures of pictures that differ in their seed only."""
        reference, pixels = self._reference, [one["pixels"] for one in same]
        total = float(np.mean([_relative(x - reference, reference) for x in pixels])) - self._doubt
        row = {"samples": same[0]["samples"], "seconds": float(np.mean([one["seconds"] for one in same]))}
        row |= {"noise": same[0]["noise"], "relmse": max(total, 0.0), "flip": self._flip(pixels[0])}
        if len(pixels) > 1:
            row["bias"] = max(total - _relative((pixels[0] - pixels[1]) / np.sqrt(2), reference), 0.0)
        mean = float((reference @ LUMINANCE).mean())
        row["light"] = float(np.mean([(x @ LUMINANCE).mean() for x in pixels])) / mean
        return row

    def _flip(self, pixels: np.ndarray) -> float:
        import flip_evaluator

        _, mean, _ = flip_evaluator.evaluate(
            self._shown, self._display(pixels), "LDR", applyMagma=False, parameters={"ppd": PPD}
        )
        return float(mean)

    def _display(self, pixels: np.ndarray) -> np.ndarray:
        """As the default view shows it: (h, w, 3) sRGB 0..1."""
        color = np.ones((*pixels.shape[:2], 4), np.float32)
        color[..., :3] = pixels
        return np.ascontiguousarray(self._viewer.display(dtype="f4", color=color)[..., :3])


def _relative(difference: np.ndarray, reference: np.ndarray) -> float:
    return float((difference.astype(float) ** 2 / (reference.astype(float) ** 2 + 0.01)).mean())


def _enlarged(pixels: np.ndarray, size: int) -> np.ndarray:
    """Bilinear, as a browser shows a smaller picture."""
    if len(pixels) == size:
        return pixels.astype(np.float64)
    at = np.clip((np.arange(size) + 0.5) * len(pixels) / size - 0.5, 0, len(pixels) - 1)
    low = np.minimum(at.astype(int), len(pixels) - 2)
    share = at - low
    rows = pixels[low] * (1 - share)[:, None, None] + pixels[low + 1] * share[:, None, None]
    wide: np.ndarray = rows[:, low] * (1 - share)[None, :, None] + rows[:, low + 1] * share[None, :, None]
    return wide
