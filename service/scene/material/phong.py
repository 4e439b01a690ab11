"""`phong`: the highlight of 1975, about the mirrored direction."""

from __future__ import annotations

from typing import Literal

from service.scene.material.blinn_phong import BlinnPhongMaterial


class PhongMaterial(BlinnPhongMaterial):
    """The first highlight of all, about the mirrored direction; like `blinn_phong` it conserves no energy."""

    type: Literal["phong"]  # type: ignore[assignment]
