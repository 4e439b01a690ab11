"""Parameters that several models share."""

from __future__ import annotations

from typing import Annotated

from service.scene.base import hint
from service.scene.texture import AnyFraction, AnyReflectance

BaseColor = Annotated[
    AnyReflectance,
    hint(
        "Base colour",
        "Diffuse albedo, or a metal's reflectance head-on; real albedos lie in 0.03 to 0.9.",
        group="Base",
        unit="",
        widget="color",
    ),
]
Metallic = Annotated[
    AnyFraction,
    hint(
        "Metallic",
        "0 is a dielectric, 1 a metal; between is for dust or blends, not for one substance.",
        group="Base",
        unit="",
        widget="slider",
    ),
]
Roughness = Annotated[
    AnyFraction,
    hint(
        "Roughness",
        "0 is polished, 1 is matte; its square is the width of the highlight.",
        group="Base",
        highlight=("roughness", None),
        unit="",
        widget="slider",
    ),
]
