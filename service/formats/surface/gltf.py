"""`gltf_pbr` as `principled` and back: the metallic-roughness model of glTF 2.0 with its ratified extensions.

glTF's own files give two inputs that MaterialX' node lacks: the share of diffuse light that goes through a surface,
and its colour.
"""

from __future__ import annotations

import math

import numpy as np

from service.document.material import PrincipledMaterial
from service.document.texture import ColorTexture, ScalarTexture
from service.formats.surface import outputs, parts
from service.formats.surface.inputs import TANGENT, Inputs
from service.formats.surface.outputs import Output, Outputs, Tell, is_used, plain, scaled
from service.formats.surface.plain import Default
from service.formats.surface.trees import clamped, constant, mixed, quotient, raised, times

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


def gltf_pbr(s: Inputs) -> None:
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
    if s.is_given("tangent"):
        s.note("tangent", TANGENT)


def common(s: Inputs) -> None:
    """What glTF's older model of specular and glossiness has as well."""
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
    """Alpha along the tangent is mix(r^2, 1, strength^2), across it r^2; ours is stretched both ways."""
    roughness, strength = s.tree("roughness"), s.tree("anisotropy_strength")
    if s.is_black(strength):
        return
    turn = times(s.tree("anisotropy_rotation"), 180 / math.pi)
    s.put("anisotropic_rotation", "anisotropy_rotation", turn, 0.0)
    if s.computes or not any(s.fixed(each) is None for each in (roughness, strength)):
        alpha = clamped(raised(roughness, 2.0), 1e-4, 1.0)
        along = clamped(mixed(raised(roughness, 2.0), constant(1.0), times(strength, strength)), 1e-4, 1.0)
        s.put("roughness", "roughness", raised(times(along, alpha), 0.25))
        parts.stretched(s, "anisotropy_strength", quotient(alpha, along))
        return
    s.note("anisotropy_strength", "under a texture, anisotropy stretches the highlight in both directions, not one")
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
        detail = "the weight lowers the reflection seen head-on only; at grazing angles it stays as it is"
        s.note("specular", detail)
    default = None if s.is_given("ior") else 1.5
    is_weighted = is_weighted or beyond > 1
    parts.dielectric(s, "ior", strength if is_weighted else None, "specular", "transmission", default)


def _inside(s: Inputs, is_body: bool) -> None:
    """What passes a surface goes through a body that has a thickness, else through a thin wall."""
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


# What `written` reads of a material; all others are lost.
WRITTEN = {
    "base_color", "metallic", "roughness", "alpha", "alpha_cutoff", "emission", "normal_map", "specular",
    "specular_color", "specular_tint", "ior", "transmission", "abbe", "attenuation_color", "attenuation_distance",
    "sheen", "sheen_color", "sheen_tint", "sheen_roughness", "clearcoat", "clearcoat_gloss", "clearcoat_roughness",
    "clearcoat_normal_map", "anisotropic", "anisotropic_rotation", "thin_walled", "diffuse_transmission",
    "diffuse_transmission_color", "film_thickness", "film_ior",
}  # fmt: skip


def written(m: PrincipledMaterial, tell: Tell, thickness: float = 1.0, film: Output | None = None) -> Outputs:
    """`thickness` (m) is that of a body, by which rasterisers bend what is behind it; `film` is the weight of a film
    of models that have one."""
    made = {
        "base_color": Output(m.base_color, "base_color"), "metallic": Output(m.metallic, "metallic"),
        "roughness": Output(m.roughness, "roughness"),
    }  # fmt: skip
    if m.normal_map is not None:
        made["normal"] = Output(m.normal_map, "normal_map")
    if is_used(m.emission):
        made["emissive"] = Output(m.emission, "emission")
    if m.alpha != 1 or m.alpha_cutoff is not None:
        made |= _alpha(m, tell)
    if m.metallic != 1:  # a metal shows nothing of these
        made |= _dielectric(m, tell)
        if is_used(m.transmission):
            made |= _transmission(m, tell, thickness)
        if is_used(m.diffuse_transmission):
            made["diffuse_transmission"] = Output(m.diffuse_transmission, "diffuse_transmission")
            through = Output(m.diffuse_transmission_color, "diffuse_transmission_color")
            made["diffuse_transmission_color"] = made["base_color"] if through.value is None else through
        if is_used(m.sheen):
            made |= _sheen(m, tell)
    if is_used(m.clearcoat):
        made["clearcoat"] = Output(m.clearcoat, "clearcoat")
        made["clearcoat_roughness"] = outputs.coat_roughness(m, tell)
        if m.clearcoat_roughness is None and not isinstance(m.clearcoat_gloss, ScalarTexture):
            tell("clearcoat_gloss", "the coat's gloss is written as the roughness that it stands for")
        if m.clearcoat_normal_map is not None:
            made["clearcoat_normal"] = Output(m.clearcoat_normal_map, "clearcoat_normal_map")
    if is_used(m.anisotropic):
        made |= _stretched(m, tell)
    if is_used(m.film_thickness):
        made["iridescence"] = film or Output(1.0, "film_thickness")
        made["iridescence_thickness"] = Output(m.film_thickness, "film_thickness")
        made["iridescence_ior"] = Output(min(max(outputs.number(m.film_ior, "film_ior", tell), 1.0), 4.0), "film_ior")
    return made


