"""`diffuse`: the Lambertian model."""

from __future__ import annotations

from typing import Annotated, Literal

from service.document.base import picker
from service.document.material.surface import Surface
from service.document.texture import AnyReflectance


class DiffuseMaterial(Surface):
    """Scatters equally in all directions: f = albedo / pi."""

    type: Literal["diffuse"]
    albedo: Annotated[
        AnyReflectance,
        picker(
            "Albedo",
            "The colour, as the share of light that is sent back: snow 0.9, white paint 0.8, grass 0.25, "
            "charcoal 0.04.",
            "Base",
        ),
    ]
