"""Parameters that several models share."""

from __future__ import annotations

from typing import Annotated

from service.document.base import hint
from service.document.texture import AnyFraction, AnyReflectance

BaseColor = Annotated[
    AnyReflectance,
    hint(
        "Base colour",
        "The colour of the surface, or of a metal's reflection. Real surfaces lie between 0.03 and 0.9.",
        group="Base",
        unit="",
        widget="color",
    ),
]
Metallic = Annotated[
    AnyFraction,
    hint(
        "Metallic",
        "0 is no metal, 1 is metal. Values between are for dust, rust or blends.",
        group="Base",
        unit="",
        widget="slider",
    ),
]
Roughness = Annotated[
    AnyFraction,
    hint(
        "Roughness",
        "0 is polished, 1 is matte.",
        group="Base",
        highlight=("roughness", None),
        unit="",
        widget="slider",
    ),
]
