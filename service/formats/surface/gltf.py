"""`gltf_pbr`, the metallic-roughness model of glTF 2.0 with its ratified extensions, as `principled`, or as `openpbr`
where that loses less.

glTF's own files give two inputs that MaterialX' node lacks: the share of diffuse light that goes through a surface,
and its colour.
"""

from __future__ import annotations

import math

from service.formats.surface import open_pbr, parts
from service.formats.surface.choice import read_best
from service.formats.surface.inputs import PART, ROUGHLY, TANGENT, Inputs
from service.formats.surface.plain import Default
from service.formats.surface.trees import (
    Tree,
    added,
    clamped,
    complement,
    constant,
    mixed,
    quotient,
    raised,
    times,
)

WHITE, BLACK = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)
DEFAULTS: dict[str, Default] = {
    "base_color": WHITE, "metallic": 1.0, "roughness": 1.0, "normal": None, "tangent": None, "occlusion": 1.0,
    "transmission": 0.0, "specular": 1.0, "specular_color": WHITE, "ior": 1.5, "alpha": 1.0, "alpha_mode": 0.0,
    "alpha_cutoff": 0.5, "iridescence": 0.0, "iridescence_ior": 1.3, "iridescence_thickness": 100.0,
    "sheen_color": BLACK, "sheen_roughness": 0.0, "clearcoat": 0.0, "clearcoat_roughness": 0.0,
    "clearcoat_normal": None, "emissive": BLACK, "emissive_strength": 1.0, "thickness": 0.0,
    "attenuation_distance": 0.0, "attenuation_color": WHITE, "anisotropy_strength": 0.0, "anisotropy_rotation": 0.0,
    "dispersion": 0.0, "diffuse_transmission": 0.0, "diffuse_transmission_color": WHITE,
}  # fmt: skip
OPAQUE, MASK, BLEND = range(3)  # values of alpha_mode
SHOWN_ABBE = 20.0  # the Abbe number of a dispersion of 1
HEAD_ON = "the weight lowers the reflection seen head-on only; at grazing angles it stays as it is"


def gltf_pbr(s: Inputs) -> None:
    read_best(s, _principled, _openpbr)
    if s.is_given("tangent"):
        s.note("tangent", TANGENT)


def _principled(s: Inputs) -> None:
    common(s)
    _specular(s)
    color = s.tree("sheen_color")
    if not s.is_black(color):
        parts.sheen(s, constant(1.0), color, s.tree("sheen_roughness"), "sheen_color")
    _stretch(s)
    parts.coat(s, "clearcoat", "clearcoat_roughness", normal="clearcoat_normal")
    is_body = s.is_used("thickness", 0)
    s.put("transmission", "transmission", s.tree("transmission"), 0.0)
    if s.is_used("transmission", 0):
        _inside(s, is_body)
    _through(s, is_body)
    parts.film(s, "iridescence_thickness", "iridescence_ior", "iridescence")
    opacity(s)


def _openpbr(s: Inputs) -> None:
    open_pbr.begin(s)
    s.put("base_color", "base_color", s.tree("base_color"))
    s.put("base_metalness", "metallic", s.tree("metallic"), 0.0)
    _reflects(s)
    _highlight(s)
    color = s.tree("sheen_color")
    if not s.is_black(color):
        s.material["fuzz_weight"] = 1.0
        s.put("fuzz_color", "sheen_color", color)
        s.put("fuzz_roughness", "sheen_color", s.tree("sheen_roughness"))
        s.note("sheen_color", open_pbr.FUZZY)
    open_pbr.lacquer(s, "clearcoat", "clearcoat_roughness", "roughness", "clearcoat_normal")
    if s.is_used("transmission", 0):
        s.put("transmission_weight", "transmission", s.tree("transmission"), 0.0)
        _refracts(s)
    if s.is_given("diffuse_transmission") and s.is_used("diffuse_transmission", 0):
        s.note("diffuse_transmission", "diffuse light that goes through is left out", PART)
    if s.is_used("iridescence", 0) and s.is_used("iridescence_thickness", 0):
        s.put("thin_film_weight", "iridescence", s.tree("iridescence"), 0.0)
        s.put("thin_film_thickness", "iridescence_thickness", times(s.tree("iridescence_thickness"), 1e-3), 0.5)
        s.put("thin_film_ior", "iridescence_ior", s.tree("iridescence_ior"), 1.4)
    open_pbr.shine(s, times(s.tree("emissive"), s.tree("emissive_strength")), "emissive")
    mode = int(s.number("alpha_mode", OPAQUE))
    if mode != OPAQUE:
        s.put("geometry_opacity", "alpha", s.tree("alpha"), 1.0)
    if mode == MASK:
        s.note("alpha_cutoff", open_pbr.UNCUT, PART)
    s.normal("geometry_normal", "normal")
    s.lose([parts.OCCLUSION])


