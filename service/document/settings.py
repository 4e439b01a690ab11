"""How a scene is to be rendered: size, limits, and the choices of method."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Protocol

from pydantic import Field, TypeAdapter

from service.config import MAX_PIXELS
from service.document.base import OMITTABLE, Model, entry, hint, slider
from service.document.numbers import BRIGHTEST, LARGEST
from service.document.validation import validated
from service.problems import FieldError, InvalidDocument

# The knobs of the quality "balanced" are the defaults; service.document.quality has the other presets.
BALANCED: dict[str, Any] = {"max_samples": 256, "max_bounces": 8, "roulette_depth": 3, "resolution_scale": 1.0}

Size = Annotated[int, Field(ge=1)]
Amount = Annotated[float, Field(gt=0, le=LARGEST)]


class Limits(Protocol):
    """The part of the service's configuration that bounds the settings."""

    @property
    def max_pixels(self) -> int: ...


class Settings(Model):
    """How to render. What is left out comes from the quality."""

    width: Annotated[Size, entry("Width", "Of the picture.", unit="pixels", soft=1920)] = 512
    height: Annotated[Size, entry("Height", "Of the picture.", unit="pixels", soft=1920)] = 512
    max_samples: Annotated[
        int | None,
        OMITTABLE,
        Field(ge=1, le=2**24),
        entry(
            "Samples",
            "When to stop. Four times as many samples halve the noise.",
            unit="",
            soft=4096,
            default=BALANCED["max_samples"],
        ),
    ] = None
    max_bounces: Annotated[
        int | None,
        OMITTABLE,
        Field(ge=0, le=1024),
        slider(
            "Bounces",
            "How often light may be reflected: 0 shows lamps only, 1 direct light, more the light between things.",
            soft=32,
            default=BALANCED["max_bounces"],
        ),
    ] = None
    time_limit: Annotated[
        Amount | None,
        OMITTABLE,
        entry(
            "Time limit",
            "Stops after this time. Without a number of samples, nothing else stops it.",
            unit="s",
            soft=60,
        ),
    ] = None
    target_noise: Annotated[
        Amount | None,
        OMITTABLE,
        entry(
            "Target noise",
            "Stops when this little noise is left, as a share of the brightness: 0.01 looks clean.",
            unit="",
            soft=0.1,
        ),
    ] = None
    seed: Annotated[
        int,
        Field(ge=0, le=2**32 - 1),
        entry("Seed", "Another number gives other noise, of the same strength.", unit="", soft=100),
    ] = 0
    quality: Annotated[
        Literal["draft", "preview", "balanced", "high", "reference"],
        hint("Quality", "Sets samples, bounces and roulette where they are not given."),
    ] = "balanced"
    estimator: Annotated[
        Literal["mis", "bsdf", "light", "uniform"],
        hint("Estimator", "How light is looked for. mis is the best; the others are for comparison."),
    ] = "mis"
    sampler: Annotated[
        Literal["sobol", "independent"],
        hint("Sampler", "How samples are spread. sobol spreads them evenly, and so needs fewer of them."),
    ] = "sobol"
    filter: Annotated[
        Literal["box", "tent", "gaussian", "blackman_harris"],
        hint("Pixel filter", "How soft the edges of pixels are: box is the sharpest, gaussian the softest."),
    ] = "blackman_harris"
    roulette_depth: Annotated[
        int | None,
        OMITTABLE,
        Field(ge=0, le=1024),
        slider(
            "Roulette from",
            "After how many bounces dim light may be given up: more speed for more noise.",
            soft=32,
            default=BALANCED["roulette_depth"],
        ),
    ] = None
    resolution_scale: Annotated[
        float | None,
        OMITTABLE,
        Field(gt=0, le=1),
        slider("Resolution", "A factor on the width and the height.", default=BALANCED["resolution_scale"]),
    ] = None
    adaptive: Annotated[bool, hint("Adaptive", "More samples where there is more noise, fewer elsewhere.")] = False
    clamp: Annotated[
        Annotated[float, Field(gt=0, le=BRIGHTEST)] | None,
        OMITTABLE,
        entry(
            "Clamp",
            "Limits how bright reflected light can be: removes fireflies, and some light with them.",
            unit="W/(m^2 sr)",
            soft=100,
        ),
    ] = None
    caustics: Annotated[
        Literal["light", "paths"] | None,
        OMITTABLE,
        hint(
            "Caustics",
            "How light that glass and mirrors gather is found. Left out, the way with less noise is taken.",
        ),
    ] = None
    filter_glossy: Annotated[
        float,
        Field(ge=0, le=1),
        slider("Filter glossy", "Blurs reflections within reflections: less noise, but less true."),
    ] = 0.0
    denoise: Annotated[bool, hint("Denoise", "Filters noise out of the picture.")] = False


_SETTINGS = TypeAdapter(Settings)


def _refuse_beside_light(settings: Settings, pointer: str) -> None:
    """Raises InvalidDocument for settings that caustics which are traced from the lights do not go with."""
    if settings.caustics != "light":
        return
    if settings.adaptive:
        reason = 'adaptive sampling plans by the camera\'s paths alone; use caustics "paths" with it'
        raise InvalidDocument([FieldError(f"{pointer}/caustics", reason)])
    if settings.filter_glossy > 0:
        reason = 'filter_glossy makes surfaces rough that light is traced through; use caustics "paths" with it'
        raise InvalidDocument([FieldError(f"{pointer}/caustics", reason)])


def parse_settings(document: Any, pointer: str = "", limits: Limits | None = None) -> Settings:
    """The settings that a document gives. Raises InvalidDocument with every mistake, seen from `pointer` up."""
    settings = validated(_SETTINGS, document, pointer)
    _refuse_beside_light(settings, pointer)
    most = limits.max_pixels if limits else MAX_PIXELS
    if settings.width * settings.height > most:
        larger = "width" if settings.width >= settings.height else "height"
        detail = f"{settings.width} x {settings.height} are more than the {most} pixels allowed (SUNBOX_MAX_PIXELS)"
        raise InvalidDocument([FieldError(f"{pointer}/{larger}", detail)])
    return settings
