"""Light under the surface of `principled` and `openpbr`: media that it walks in, and those behind glass."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from service.document.base import OMITTABLE, hint
from service.document.color import Reflectance
from service.document.medium import LARGEST_G, Coefficient
from service.document.numbers import Length
from service.document.texture import AnyFraction, AnyReflectance, ScalarTexture

_Anisotropy = Annotated[float, Field(ge=-1, le=1)]

WalkRadius = Annotated[
    Coefficient | None,
    OMITTABLE,
    hint(
        "Subsurface radius",
        "How far light goes below the surface between turns, per channel; without it, subsurface is a flatter shade.",
        group="Subsurface",
        unit="m",
        widget="color",
        soft=1,
        log=1e-5,
        absent="flat",
    ),
]
Depth = Annotated[
    Length,
    hint(
        "Transmission depth",
        "How far light goes through the material until it has the transmission colour. 0: it is tinted at the "
        "surface.",
        group="Transmission",
        unit="m",
        widget="slider",
        soft=1,
        log=1e-5,
    ),
]
Scatter = Annotated[
    Reflectance,
    hint(
        "Transmission scatter",
        "How milky the inside is.",
        group="Transmission",
        unit="",
        widget="color",
    ),
]
ScatterAnisotropy = Annotated[
    _Anisotropy,
    hint(
        "Scatter anisotropy",
        "Where light goes when it is scattered: above 0 onwards, below 0 back.",
        group="Transmission",
        unit="",
        widget="slider",
    ),
]
Weight = Annotated[
    AnyFraction,
    hint(
        "Subsurface",
        "How much of the light wanders below the surface, as in skin, wax or milk.",
        known_as="subsurface",
        group="Subsurface",
        unit="",
        widget="slider",
    ),
]
Color = Annotated[
    AnyReflectance,
    hint(
        "Subsurface colour", "The colour that a thick piece of it has.", group="Subsurface", unit="", widget="color"
    ),
]
Radius = Annotated[
    Length,
    hint(
        "Subsurface radius",
        "How far light goes below the surface between turns; 0: it comes back where it enters.",
        group="Subsurface",
        unit="m",
        widget="slider",
        soft=1,
        log=1e-5,
    ),
]
RadiusScale = Annotated[
    Reflectance,
    hint("Radius scale", "A factor on the radius, per channel.", group="Subsurface", unit="", widget="color"),
]
Anisotropy = Annotated[
    _Anisotropy,
    hint(
        "Subsurface anisotropy",
        "Where light goes when it is scattered: above 0 onwards, below 0 back.",
        group="Subsurface",
        unit="",
        widget="slider",
    ),
]


def open_interval(g: float) -> float:
    """A mean cosine whose phase function exists."""
    return min(max(g, -LARGEST_G), LARGEST_G)


def factor_of(value: float | ScalarTexture) -> float:
    """A number, or the factor on the texture that gives it."""
    return value.factor if isinstance(value, ScalarTexture) else value


def radii(radius: float, scale: Any) -> tuple[float, float, float]:
    red, green, blue = scale
    return radius * red, radius * green, radius * blue
