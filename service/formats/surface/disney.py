"""`disney_principled` as `principled`: the Disney model of 2012, with the glass of 2015."""

from __future__ import annotations

from service.formats.surface.inputs import Inputs
from service.formats.surface.plain import Default

# Parameters that are inputs of another name, and their defaults.
SAME: dict[str, tuple[str, float | None]] = {
    "base_color": ("baseColor", None), "metallic": ("metallic", 0.0), "roughness": ("roughness", 0.5),
    "specular": ("specular", 0.5), "specular_tint": ("specularTint", 0.0), "sheen": ("sheen", 0.0),
    "sheen_tint": ("sheenTint", 0.5), "clearcoat": ("clearcoat", 0.0), "clearcoat_gloss": ("clearcoatGloss", 1.0),
    "subsurface": ("subsurface", 0.0), "transmission": ("specTrans", 0.0),
    # Both stretch by 1 - 0.9 a; the library's implementation of it has another form of the same idea.
    "anisotropic": ("anisotropic", 0.0),
}  # fmt: skip
DEFAULTS: dict[str, Default] = {
    "baseColor": (0.16,) * 3, "metallic": 0.0, "roughness": 0.5, "anisotropic": 0.0, "specular": 0.5,
    "specularTint": 0.0, "sheen": 0.0, "sheenTint": 0.5, "clearcoat": 0.0, "clearcoatGloss": 1.0, "specTrans": 0.0,
    "ior": 1.5, "subsurface": 0.0,
}  # fmt: skip


def disney_principled(s: Inputs) -> None:
    for parameter, (name, default) in SAME.items():
        s.put(parameter, name, s.tree(name), default)
    if s.is_used("specTrans", 0):
        s.put("ior", "ior", s.tree("ior"))
        s.material.pop("specular", None)
    if s.is_used("subsurface", 0):
        s.note("subsurface", "light does not travel below the surface; the diffuse reflection is flatter instead")
