"""Quality presets, and settings with every knob resolved."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from service.scene.settings import BALANCED, Settings

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

    @property
    def render_width(self) -> int:
        return max(1, round(self.width * self.resolution_scale))

    @property
    def render_height(self) -> int:
        return max(1, round(self.height * self.resolution_scale))

    def for_gpu(self) -> dict[str, Any]:
        """The keyword arguments of gpu.RenderSettings."""
        same = ("max_bounces", "estimator", "sampler", "filter", "roulette_depth", "seed", "clamp")
        sized = {"width": self.render_width, "height": self.render_height}
        return sized | {name: getattr(self, name) for name in same}

    def document(self) -> dict[str, Any]:
        """What each knob became, as JSON; null is "no such limit"."""
        return asdict(self)

    def again(self, samples: int) -> dict[str, Any]:
        """Settings, as JSON, with which a picture that has `samples` samples comes out the same another time."""
        most = self.max_samples if self.adaptive else samples
        stop = {"max_samples": most, "time_limit": None, "target_noise": None}
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
