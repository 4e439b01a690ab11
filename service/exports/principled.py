"""Materials of every model as `principled`, in the units and names that other programs' formats share."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import Any

from service.document.material import (
    BlinnPhongMaterial,
    DiffuseMaterial,
    Material,
    MicrofacetMaterial,
    PhongMaterial,
    PrincipledMaterial,
)
from service.document.material.conversion import converted
from service.document.texture import ScalarTexture
from service.exports.losses import Losses

MATTE = {"roughness": 1.0, "specular": 0.0}
MOST_SPECULAR = 0.08  # reflectance head-on that `specular` 1 stands for


def as_principled(
    material: Material, pointer: str, losses: Losses, written: Collection[str] = ()
) -> PrincipledMaterial:
    """The material as one of `principled`. What that loses is added to `losses`, but for the parameters `written` of
    the material itself that the format has; `pointer` leads to the material."""
    if isinstance(material, PrincipledMaterial):
        return material
    document = material.model_dump(exclude_unset=True)
    found = converted(document, type(material), PrincipledMaterial)
    made = found.material | _highlight(material)
    lost = [name for name in found.lost if name not in ("type", *written, *_READ.get(material.type, ()))]
    losses.add(f"{pointer}/type", _HOW.get(material.type, f"{material.type} is written as principled"))
    for name in lost:
        losses.add(f"{pointer}/{name}", f"{material.type} alone has it")
    return PrincipledMaterial.model_validate(made)


_HOW = {
    "diffuse": "diffuse is written as a rough surface without a highlight",
    "disney": "disney is written as principled, which gains no energy",
    "measured": "measured is written as grey principled, as no other format has its file",
    "metal_rough": "metal_rough is written as principled, which puts back the energy that facets lose",
}
_READ = {
    "blinn_phong": ("specular", "shininess"),
    "phong": ("specular", "shininess"),
    "microfacet": ("alpha", "f0", "distribution", "fresnel"),
}


def _highlight(material: Material) -> dict[str, Any]:
    """The roughness and the reflectance head-on of a model that has neither of principled's."""
    if isinstance(material, DiffuseMaterial):
        return dict(MATTE)
    if isinstance(material, BlinnPhongMaterial):
        about_half = 4 if isinstance(material, PhongMaterial) else 1  # mirrored directions turn twice as far
        n = about_half * _number(material.shininess)
        # The reflectance that the highlight's peak stands for, with its normalisation [Akenine-Moeller et al.].
        return _facets(math.sqrt(2 / (n + 2)), material.specular, (n + 8) / 8, material.diffuse)
    if isinstance(material, MicrofacetMaterial):
        return _facets(min(_number(material.alpha), 1.0), material.f0, 1.0, material.diffuse)
    return {}


def _facets(alpha: float, reflectance: Any, factor: float, diffuse: Any) -> dict[str, Any]:
    """A metal where there is nothing below the facets, else a dielectric."""
    made: dict[str, Any] = {"roughness": min(math.sqrt(alpha), 1.0)}
    r, g, b = (min(each * factor, 1.0) for each in _color(reflectance))
    most = max(r, g, b)
    if max(_color(diffuse)) == 0 and most > MOST_SPECULAR:
        return made | {"metallic": 1.0, "base_color": [r, g, b]}
    tint = [each / most for each in (r, g, b)] if most else [1.0, 1.0, 1.0]
    return made | {"metallic": 0.0, "specular": min(most / MOST_SPECULAR, 1.0), "specular_color": tint}


def _color(value: Any) -> tuple[float, float, float]:
    """A colour, or the factor of its texture."""
    found = value if isinstance(value, tuple) else getattr(value, "factor", value)
    return found if isinstance(found, tuple) else (found, found, found)


def _number(value: Any) -> float:
    return float(value.factor if isinstance(value, ScalarTexture) else value)