def _alpha(m: PrincipledMaterial, tell: Tell) -> Outputs:
    made = {"alpha": Output(m.alpha, "alpha"), "alpha_mode": Output(BLEND, "alpha")}
    if isinstance(m.alpha_cutoff, ScalarTexture):
        tell("alpha_cutoff", "a texture of thresholds has no place in glTF; alpha is blended")
    elif m.alpha_cutoff is not None:
        made["alpha_mode"] = Output(MASK, "alpha_cutoff")
        made["alpha_cutoff"] = Output(m.alpha_cutoff, "alpha_cutoff")
    return made


def _dielectric(m: PrincipledMaterial, tell: Tell) -> Outputs:
    made: Outputs = {}
    color = outputs.specular_color(m, tell)
    if color != m.specular_color:
        tell("specular_tint", "the tint is written as a specular colour")
    if color != WHITE:
        made["specular_color"] = Output(color, "specular_color")
    ior, weight = outputs.index(m)
    if weight is not None:
        made["specular"] = weight
    elif m.ior is None and m.specular != PrincipledMaterial.model_fields["specular"].default:
        tell("specular", "it is written as the index of refraction that it stands for")
    elif m.ior is None:
        return made
    made["ior"] = Output(min(max(outputs.number(ior.value, "ior", tell), 1.0), 4.0), ior.parameter)
    return made


def _transmission(m: PrincipledMaterial, tell: Tell, thickness: float) -> Outputs:
    made = {"transmission": Output(m.transmission, "transmission")}
    if m.is_thin:  # without a volume it is that in glTF, too
        return made
    made["thickness"] = Output(thickness, "transmission")
    if m.attenuation_distance is not None:
        distance = outputs.number(m.attenuation_distance, "attenuation_distance", tell)
        made["attenuation_distance"] = Output(distance, "attenuation_distance")
        if isinstance(m.attenuation_color, ColorTexture):
            tell("attenuation_color", "a texture of it is not written; its factor is")
        shade = tuple(min(each, 1.0) for each in plain(m.attenuation_color))
        made["attenuation_color"] = Output(shade, "attenuation_color")
    if m.abbe is not None:
        made["dispersion"] = Output(SHOWN_ABBE / max(m.abbe, parts.LEAST_ABBE), "abbe")
    return made


def _sheen(m: PrincipledMaterial, tell: Tell) -> Outputs:
    """The amount goes into the colour."""
    amount, color = outputs.number(m.sheen, "sheen", tell), outputs.sheen_color(m, tell)
    if m.sheen_color is None and color != WHITE:
        tell("sheen_tint", "the tint is written as a sheen colour")
    factor = tuple(min(amount * each, 1.0) for each in plain(color))
    if any(np.float32(amount) * np.float32(a) != np.float32(b) for a, b in zip(plain(color), factor, strict=True)):
        tell("sheen", "the amount is written into the sheen's colour, which rounds it")
    textured = isinstance(color, ColorTexture)
    value = color.model_copy(update={"factor": factor}) if textured else factor
    return {
        "sheen_color": Output(value, "sheen_color"),
        "sheen_roughness": Output(m.sheen_roughness, "sheen_roughness"),
    }


def _stretched(m: PrincipledMaterial, tell: Tell) -> Outputs:
    """Ours stretches both ways, alpha_t = alpha / aspect and alpha_b = alpha aspect; glTF's along the tangent only,
    alpha_t = mix(r^2, 1, strength^2) and alpha_b = r^2: its roughness is less than ours."""
    amount, turn, made = m.anisotropic, m.anisotropic_rotation, Outputs()
    if isinstance(turn, ScalarTexture):
        tell("anisotropic_rotation", "a texture of directions is left out")
    elif turn:
        made["anisotropy_rotation"] = Output(math.radians(turn), "anisotropic_rotation")
    if isinstance(amount, ScalarTexture) and m.normal_map is None:  # else glTF asks for tangents in the mesh
        tell("anisotropic", "without a normal map its texture has no place in glTF; its factor is written")
        amount = min(amount.factor, 1.0)
    if isinstance(amount, ScalarTexture) or isinstance(m.roughness, ScalarTexture):
        tell("anisotropic", "under a texture, glTF stretches the highlight along the tangent only")
        strength = scaled(amount, 1 / math.sqrt(plain(amount)))
    else:
        aspect = math.sqrt(1 - parts.STRETCH * amount)
        along, across = m.roughness**2 / aspect, m.roughness**2 * aspect
        if along > 1:
            tell("anisotropic", "glTF's highlights are not as wide; this one is narrowed")
        strength = min(math.sqrt(max(min(along, 1.0) - across, 0.0) / (1 - across)), 1.0) if across < 1 else 0.0
        made["roughness"] = Output(math.sqrt(across), "roughness")
    return made | {"anisotropy_strength": Output(strength, "anisotropic")}
