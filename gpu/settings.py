"""Render settings: the choices that change pixels."""

from __future__ import annotations

from dataclasses import dataclass

ESTIMATORS = ("mis", "bsdf", "light", "uniform")
CAUSTICS = ("light", "paths", "auto")
SAMPLERS = ("sobol", "independent")
FILTERS = ("box", "tent", "gaussian", "blackman_harris")
TONE_MAPS = ("linear", "exponential", "reinhard", "aces", "agx", "pbr_neutral")
ID_AOVS = ("shape_id", "material_id")
FIRST_HIT_AOVS = (
    "albedo",
    "normal",
    "depth",
    *ID_AOVS,
    "incidence",
)  # traced apart from the picture, when they are first read
COVERAGE_AOVS = ("shape_coverage", "material_coverage")  # of Cryptomatte; traced apart, too
AOVS = ("color", "albedo", "normal", "depth", "variance", *ID_AOVS, "incidence")


@dataclass(frozen=True)
class RenderSettings:
    """The size is in pixels. `clamp` bounds the radiance of indirect light (None: unbiased). With `adaptive` a
    pixel's samples follow its noise (gpu/picture/sample_plan.py), and a picture's number of samples is their mean.
    `caustics` says whether they are traced from the lights or found by the camera's paths ("auto": see
    `features.traces_caustics`). `filter_glossy` is the least roughness after a path's first scattering; 0
    is unbiased."""

    width: int
    height: int
    max_bounces: int = 8
    estimator: str = "mis"
    sampler: str = "sobol"
    filter: str = "blackman_harris"
    roulette_depth: int = 3
    seed: int = 0
    clamp: float | None = None
    adaptive: bool = False
    caustics: str = "paths"
    filter_glossy: float = 0.0
