"""How to render: the choices that change pixels, in the renderer's own words."""

from __future__ import annotations

from dataclasses import dataclass

ESTIMATORS = ("mis", "bsdf", "light", "uniform")
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
)  # traced apart from the picture, when first asked for
AOVS = ("color", "albedo", "normal", "depth", "variance", *ID_AOVS, "incidence")


@dataclass(frozen=True)
class RenderSettings:
    """Size in pixels; `clamp` bounds the radiance of indirect light (None: unbiased); `adaptive`: a pixel's samples
    follow its noise (gpu/picture/sample_plan.py), and a picture's are their mean."""

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
