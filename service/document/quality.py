"""Quality presets, and settings with every knob resolved."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any

from service.document.settings import BALANCED, Settings
from service.ipc.messages import TRUSTED_SAMPLES

# What each preset puts in the place of what is not given. Samples go up by four, which halves the noise; bounces end
# where the next one adds less than that noise to a room of white walls; roulette starts later where paths are longer,
# because ending them early costs more variance than it saves time.
PRESETS: dict[str, dict[str, Any]] = {
    "draft": {"max_samples": 16, "max_bounces": 3, "roulette_depth": 2, "resolution_scale": 1.0},
    "preview": {"max_samples": 64, "max_bounces": 5, "roulette_depth": 3, "resolution_scale": 1.0},
    "balanced": BALANCED,
    "high": {"max_samples": 1024, "max_bounces": 16, "roulette_depth": 5, "resolution_scale": 1.0},
    "reference": {"max_samples": 4096, "max_bounces": 64, "roulette_depth": 16, "resolution_scale": 1.0},
}

PRICES_FILE = Path(__file__).with_name("prices.json")  # written by `sunbox bench tradeoff --publish`


@dataclass(frozen=True)
class ResolvedSettings:
    """Settings in which every knob has its value; `max_samples` is None where only time or noise ends the render."""

    width: int
    height: int
    max_samples: int | None
    max_bounces: int
    time_limit: float | None
    target_noise: float | None
    seed: int
    quality: str
    estimator: str
    sampler: str
    filter: str
    roulette_depth: int
    resolution_scale: float
    adaptive: bool
    clamp: float | None
    denoise: bool
    # Stored renders that began before these were there have no such values, and go on as they began.
    caustics: str | None = "paths"
    filter_glossy: float = 0.0

    @property
    def render_width(self) -> int:
        return max(1, round(self.width * self.resolution_scale))

    @property
    def render_height(self) -> int:
        return max(1, round(self.height * self.resolution_scale))

    def for_gpu(self) -> dict[str, Any]:
        """The keyword arguments of gpu.RenderSettings."""
        same = (
            "max_bounces", "estimator", "sampler", "filter", "roulette_depth", "seed", "clamp", "adaptive",
            "filter_glossy",
        )  # fmt: skip
        sized: dict[str, Any] = {"width": self.render_width, "height": self.render_height}
        sized |= {"caustics": self.caustics or "auto"}
        return sized | {name: getattr(self, name) for name in same}

    def document(self) -> dict[str, Any]:
        """The resolved value of each knob, as JSON; null is "no such limit"."""
        return asdict(self)

    def again(self, samples: int) -> dict[str, Any]:
        """Settings, as JSON, with which a picture that has `samples` samples comes out the same another time."""
        stop = {"max_samples": samples, "time_limit": None, "target_noise": None}
        return {name: value for name, value in (self.document() | stop).items() if value is not None}


def resolve(settings: Settings) -> ResolvedSettings:
    knobs = dict(PRESETS[settings.quality])
    if settings.time_limit is not None or settings.target_noise is not None:
        knobs["max_samples"] = None
    values = settings.model_dump()
    for name, preset in knobs.items():
        if values[name] is None:
            values[name] = preset
    return ResolvedSettings(**values)


@cache
def price_list() -> dict[str, Any]:
    """The measured cost of presets and knobs, with the machine's name. Empty where nothing was measured."""
    return dict(json.loads(PRICES_FILE.read_text())) if PRICES_FILE.exists() else {}


def priced() -> dict[str, Any]:
    """The presets, each with its measured cost, that of a square of `size` pixels across, and what it gives up."""
    prices = price_list()
    if not prices:
        return PRESETS
    size = {"size": prices["told_size"]}
    return {
        name: knobs | {"cost": prices["presets"][name] | size, "gives_up": text(name, prices)}
        for name, knobs in PRESETS.items()
    }


def text(name: str, prices: dict[str, Any]) -> str:
    """One line about a preset, for a menu."""
    cost, size = prices["presets"][name], prices["told_size"]
    worst = cost["worst_missing_light"]
    line = f"{short(cost['seconds'])} s to {100 * cost['noise']:.1f} % noise at {size} x {size}; "
    line += f"light beyond {PRESETS[name]['max_bounces']} bounces is missing"
    if worst["share"] < 0.0005:
        return line + ", less than 0.05 % of it in any scene measured"
    return line + f", {100 * cost['missing_light']:.1f} % of it, {100 * worst['share']:.1f} % in {worst['scene']}"


def short(seconds: float) -> str:
    """Seconds as a menu shows them."""
    return f"{seconds:.1f}" if seconds < 10 else f"{seconds:.0f}"


def forecast(samples: int, noise: float | None, elapsed_s: float) -> dict[str, Any] | None:
    """Seconds from the start and noise for each preset's number of samples: of the scene at hand with its own
    bounces, from what it has taken so far; None before that is known. Noise is taken to fall with the root of the
    samples: what a low-discrepancy sampler gains beyond that comes on top."""
    if samples < TRUSTED_SAMPLES or noise is None or elapsed_s <= 0:
        return None
    return {
        name: {
            "samples": knobs["max_samples"],
            "seconds": elapsed_s * knobs["max_samples"] / samples,
            "noise": noise * (samples / knobs["max_samples"]) ** 0.5,
        }
        for name, knobs in PRESETS.items()
    }
