"""`principled` as standard_surface and `openpbr` as open_pbr_surface: the inputs of each, which
`service/formats/read/materialx/models.py` reads again."""

from __future__ import annotations

import math
from typing import Any

from service.document.material import OpenpbrMaterial, PrincipledMaterial
from service.document.material.principled import index_of_specular, roughness_of_gloss
from service.document.texture import ColorTexture, NormalTexture, ScalarTexture
from service.exports.materialx.graph import WHITE, Graph, Value, color, number, switch

Inputs = dict[str, Value]
STRETCH = 0.9  # of principled's anisotropy: alpha across the tangent is 1 - 0.9 a times that along it
OWN = ("type", "emission_sides", "height")  # of our documents, not of the model


def standard_surface(m: PrincipledMaterial, graph: Graph) -> Inputs:
    made: Inputs = {"base": number(1.0), "base_color": graph.color(m.base_color, "base_color")}
    if _is_used(m.metallic):
        made["metalness"] = graph.number(m.metallic, "metallic")
    if m.metallic != 1:
        _dielectric(m, graph, made)
    if _is_used(m.transmission):
        _transmission(m, graph, made)
    if m.is_thin:
        made["thin_walled"] = switch(True)
    if _is_used(m.diffuse_transmission):  # what the model scatters below a thin wall leaves on the other side
        made["subsurface"] = graph.number(m.diffuse_transmission, "diffuse_transmission")
        through = m.diffuse_transmission_color
        made["subsurface_color"] = (
            made["base_color"] if through is None else graph.color(through, "diffuse_transmission_color")
        )
    if _is_used(m.subsurface) and m.subsurface_radius is not None and not m.is_thin:
        made["subsurface"] = graph.number(m.subsurface, "subsurface")
        made |= {"subsurface_color": made["base_color"], "subsurface_radius": color(m.subsurface_radius)}
    made["specular_roughness"] = graph.number(m.roughness, "roughness")
    if _is_used(m.anisotropic):
        made["specular_anisotropy"] = _scaled(graph, m.anisotropic, "anisotropic", STRETCH)
        if isinstance(m.anisotropic_rotation, ScalarTexture):
            turned = m.anisotropic_rotation.model_copy(update={"factor": m.anisotropic_rotation.factor / 360})
            made["specular_rotation"] = graph.number(turned, "anisotropic_rotation")
        elif m.anisotropic_rotation:
            made["specular_rotation"] = number(m.anisotropic_rotation / 360)
    if _is_used(m.sheen):
        made |= _sheen(m, graph)
    if _is_used(m.clearcoat):
        made |= _coat(m, graph)
    if _is_used(m.film_thickness):
        thickness = graph.number(m.film_thickness, "film_thickness")
        made |= {"thin_film_thickness": thickness, "thin_film_IOR": graph.number(m.film_ior, "film_ior")}
    if _shines(m):
        made |= {"emission": number(1.0), "emission_color": graph.color(m.emission, "emission")}
    if m.alpha != 1:
        made["opacity"] = graph.converted(graph.number(m.alpha, "alpha"), "color3")
    map = graph.normal(m.normal_map, "normal_map")
    _tell_others(m, graph)
    return made | ({"normal": map} if map is not None else {})


def open_pbr_surface(m: OpenpbrMaterial, graph: Graph) -> Inputs:
    """What the document says, under the same names."""
    made: Inputs = {}
    for name in type(m).model_fields:
        value = getattr(m, name)
        if name not in m.model_fields_set or value is None or name in OWN:
            continue
        if name in ("geometry_tangent", "geometry_coat_tangent"):
            made[name] = graph.tangent(math.degrees(math.atan2(value[1], value[0])))
        elif isinstance(value, bool):
            made[name] = switch(value)
        elif isinstance(value, NormalTexture):
            map = graph.normal(value, name)
            made |= {name: map} if map is not None else {}
        elif isinstance(value, tuple | ColorTexture):
            made[name] = graph.color(value, name)
        else:
            made[name] = graph.number(value, name)
    _tell_common(m, graph, m.emission_luminance > 0)
    return made


def _transmission(m: PrincipledMaterial, graph: Graph, made: Inputs) -> None:
    made["transmission"] = graph.number(m.transmission, "transmission")
    if m.abbe is not None:
        made["transmission_dispersion"] = number(m.abbe)
    if m.attenuation_distance is None or m.is_thin:
        made["transmission_color"] = made["base_color"]
        return
    if isinstance(m.attenuation_distance, ScalarTexture):
        graph.tell("attenuation_distance", "a texture of it is not written; its factor is")
    made["transmission_depth"] = number(_plain(m.attenuation_distance))
    made["transmission_color"] = graph.color(m.attenuation_color, "attenuation_color")
    if m.base_color != WHITE:
        graph.tell("base_color", "what it tints of the light that passes is not written beside an attenuation")


