"""`principled` as standard_surface and as open_pbr_surface: the inputs of each, which
`service/assets/materialx/models.py` reads again."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from service.exports.materialx.graph import WHITE, Graph, Value, color, number
from service.scene.material import PrincipledMaterial
from service.scene.material.principled import index_of_specular, roughness_of_gloss
from service.scene.texture import ColorTexture, ScalarTexture

Inputs = dict[str, Value]
STRETCH = 0.9  # of principled's anisotropy: alpha across the tangent is 1 - 0.9 a times that along it
LUMENS = 683.0  # of a watt


def standard_surface(m: PrincipledMaterial, graph: Graph) -> Inputs:
    made = _base(m, graph, {
        "base": "base", "metalness": "metalness", "ior": "specular_IOR", "weight": "specular",
        "transmission": "transmission",
    })  # fmt: skip
    made["specular_roughness"] = graph.number(m.roughness, "roughness")
    if _is_used(m.anisotropic):
        made["specular_anisotropy"] = _scaled(graph, m.anisotropic, "anisotropic", STRETCH)
        if isinstance(m.anisotropic_rotation, ScalarTexture):
            turned = m.anisotropic_rotation.model_copy(update={"factor": m.anisotropic_rotation.factor / 360})
            made["specular_rotation"] = graph.number(turned, "anisotropic_rotation")
        elif m.anisotropic_rotation:
            made["specular_rotation"] = number(m.anisotropic_rotation / 360)
    if _is_used(m.sheen):
        made |= _sheen(m, graph, "sheen", "sheen_color", "sheen_roughness")
    if _is_used(m.clearcoat):
        made |= _coat(m, graph, "coat", "coat_roughness", "coat_normal")
    if _shines(m):
        made |= {"emission": number(1.0), "emission_color": graph.color(m.emission, "emission")}
    if m.alpha != 1:
        made["opacity"] = graph.converted(graph.number(m.alpha, "alpha"), "color3")
    return made | _normal(m, graph, "normal")


def open_pbr_surface(m: PrincipledMaterial, graph: Graph) -> Inputs:
    made = _base(m, graph, {
        "base": "base_weight", "metalness": "base_metalness", "ior": "specular_ior", "weight": "specular_weight",
        "transmission": "transmission_weight",
    })  # fmt: skip
    roughness: Any = m.roughness
    if _is_used(m.anisotropic):
        made["specular_roughness_anisotropy"] = _scaled(graph, m.anisotropic, "anisotropic", STRETCH)
        if isinstance(m.anisotropic, ScalarTexture):
            graph.tell("roughness", "under a texture of anisotropy the highlight is wider than here")
        else:
            ratio = 1 - STRETCH * m.anisotropic
            wider = (
                2 * ratio / (1 + ratio * ratio)
            ) ** -0.25  # OpenPBR 1.1: alpha along is r^2 sqrt(2 / (1 + ratio^2))
            roughness = _product(roughness, wider)
        if m.anisotropic_rotation != 0:
            graph.tell(
                "anisotropic_rotation", "open_pbr_surface turns the stretch by a tangent only; it is not turned"
            )
    made["specular_roughness"] = graph.number(roughness, "roughness")
    if _is_used(m.sheen):
        made |= _sheen(m, graph, "fuzz_weight", "fuzz_color", "fuzz_roughness")
    if _is_used(m.clearcoat):
        made |= _coat(m, graph, "coat_weight", "coat_roughness", "geometry_coat_normal")
        made |= {"coat_ior": number(1.5), "coat_darkening": number(0.0)}
    if _shines(m):
        factor = m.emission.factor if isinstance(m.emission, ColorTexture) else m.emission
        most = max(factor)
        share = tuple(each / most for each in factor)
        light = m.emission.model_copy(update={"factor": share}) if isinstance(m.emission, ColorTexture) else share
        made |= {"emission_luminance": number(LUMENS * most), "emission_color": graph.color(light, "emission")}
    if m.alpha != 1:
        made["geometry_opacity"] = graph.number(m.alpha, "alpha")
    return made | _normal(m, graph, "geometry_normal")


def _base(m: PrincipledMaterial, graph: Graph, names: dict[str, str]) -> Inputs:
    """What both models mean by the same words, but for their names."""
    made: Inputs = {names["base"]: number(1.0), "base_color": graph.color(m.base_color, "base_color")}
    if _is_used(m.metallic):
        made[names["metalness"]] = graph.number(m.metallic, "metallic")
    if m.metallic != 1:
        _dielectric(m, graph, made, names)
    if _is_used(m.transmission):
        made[names["transmission"]] = graph.number(m.transmission, "transmission")
        if m.attenuation_distance is None:
            made["transmission_color"] = made["base_color"]
        else:
            if isinstance(m.attenuation_distance, ScalarTexture):
                graph.tell("attenuation_distance", "a texture of it is not written; its factor is")
            made["transmission_depth"] = number(_plain(m.attenuation_distance))
            made["transmission_color"] = graph.color(m.attenuation_color, "attenuation_color")
            if m.base_color != WHITE:
                graph.tell(
                    "base_color", "what it tints of the light that passes is not written beside an attenuation"
                )
    _tell_others(m, graph)
    return made


def _dielectric(m: PrincipledMaterial, graph: Graph, made: Inputs, names: dict[str, str]) -> None:
    if m.ior is not None:
        made[names["ior"]] = graph.number(m.ior, "ior")
    elif isinstance(m.specular, ScalarTexture):  # the reflectance is 0.08 of it
        made[names["ior"]] = number(index_of_specular(1.0))
        made[names["weight"]] = graph.number(m.specular, "specular")
    else:
        made[names["ior"]] = number(index_of_specular(m.specular))
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


def _sheen(m: PrincipledMaterial, graph: Graph, weight: str, tint: str, roughness: str) -> Inputs:
    made = {weight: graph.number(m.sheen, "sheen"), roughness: graph.number(m.sheen_roughness, "sheen_roughness")}
    if m.sheen_color is not None:
        return made | {tint: graph.color(m.sheen_color, "sheen_color")}
    if isinstance(m.sheen_tint, ScalarTexture) or (isinstance(m.base_color, ColorTexture) and m.sheen_tint):
        graph.tell("sheen_tint", "it is not written where it, or what it tints, is a texture")
        return made
    return made | {
        tint: color(WHITE if isinstance(m.base_color, ColorTexture) else _tinted(m.base_color, m.sheen_tint))
    }


def _coat(m: PrincipledMaterial, graph: Graph, weight: str, roughness: str, normal: str) -> Inputs:
    made = {weight: graph.number(m.clearcoat, "clearcoat")}
    if m.clearcoat_roughness is not None:
        made[roughness] = graph.number(m.clearcoat_roughness, "clearcoat_roughness")
    else:
        if isinstance(m.clearcoat_gloss, ScalarTexture):
            graph.tell("clearcoat_gloss", "a texture of it is not written; its factor is")
        made[roughness] = number(roughness_of_gloss(_plain(m.clearcoat_gloss)))
    map = graph.normal(m.clearcoat_normal_map, "clearcoat_normal_map")
    return made | ({normal: map} if map is not None else {})


def _normal(m: PrincipledMaterial, graph: Graph, name: str) -> Inputs:
    map = graph.normal(m.normal_map, "normal_map")
    return {name: map} if map is not None else {}


def _tell_others(m: PrincipledMaterial, graph: Graph) -> None:
    if _is_used(m.subsurface):
        graph.tell("subsurface", "a flatter diffuse reflection is not written")
    if m.alpha_cutoff is not None:
        graph.tell("alpha_cutoff", "neither model has a cut-off; the opacity is written without it")
    if _shines(m) and m.emission_sides == "both":
        graph.tell("emission_sides", "the file does not say on which sides a surface shines")
    if getattr(m, "height", None) is not None:
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


def _product(value: Any, factor: float) -> Any:
    if isinstance(value, ScalarTexture):
        return value.model_copy(update={"factor": value.factor * factor})
    return min(value * factor, 1.0)


def _scaled(graph: Graph, value: Any, parameter: str, factor: float) -> Value:
    if isinstance(value, ScalarTexture):
        return graph.number(value.model_copy(update={"factor": value.factor * factor}), parameter)
    return number(value * factor)


# In the order in which they are preferred where both lose as much: the newer one first.
MODELS: dict[str, Callable[[PrincipledMaterial, Graph], Inputs]] = {
    "open_pbr_surface": open_pbr_surface,
    "standard_surface": standard_surface,
}