def _reflects(s: Inputs) -> None:
    """The weight and the colour of the reflection, as `_specular` has them."""
    color, beyond = s.tree("specular_color"), max(1.0, *map(float, s.most("specular_color")))
    is_colored = s.is_given("specular_color") and s.is_used("specular_color", 1)
    is_weighted = s.is_used("specular", 1)
    if is_colored:
        s.put("specular_color", "specular_color", times(color, 1 / beyond), 1.0)
    if is_weighted or beyond > 1:
        s.put("specular_weight", "specular", times(s.tree("specular"), beyond), 1.0)
    if is_weighted and not s.is_black(s.tree("specular")):
        s.note("specular", HEAD_ON, ROUGHLY)
    if (is_weighted or is_colored) and s.is_used("metallic", 0):
        s.note("specular", "it multiplies a metal's reflection as well")
    s.put("specular_ior", "ior", s.tree("ior"), 1.5)


def _highlight(s: Inputs) -> None:
    """The roughness, and how far and where its highlight is stretched: with b the ratio of both alphas, the one along
    the tangent is r^2 sqrt(2 / (1 + b^2)) in OpenPBR."""
    roughness, strength = s.tree("roughness"), s.tree("anisotropy_strength")
    if s.is_black(strength):
        s.put("specular_roughness", "roughness", roughness)
        return
    if not s.computes and any(s.fixed(each) is None for each in (roughness, strength)):
        s.note("anisotropy_strength", "under a texture, anisotropy is left out")
        s.put("specular_roughness", "roughness", roughness)
        return
    along, alpha = _stretches(roughness, strength)
    ratio = quotient(alpha, along)
    wider = times(times(along, along), times(added(constant(1.0), times(ratio, ratio)), 0.5))
    s.put("specular_roughness", "roughness", raised(wider, 0.25))
    s.put("specular_roughness_anisotropy", "anisotropy_strength", complement(ratio), 0.0)
    s.tangent("geometry_tangent", "tangent", math.degrees(s.number("anisotropy_rotation", 0.0)))


def _stretches(roughness: Tree, strength: Tree) -> tuple[Tree, Tree]:
    """Alpha along the tangent, which is mix(r^2, 1, strength^2), and across it, r^2."""
    alpha = clamped(raised(roughness, 2.0), 1e-4, 1.0)
    along = clamped(mixed(raised(roughness, 2.0), constant(1.0), times(strength, strength)), 1e-4, 1.0)
    return along, alpha


def _refracts(s: Inputs) -> None:
    """What the light meets that goes through: a body that has a thickness, else a thin wall."""
    distance, base = s.constant("attenuation_distance"), s.tree("base_color")
    is_body = s.is_used("thickness", 0)
    if is_body and distance is not None and distance[0] > 0:
        s.put("transmission_depth", "attenuation_distance", constant(distance[0]))
        s.put("transmission_color", "attenuation_color", s.tree("attenuation_color"), 1.0)
        if s.is_used("base_color", 1):
            s.note("base_color", "beside an attenuation it does not tint the light that passes")
    else:
        s.put("transmission_color", "base_color", base, 1.0)
    if not is_body:
        s.material["geometry_thin_walled"] = True
    elif s.is_used("dispersion", 0) and (share := s.number("dispersion", 0)) > 0:
        open_pbr.disperse(s, 1.0, SHOWN_ABBE / share)


