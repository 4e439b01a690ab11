"""A material of the document as the inputs of a model: the inverse of what the models' files read.

It stands apart from them as a process that parses needs no document.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from service.document.material import OpenpbrMaterial, PrincipledMaterial
from service.document.material.principled import index_of_specular, roughness_of_gloss
from service.document.texture import ColorTexture, ScalarTexture
from service.formats.surface import gltf, parts
from service.formats.surface.open_pbr import DEFAULTS

WHITE = (1.0, 1.0, 1.0)
Tell = Callable[[str, str], None]  # is called with each loss: the parameter, and what happens to it


class Output(NamedTuple):
    """The value of an input: a number, a switch, a colour or a texture; and the parameter that it comes from."""

    value: Any
    parameter: str


Outputs = dict[str, Output]


def plain(value: Any) -> Any:
    """A number or a colour, or the factor of its texture."""
    return value.factor if isinstance(value, ScalarTexture | ColorTexture) else value


def is_used(value: Any) -> bool:
    found = plain(value)
    return bool(max(found) > 0 if isinstance(found, tuple) else found > 0)


def open_pbr_surface(m: OpenpbrMaterial) -> Outputs:
    """What the document says."""
    said = {name: getattr(m, name) for name in DEFAULTS if name in m.model_fields_set}
    return {name: Output(value, name) for name, value in said.items() if value is not None}


def standard_surface(m: PrincipledMaterial, tell: Tell) -> Outputs:
    base = Output(m.base_color, "base_color")
    made: Outputs = {"base": Output(1.0, "base_color"), "base_color": base}
    if is_used(m.metallic):
        made["metalness"] = Output(m.metallic, "metallic")
    if m.metallic != 1:
        made |= _standard_dielectric(m, tell)
    if is_used(m.transmission):
        made |= _standard_transmission(m, tell)
    if m.is_thin:
        made["thin_walled"] = Output(True, "thin_walled")
    if is_used(m.diffuse_transmission):  # what the model scatters below a thin wall leaves on the other side
        made["subsurface"] = Output(m.diffuse_transmission, "diffuse_transmission")
        through = Output(m.diffuse_transmission_color, "diffuse_transmission_color")
        made["subsurface_color"] = base if through.value is None else through
    if is_used(m.subsurface) and m.subsurface_radius is not None and not m.is_thin:
        made["subsurface"] = Output(m.subsurface, "subsurface")
        made |= {"subsurface_color": base, "subsurface_radius": Output(m.subsurface_radius, "subsurface_radius")}
    elif is_used(m.subsurface):
        tell("subsurface", "a flatter diffuse reflection is not written")
    made["specular_roughness"] = Output(m.roughness, "roughness")
    if is_used(m.anisotropic):
        made["specular_anisotropy"] = Output(_scaled(m.anisotropic, parts.STRETCH), "anisotropic")
        if plain(m.anisotropic_rotation):
            made["specular_rotation"] = Output(_scaled(m.anisotropic_rotation, 1 / 360), "anisotropic_rotation")
    if is_used(m.sheen):
        made["sheen"], made["sheen_roughness"] = (
            Output(m.sheen, "sheen"),
            Output(m.sheen_roughness, "sheen_roughness"),
        )
        made["sheen_color"] = Output(_sheen_color(m, tell), "sheen_color")
    if is_used(m.clearcoat):
        made["coat"], made["coat_roughness"] = Output(m.clearcoat, "clearcoat"), _coat_roughness(m, tell)
        if m.clearcoat_normal_map is not None:
            made["coat_normal"] = Output(m.clearcoat_normal_map, "clearcoat_normal_map")
    if is_used(m.film_thickness):
        made["thin_film_thickness"] = Output(m.film_thickness, "film_thickness")
        made["thin_film_IOR"] = Output(m.film_ior, "film_ior")
    if is_used(m.emission):
        made |= {"emission": Output(1.0, "emission"), "emission_color": Output(m.emission, "emission")}
    if m.alpha != 1:
        made["opacity"] = Output(m.alpha, "alpha")
    if m.normal_map is not None:
        made["normal"] = Output(m.normal_map, "normal_map")
    if m.alpha_cutoff is not None:
        tell("alpha_cutoff", "the model has no cut-off; the opacity is written without it")
    if m.conductor_eta is not None:
        for name in ("conductor_eta", "conductor_k"):
            tell(name, "the model has no index of metals; the base colour is written")
    return made


def _standard_transmission(m: PrincipledMaterial, tell: Tell) -> Outputs:
    made = {"transmission": Output(m.transmission, "transmission")}
    if m.abbe is not None:
        made["transmission_dispersion"] = Output(m.abbe, "abbe")
    if m.attenuation_distance is None or m.is_thin:
        return made | {"transmission_color": Output(m.base_color, "base_color")}
    distance = _number(m.attenuation_distance, "attenuation_distance", tell)
    made["transmission_depth"] = Output(distance, "attenuation_distance")
    if m.base_color != WHITE:
        tell("base_color", "what it tints of the light that passes is not written beside an attenuation")
    return made | {"transmission_color": Output(m.attenuation_color, "attenuation_color")}


def _standard_dielectric(m: PrincipledMaterial, tell: Tell) -> Outputs:
    ior, weight = _index(m)
    made = {"specular_IOR": ior} | ({} if weight is None else {"specular": weight})
    color = _specular_color(m, tell)
    if color != WHITE:
        made["specular_color"] = Output(color, "specular_color")
        if is_used(m.metallic):
            tell("specular_color", "of what is a metal it tints the edges in the file")
    return made


# What `gltf_pbr` reads of a material; all others are lost.
GLTF_PBR = {
    "base_color", "metallic", "roughness", "alpha", "alpha_cutoff", "emission", "normal_map", "specular",
    "specular_color", "specular_tint", "ior", "transmission", "abbe", "attenuation_color", "attenuation_distance",
    "sheen", "sheen_color", "sheen_tint", "sheen_roughness", "clearcoat", "clearcoat_gloss", "clearcoat_roughness",
    "clearcoat_normal_map", "anisotropic", "anisotropic_rotation", "thin_walled", "diffuse_transmission",
    "diffuse_transmission_color", "film_thickness", "film_ior",
}  # fmt: skip


def gltf_pbr(m: PrincipledMaterial, tell: Tell, thickness: float = 1.0, film: Output | None = None) -> Outputs:
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
        made |= _gltf_alpha(m, tell)
    if m.metallic != 1:  # a metal shows nothing of these
        made |= _gltf_dielectric(m, tell)
        if is_used(m.transmission):
            made |= _gltf_transmission(m, tell, thickness)
        if is_used(m.diffuse_transmission):
            made["diffuse_transmission"] = Output(m.diffuse_transmission, "diffuse_transmission")
            through = Output(m.diffuse_transmission_color, "diffuse_transmission_color")
            made["diffuse_transmission_color"] = made["base_color"] if through.value is None else through
        if is_used(m.sheen):
            made |= _gltf_sheen(m, tell)
    if is_used(m.clearcoat):
        made["clearcoat"] = Output(m.clearcoat, "clearcoat")
        made["clearcoat_roughness"] = _coat_roughness(m, tell)
        if m.clearcoat_roughness is None and not isinstance(m.clearcoat_gloss, ScalarTexture):
            tell("clearcoat_gloss", "the coat's gloss is written as the roughness that it stands for")
        if m.clearcoat_normal_map is not None:
            made["clearcoat_normal"] = Output(m.clearcoat_normal_map, "clearcoat_normal_map")
    if is_used(m.anisotropic):
        made |= _gltf_stretched(m, tell)
    if is_used(m.film_thickness):
        made["iridescence"] = film or Output(1.0, "film_thickness")
        made["iridescence_thickness"] = Output(m.film_thickness, "film_thickness")
        made["iridescence_ior"] = Output(min(max(_number(m.film_ior, "film_ior", tell), 1.0), 4.0), "film_ior")
    return made


def _gltf_alpha(m: PrincipledMaterial, tell: Tell) -> Outputs:
    made = {"alpha": Output(m.alpha, "alpha"), "alpha_mode": Output(gltf.BLEND, "alpha")}
    if isinstance(m.alpha_cutoff, ScalarTexture):
        tell("alpha_cutoff", "a texture of thresholds has no place in glTF; alpha is blended")
    elif m.alpha_cutoff is not None:
        made["alpha_mode"] = Output(gltf.MASK, "alpha_cutoff")
        made["alpha_cutoff"] = Output(m.alpha_cutoff, "alpha_cutoff")
    return made


def _gltf_dielectric(m: PrincipledMaterial, tell: Tell) -> Outputs:
    made: Outputs = {}
    color = _specular_color(m, tell)
    if color != m.specular_color:
        tell("specular_tint", "the tint is written as a specular colour")
    if color != WHITE:
        made["specular_color"] = Output(color, "specular_color")
    ior, weight = _index(m)
    if weight is not None:
        made["specular"] = weight
    elif m.ior is None and m.specular != PrincipledMaterial.model_fields["specular"].default:
        tell("specular", "it is written as the index of refraction that it stands for")
    elif m.ior is None:
        return made
    made["ior"] = Output(min(max(_number(ior.value, "ior", tell), 1.0), 4.0), ior.parameter)
    return made


def _gltf_transmission(m: PrincipledMaterial, tell: Tell, thickness: float) -> Outputs:
    made = {"transmission": Output(m.transmission, "transmission")}
    if m.is_thin:  # without a volume it is that in glTF, too
        return made
    made["thickness"] = Output(thickness, "transmission")
    if m.attenuation_distance is not None:
        distance = _number(m.attenuation_distance, "attenuation_distance", tell)
        made["attenuation_distance"] = Output(distance, "attenuation_distance")
        if isinstance(m.attenuation_color, ColorTexture):
            tell("attenuation_color", "a texture of it is not written; its factor is")
        shade = tuple(min(each, 1.0) for each in plain(m.attenuation_color))
        made["attenuation_color"] = Output(shade, "attenuation_color")
    if m.abbe is not None:
        made["dispersion"] = Output(gltf.SHOWN_ABBE / max(m.abbe, parts.LEAST_ABBE), "abbe")
    return made


def _gltf_sheen(m: PrincipledMaterial, tell: Tell) -> Outputs:
    """The amount goes into the colour."""
    amount, color = _number(m.sheen, "sheen", tell), _sheen_color(m, tell)
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


def _gltf_stretched(m: PrincipledMaterial, tell: Tell) -> Outputs:
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
        strength = _scaled(amount, 1 / math.sqrt(plain(amount)))
    else:
        aspect = math.sqrt(1 - parts.STRETCH * amount)
        along, across = m.roughness**2 / aspect, m.roughness**2 * aspect
        if along > 1:
            tell("anisotropic", "glTF's highlights are not as wide; this one is narrowed")
        strength = min(math.sqrt(max(min(along, 1.0) - across, 0.0) / (1 - across)), 1.0) if across < 1 else 0.0
        made["roughness"] = Output(math.sqrt(across), "roughness")
    return made | {"anisotropy_strength": Output(strength, "anisotropic")}


def _scaled(value: Any, factor: float) -> Any:
    """A number, or its texture, times a factor."""
    if isinstance(value, ScalarTexture):
        return value.model_copy(update={"factor": value.factor * factor})
    return value * factor


def _number(value: Any, parameter: str, tell: Tell) -> float:
    """The number of an input that no format has a texture for."""
    if isinstance(value, ScalarTexture):
        tell(parameter, "a texture of it is not written; its factor is")
    return float(plain(value))


# Parameters of `principled` that stand for others.


def _index(m: PrincipledMaterial) -> tuple[Output, Output | None]:
    """The index of refraction, and the weight of its reflection where that is a texture."""
    if m.ior is not None:
        return Output(m.ior, "ior"), None
    if isinstance(m.specular, ScalarTexture):
        whole = m.specular.model_copy(update={"factor": 1.0})
        return Output(index_of_specular(min(m.specular.factor, 1.0)), "specular"), Output(whole, "specular")
    return Output(index_of_specular(m.specular), "specular"), None


def _specular_color(m: PrincipledMaterial, tell: Tell) -> Any:
    """The colour of the reflection, with the hue that its tint takes from the base."""
    tint = _tinted(m, m.specular_tint, "specular_tint", tell)
    if tint == WHITE:
        return m.specular_color
    by = tuple(a * b for a, b in zip(plain(m.specular_color), tint, strict=True))
    if isinstance(m.specular_color, ColorTexture):
        return m.specular_color.model_copy(update={"factor": by})
    return by


def _sheen_color(m: PrincipledMaterial, tell: Tell) -> Any:
    return _tinted(m, m.sheen_tint, "sheen_tint", tell) if m.sheen_color is None else m.sheen_color


def _coat_roughness(m: PrincipledMaterial, tell: Tell) -> Output:
    if m.clearcoat_roughness is not None:
        return Output(m.clearcoat_roughness, "clearcoat_roughness")
    gloss = _number(m.clearcoat_gloss, "clearcoat_gloss", tell)
    return Output(roughness_of_gloss(min(gloss, 1.0)), "clearcoat_gloss")


def _tinted(m: PrincipledMaterial, share: Any, parameter: str, tell: Tell) -> tuple[float, ...]:
    """White tinted to the base's hue by a share, as bsdf/models/principled.glsl has it."""
    if not is_used(share):
        return WHITE
    if isinstance(share, ScalarTexture) or isinstance(m.base_color, ColorTexture):
        tell(parameter, "it is not written where it, or what it tints, is a texture")
        return WHITE
    most = max(m.base_color)
    return tuple(1 + share * (each / most - 1) for each in m.base_color) if most > 0 else WHITE
