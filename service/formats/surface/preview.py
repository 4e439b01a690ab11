"""`UsdPreviewSurface` as `principled` [OpenUSD, "UsdPreviewSurface Specification" 2.6]."""

from __future__ import annotations

from service.formats.surface import parts
from service.formats.surface.inputs import Inputs
from service.formats.surface.plain import Default
from service.formats.surface.trees import complement, constant, mixed

BLACK = (0.0, 0.0, 0.0)
DEFAULTS: dict[str, Default] = {
    "diffuseColor": (0.18,) * 3, "emissiveColor": BLACK, "useSpecularWorkflow": 0.0, "specularColor": BLACK,
    "metallic": 0.0, "roughness": 0.5, "clearcoat": 0.0, "clearcoatRoughness": 0.01, "opacity": 1.0,
    "opacityMode": 0.0, "opacityThreshold": 0.0, "ior": 1.5, "normal": None, "displacement": 0.0, "occlusion": 1.0,
}  # fmt: skip
PRESENCE = 1  # a value of opacityMode: opacity is the share of the surface that is there
DULL = 0.36  # the greatest reflectance head-on that an index up to 4 gives


def usd_preview_surface(s: Inputs) -> None:
    s.put("base_color", "diffuseColor", s.tree("diffuseColor"))
    if s.number("useSpecularWorkflow", 0):
        _reflecting(s)
    else:
        s.put("metallic", "metallic", s.tree("metallic"), 0.0)
        if s.material.get("metallic") != 1:
            s.put("ior", "ior", s.tree("ior"), 1.5)
    s.put("roughness", "roughness", s.tree("roughness"))
    parts.coat(s, "clearcoat", "clearcoatRoughness")
    parts.emission(s, s.tree("emissiveColor"), "emissiveColor")
    _opacity(s)
    s.normal("normal_map", "normal")
    s.height("displacement")
    s.lose([parts.OCCLUSION])


def _reflecting(s: Inputs) -> None:
    """A reflectance head-on of its own: an index of refraction and a tint, or a metal where it is too high."""
    name = "specularColor"
    found = s.constant(name)
    if found is not None and max(found) >= DULL:
        if not s.is_black(s.tree("diffuseColor")):
            s.note(name, "a surface that reflects so much is shown as a metal, without diffuseColor")
        s.put("base_color", name, s.tree(name))
        s.material["metallic"] = 1.0
        return
    if found is None and not s.computes:
        s.note(name, "a texture is not supported here; a reflectance of 0.04 is used instead")
        return
    s.put("ior", name, parts.index(parts.tint(s, name)))


def _opacity(s: Inputs) -> None:
    """Read the opacity: what is left out lets light through, as glass does; with a threshold, or as presence, it is
    not there."""
    threshold, opacity = s.number("opacityThreshold", 0), s.constant("opacity")
    is_glass = threshold == 0 and s.number("opacityMode", 0) != PRESENCE
    if is_glass and opacity is not None:
        s.put("transmission", "opacity", complement(s.tree("opacity")), 0.0)
        if opacity[0] < 1 and s.material.get("metallic") != 1:
            clear = mixed(constant(1.0, 1.0, 1.0), s.tree("diffuseColor"), s.tree("opacity"))
            s.put("base_color", "diffuseColor", clear, instead=s.tree("diffuseColor"))
        return
    if is_glass:
        detail = "under a texture, a transparent surface is one that rays meet less often, without highlights"
        s.note("opacity", detail)
    s.put("alpha", "opacity", s.tree("opacity"), 1.0)
    if threshold > 0 and "alpha" in s.material:
        s.put("alpha_cutoff", "opacityThreshold", constant(threshold))