def _dielectric(m: PrincipledMaterial, graph: Graph, made: Inputs) -> None:
    if m.ior is not None:
        made["specular_IOR"] = graph.number(m.ior, "ior")
    elif isinstance(m.specular, ScalarTexture):  # the reflectance is 0.08 of it
        made["specular_IOR"] = number(index_of_specular(1.0))
        made["specular"] = graph.number(m.specular, "specular")
    else:
        made["specular_IOR"] = number(index_of_specular(m.specular))
    tint: Any = m.specular_color
    if _is_used(m.specular_tint):
        base, others = m.base_color, (m.specular_tint, tint)
        if isinstance(base, ColorTexture) or any(isinstance(each, ColorTexture | ScalarTexture) for each in others):
            graph.tell("specular_tint", "it is not written where it, or what it tints, is a texture")
        else:
            own = _tinted(base, _plain(m.specular_tint))
            tint = tuple(a * b for a, b in zip(own, tint, strict=True))
    if tint != WHITE:
        made["specular_color"] = graph.color(tint, "specular_color")
        if _is_used(m.metallic):
            graph.tell("specular_color", "of what is a metal it tints the edges in the file")


def _sheen(m: PrincipledMaterial, graph: Graph) -> Inputs:
    roughness = graph.number(m.sheen_roughness, "sheen_roughness")
    made = {"sheen": graph.number(m.sheen, "sheen"), "sheen_roughness": roughness}
    if m.sheen_color is not None:
        return made | {"sheen_color": graph.color(m.sheen_color, "sheen_color")}
    if isinstance(m.sheen_tint, ScalarTexture) or (isinstance(m.base_color, ColorTexture) and m.sheen_tint):
        graph.tell("sheen_tint", "it is not written where it, or what it tints, is a texture")
        return made
    tint = WHITE if isinstance(m.base_color, ColorTexture) else _tinted(m.base_color, m.sheen_tint)
    return made | {"sheen_color": color(tint)}


def _coat(m: PrincipledMaterial, graph: Graph) -> Inputs:
    made = {"coat": graph.number(m.clearcoat, "clearcoat")}
    if m.clearcoat_roughness is not None:
        made["coat_roughness"] = graph.number(m.clearcoat_roughness, "clearcoat_roughness")
    else:
        if isinstance(m.clearcoat_gloss, ScalarTexture):
            graph.tell("clearcoat_gloss", "a texture of it is not written; its factor is")
        made["coat_roughness"] = number(roughness_of_gloss(_plain(m.clearcoat_gloss)))
    map = graph.normal(m.clearcoat_normal_map, "clearcoat_normal_map")
    return made | ({"coat_normal": map} if map is not None else {})


def _tell_others(m: PrincipledMaterial, graph: Graph) -> None:
    if _is_used(m.subsurface) and (m.subsurface_radius is None or m.is_thin):
        graph.tell("subsurface", "a flatter diffuse reflection is not written")
    if m.alpha_cutoff is not None:
        graph.tell("alpha_cutoff", "the model has no cut-off; the opacity is written without it")
    if m.conductor_eta is not None:
        for name in ("conductor_eta", "conductor_k"):
            graph.tell(name, "the model has no index of metals; the base colour is written")
    _tell_common(m, graph, _shines(m))


def _tell_common(m: PrincipledMaterial | OpenpbrMaterial, graph: Graph, shines: bool) -> None:
    if shines and m.emission_sides == "both":
        graph.tell("emission_sides", "the file does not say on which sides a surface shines")
    if m.height is not None:
        graph.tell("height", "heights are not written")


def _tinted(base: tuple[float, ...], share: float) -> tuple[float, ...]:
    """White tinted to a colour's hue by a share, as bsdf/models/principled.glsl has it."""
    most = max(base)
    return tuple(1 + share * (each / most - 1) for each in base) if most > 0 else WHITE


def _shines(m: PrincipledMaterial) -> bool:
    return max(m.emission.factor if isinstance(m.emission, ColorTexture) else m.emission) > 0


def _is_used(value: Any) -> bool:
    return bool(_plain(value) > 0)


def _plain(value: Any) -> float:
    """A number, or the factor of its texture."""
    return float(value.factor if isinstance(value, ScalarTexture) else value)


def _scaled(graph: Graph, value: Any, parameter: str, factor: float) -> Value:
    if isinstance(value, ScalarTexture):
        return graph.number(value.model_copy(update={"factor": value.factor * factor}), parameter)
    return number(value * factor)
