"""`UsdPreviewSurface` [OpenUSD, "UsdPreviewSurface Specification" 2.6] as `principled`, or as `openpbr` where that
loses less."""

from __future__ import annotations

from service.formats.surface import open_pbr, parts
from service.formats.surface.choice import read_best
from service.formats.surface.inputs import PART, Inputs
from service.formats.surface.plain import Default
from service.formats.surface.trees import complement, constant

BLACK = (0.0, 0.0, 0.0)
DEFAULTS: dict[str, Default] = {
    "diffuseColor": (0.18,) * 3, "emissiveColor": BLACK, "useSpecularWorkflow": 0.0, "specularColor": BLACK,
    "metallic": 0.0, "roughness": 0.5, "clearcoat": 0.0, "clearcoatRoughness": 0.01, "opacity": 1.0,
    "opacityMode": 0.0, "opacityThreshold": 0.0, "ior": 1.5, "normal": None, "displacement": 0.0, "occlusion": 1.0,
}  # fmt: skip
PRESENCE = 1  # a value of opacityMode: opacity is the share of the surface that is there
DULL = 0.36  # the greatest reflectance head-on that an index up to 4 gives


def usd_preview_surface(s: Inputs) -> None:
    read_best(s, _principled, _openpbr)
    s.height("displacement")
    s.lose([parts.OCCLUSION])


def _principled(s: Inputs) -> None:
    s.put("base_color", "diffuseColor", s.tree("diffuseColor"))
    _reflects(s, "metallic", "ior")
    s.put("roughness", "roughness", s.tree("roughness"))
    parts.coat(s, "clearcoat", "clearcoatRoughness")
    parts.emission(s, s.tree("emissiveColor"), "emissiveColor")
    if _is_glass(s):
        s.put("transmission", "opacity", complement(s.tree("opacity")), 0.0)
        if "transmission" in s.material and s.material.get("metallic") != 1:
            _passes(s)
    else:
        _fades(s, "alpha")
        if _threshold(s) > 0 and "alpha" in s.material:
            s.put("alpha_cutoff", "opacityThreshold", constant(_threshold(s)))
    s.normal("normal_map", "normal")


def _openpbr(s: Inputs) -> None:
    open_pbr.begin(s)
    s.put("base_color", "diffuseColor", s.tree("diffuseColor"))
    _reflects(s, "base_metalness", "specular_ior")
    s.put("specular_roughness", "roughness", s.tree("roughness"))
    open_pbr.lacquer(s, "clearcoat", "clearcoatRoughness", "roughness")
    open_pbr.shine(s, s.tree("emissiveColor"), "emissiveColor")
    if _is_glass(s):
        s.put("transmission_weight", "opacity", complement(s.tree("opacity")), 0.0)
    else:
        _fades(s, "geometry_opacity")
        if _threshold(s) > 0 and "geometry_opacity" in s.material:
            s.note("opacityThreshold", open_pbr.UNCUT, PART)
    s.normal("geometry_normal", "normal")


def _reflects(s: Inputs, metallic: str, ior: str) -> None:
    """Set the parameters of these names, and the reflection's colour."""
    if s.number("useSpecularWorkflow", 0):
        _reflects_so_much(s, metallic, ior)
        return
    s.put(metallic, "metallic", s.tree("metallic"), 0.0)
    if s.material.get(metallic) != 1:
        s.put(ior, "ior", s.tree("ior"), 1.5)


def _reflects_so_much(s: Inputs, metallic: str, ior: str) -> None:
    """A reflectance head-on of its own: an index of refraction and a tint, or a metal where it is too high."""
    name = "specularColor"
    found = s.constant(name)
    if found is not None and max(found) >= DULL:
        if not s.is_black(s.tree("diffuseColor")):
            s.note(name, "a surface that reflects so much is shown as a metal, without diffuseColor")
        s.put("base_color", name, s.tree(name))
        s.material[metallic] = 1.0
        return
    if found is None and not s.computes:
        s.note(name, "a texture is not supported here; a reflectance of 0.04 is used instead")
        return
    s.put(ior, name, parts.index(parts.tint(s, name)))


def _threshold(s: Inputs) -> float:
    return s.number("opacityThreshold", 0)


def _is_glass(s: Inputs) -> bool:
    """True if what the opacity leaves out lets light through, as glass does; with a threshold, or as presence, it is
    not there."""
    is_meant = _threshold(s) == 0 and s.number("opacityMode", 0) != PRESENCE
    if is_meant and s.constant("opacity") is None:
        s.note(
            "opacity", "under a texture, a transparent surface is one that rays meet less often, without highlights"
        )
        return False
    return is_meant


def _passes(s: Inputs) -> None:
    """Light passes through without a tint."""
    base = s.tree("diffuseColor")
    share = complement(s.tree("opacity"))
    clear = parts.passing(s, base, constant(1.0, 1.0, 1.0), share, "diffuseColor")
    s.put("base_color", "diffuseColor", clear, instead=base)


def _fades(s: Inputs, parameter: str) -> None:
    s.put(parameter, "opacity", s.tree("opacity"), 1.0)
