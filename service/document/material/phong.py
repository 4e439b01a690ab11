"""`phong`: the highlight of 1975, about the mirrored direction."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import ConfigDict

from service.document.material.blinn_phong import BlinnPhongMaterial, shininess
from service.document.texture import AnyFactor


class PhongMaterial(BlinnPhongMaterial):
    """The first highlight of all, about the mirrored direction; like `blinn_phong` it conserves no energy."""

    model_config = ConfigDict(json_schema_extra={"x-name": "Phong"})
    type: Literal["phong"]  # type: ignore[assignment]
    shininess: Annotated[AnyFactor, shininess("mirrored exponent")]
