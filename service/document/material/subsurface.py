"""Light under the surface of `principled` and `openpbr`: media that it walks in, and those behind glass."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from service.document.base import OMITTABLE, picker, slider
from service.document.color import Reflectance
from service.document.medium import LARGEST_G, Coefficient
from service.document.numbers import Length
from service.document.texture import AnyFraction, AnyReflectance, ScalarTexture

_Anisotropy = Annotated[float, Field(ge=-1, le=1)]

WalkRadius = Annotated[
    Coefficient | None,
    OMITTABLE,
    picker(
        "Subsurface radius",
        "How far light goes below the surface between turns, per channel; without it, subsurface is a flatter shade.",
        "Subsurface",
        unit="m",
        soft=1,
        log=1e-5,
        absent="flat",
    ),
]
Depth = Annotated[
    Length,
    slider(
        "Transmission depth",
        "How far light goes through the material until it has the transmission colour. 0: it is tinted at the "
        "surface.",
        "Transmission",
        unit="m",
        soft=1,
        log=1e-5,
    ),
]
Scatter = Annotated[Reflectance, picker("Transmission scatter", "How milky the inside is.", "Transmission")]
ScatterAnisotropy = Annotated[
    _Anisotropy,
    slider(
        "Scatter anisotropy", "Where light goes when it is scattered: above 0 onwards, below 0 back.", "Transmission"
    ),
]
Weight = Annotated[
    AnyFraction,
    slider(
        "Subsurface",
        "How much of the light wanders below the surface, as in skin, wax or milk.",
        "Subsurface",
        known_as="subsurface",
    ),
]
Color = Annotated[
    AnyReflectance, picker("Subsurface colour", "The colour that a thick piece of it has.", "Subsurface")
]
Radius = Annotated[
    Length,
    slider(
        "Subsurface radius",
        "How far light goes below the surface between turns; 0: it comes back where it enters.",
        "Subsurface",
        unit="m",
        soft=1,
        log=1e-5,
    ),
]
RadiusScale = Annotated[Reflectance, picker("Radius scale", "A factor on the radius, per channel.", "Subsurface")]
Anisotropy = Annotated[
    _Anisotropy,
    slider(
        "Subsurface anisotropy", "Where light goes when it is scattered: above 0 onwards, below 0 back.", "Subsurface"
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
