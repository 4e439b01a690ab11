"""`blinn_phong`: the highlight of early rasterisers."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import ConfigDict

from service.document.base import Width, picker, slider
from service.document.material.surface import Surface
from service.document.texture import AnyFactor, AnyRadiometric, AnyReflectance


def shininess(width: Width) -> Any:
    """The hint of an exponent."""
    return slider(
        "Shininess",
        "How tight the highlight is: 10 is dull, 100 is polished, 1000 is close to a mirror.",
        "Specular",
        highlight=(width, "specular"),
        soft=1000,
    )


class BlinnPhongMaterial(Surface):
    """The classic highlight of early rasterisers, as a baseline: it conserves no energy."""

    model_config = ConfigDict(json_schema_extra={"x-name": "Blinn-Phong"})
    type: Literal["blinn_phong"]
    diffuse: Annotated[
        AnyReflectance, picker("Diffuse", "Share of light that is sent back equally in all directions.", "Base")
    ]
    specular: Annotated[
        AnyReflectance,
        picker("Specular", "The colour of the highlight. A sharper highlight sends back less light.", "Specular"),
    ]
    shininess: Annotated[AnyFactor, shininess("exponent")]
    ambient: Annotated[
        AnyRadiometric,
        picker(
            "Ambient",
            "Light that is added wherever the surface is seen; it does not light other things.",
            "Emission",
            unit="W/(m^2 sr)",
            soft=1,
        ),
    ] = (0.0, 0.0, 0.0)
