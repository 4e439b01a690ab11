"""`metal_rough`: the core BRDF of glTF 2.0."""

from __future__ import annotations

from typing import Literal

from service.document.material.parameters import BaseColor, Metallic, Roughness
from service.document.material.surface import Surface


class MetalRoughMaterial(Surface):
    """The core BRDF of glTF 2.0: a metal or a dielectric of index 1.5, without coat."""

    type: Literal["metal_rough"]
    base_color: BaseColor
    metallic: Metallic
    roughness: Roughness