def common(s: Inputs) -> None:
    """Read the inputs that glTF's older model of specular and glossiness has as well."""
    s.put("base_color", "base_color", s.tree("base_color"))
    s.put("metallic", "metallic", s.tree("metallic"), 0.0)
    s.put("roughness", "roughness", s.tree("roughness"))
    parts.emission(s, times(s.tree("emissive"), s.tree("emissive_strength")), "emissive")
    s.normal("normal_map", "normal")
    s.lose([parts.OCCLUSION])


def opacity(s: Inputs) -> None:
    mode = int(s.number("alpha_mode", OPAQUE))
    if mode == OPAQUE:
        return
    s.put("alpha", "alpha", s.tree("alpha"), 1.0)
    if mode == MASK:
        cutoff = s.constant("alpha_cutoff")
        if cutoff is not None and cutoff[0] > 1:
            s.material["alpha"] = 0.0
        else:
            s.put("alpha_cutoff", "alpha_cutoff", s.tree("alpha_cutoff"))


def _stretch(s: Inputs) -> None:
    """Ours is stretched both ways."""
    roughness, strength = s.tree("roughness"), s.tree("anisotropy_strength")
    if s.is_black(strength):
        return
    turn = times(s.tree("anisotropy_rotation"), 180 / math.pi)
    s.put("anisotropic_rotation", "anisotropy_rotation", turn, 0.0)
    if s.computes or not any(s.fixed(each) is None for each in (roughness, strength)):
        along, alpha = _stretches(roughness, strength)
        s.put("roughness", "roughness", raised(times(along, alpha), 0.25))
        parts.stretched(s, "anisotropy_strength", quotient(alpha, along))
        return
    detail = "under a texture, anisotropy stretches the highlight in both directions, not one"
    s.note("anisotropy_strength", detail, ROUGHLY)
    most = float(s.most("anisotropy_strength")[0])  # whose square times the texture is near to the square of both
    s.put("anisotropic", "anisotropy_strength", times(strength, most))


def _specular(s: Inputs) -> None:
    """F0 is that of the index times a weight and a colour, which beyond 1 needs a higher index."""
    color = s.tree("specular_color")
    beyond = max(1.0, *map(float, s.most("specular_color")))
    if s.is_given("specular_color"):
        s.put("specular_color", "specular_color", times(color, 1 / beyond), 1.0)
    strength, is_weighted = times(s.tree("specular"), beyond), s.is_used("specular", 1)
    if is_weighted and not s.is_black(strength) and not s.is_used("transmission", 0):
        s.note("specular", HEAD_ON, ROUGHLY)
    default = None if s.is_given("ior") else 1.5
    is_weighted = is_weighted or beyond > 1
    parts.dielectric(s, "ior", strength if is_weighted else None, "specular", "transmission", default)


def _inside(s: Inputs, is_body: bool) -> None:
    """Read the transmission: light goes through a body that has a thickness, else through a thin wall."""
    if not is_body:
        s.material["thin_walled"] = True
        return
    if s.is_used("dispersion", 0) and (share := s.number("dispersion", 0)) > 0:
        parts.abbe(s, SHOWN_ABBE / share)
    distance = s.constant("attenuation_distance")
    if distance is not None and distance[0] > 0:
        s.put("attenuation_distance", "attenuation_distance", constant(distance[0]))
        s.put("attenuation_color", "attenuation_color", s.tree("attenuation_color"))


def _through(s: Inputs, is_body: bool) -> None:
    """Diffuse light that goes through a thin wall."""
    name = "diffuse_transmission"
    if not s.is_given(name) or not s.is_used(name, 0):
        return
    if is_body and "transmission" in s.material:
        s.note(name, "beside a body of glass diffuse transmission is left out")
        return
    if is_body:
        s.note(name, "light does not travel inside the body; its surfaces are thin walls")
    s.material["thin_walled"] = True
    s.put(name, name, s.tree(name))
    s.put(f"{name}_color", f"{name}_color", s.tree(f"{name}_color"))
