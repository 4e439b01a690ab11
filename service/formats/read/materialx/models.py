"""The surface models of the standard library as `principled`, or as `openpbr` where that loses less. Each formula is
a tree, so that it holds for numbers and for textures alike. The tables of docs/files.md say the same in words.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from service.formats.read.materialx import openpbr
from service.formats.read.materialx.surface import TANGENT, Surface
from service.formats.read.materialx.trees import (
    Tree,
    added,
    applied,
    clamped,
    complement,
    constant,
    largest,
    less,
    mean,
    mixed,
    quotient,
    raised,
    times,
)

SHOWN_ABBE = 20.0  # the Abbe number of a dispersion of 1 of gltf_pbr
HALF = 0.5  # a film that covers so much is nearer to a whole one than to none
COAT_F0 = 0.04  # of principled's coat, whose index is 1.5
COAT_TINT = "the colour of the coat tints what is under it, at all angles alike"
DARKER = "the coat does not darken what is under it"


def standard_surface(s: Surface) -> None:
    """Autodesk Standard Surface 1.0.1."""
    transmission, metalness = s.tree("transmission"), s.tree("metalness")
    base = times(s.tree("base_color"), s.tree("base"))
    is_thin = _thin(s, "thin_walled")
    if s.is_used("subsurface", 0) and is_thin:  # all that the library's own graph scatters goes through then
        base = _translucent(s, base, s.tree("subsurface"), constant(0.0), "subsurface_color")
    base = _through(s, base, "transmission", "transmission_color", "transmission_depth", is_thin)
    base = _under_coat(s, base, "coat", "coat_color")
    s.put("base_color", "base_color", base)
    s.put("metallic", "metalness", metalness, 0.0)
    _roughness(s, "specular_roughness", "specular_anisotropy", _aspect_of_standard(s))
    s.put("anisotropic_rotation", "specular_rotation", times(s.tree("specular_rotation"), 360.0), 0.0)
    _specular(s, s.tree("specular"), s.tree("specular_color"), s.tree("specular_IOR"), "specular_IOR")
    s.put("transmission", "transmission", transmission, 0.0)
    _sheen(s, s.tree("sheen"), s.tree("sheen_color"), s.tree("sheen_roughness"), "sheen")
    _coat(s, "coat", "coat_roughness", "coat_IOR", "coat_normal")
    _film(s, "thin_film_thickness", "thin_film_IOR")
    if s.is_used("transmission_dispersion", 0):
        s.abbe(s.number("transmission_dispersion", 0))
    _emission(s, times(s.tree("emission_color"), s.tree("emission")), "emission")
    s.put("alpha", "opacity", mean(s.tree("opacity")), 1.0)
    s.normal("normal_map", "normal")
    s.lose([
        ("diffuse_roughness", 0, "a rough diffuse base is not supported and is left out"),
        ("transmission_extra_roughness", 0, "a roughness of the transmission alone is not supported"),
        ("coat_anisotropy", 0, "an anisotropic coat is not supported"),
        ("coat_affect_color", 0, DARKER),
        ("coat_affect_roughness", 0, "the coat does not roughen what is under it"),
    ])  # fmt: skip
    _metal_edges(s, metalness, "specular_color")
    _tangent(s)


def gltf_pbr(s: Surface) -> None:
    """glTF 2.0 with its ratified extensions."""
    s.put("base_color", "base_color", s.tree("base_color"))
    s.put("metallic", "metallic", s.tree("metallic"), 0.0)
    strength = s.tree("anisotropy_strength")
    if s.is_used("anisotropy_strength", 0):  # alpha along the tangent is mix(r^2, 1, strength^2), across it r^2
        alpha = clamped(raised(s.tree("roughness"), 2.0), 1e-4, 1.0)
        along = mixed(alpha, constant(1.0), times(strength, strength))
        rounder = raised(times(along, alpha), 0.25)
        _roughness(s, "roughness", "anisotropy_strength", quotient(alpha, along), rounder)
        turn = times(s.tree("anisotropy_rotation"), 180 / math.pi)
        s.put("anisotropic_rotation", "anisotropy_rotation", turn, 0.0)
    else:
        s.put("roughness", "roughness", s.tree("roughness"))
    _specular(s, s.tree("specular"), s.tree("specular_color"), s.tree("ior"), "ior")
    s.put("transmission", "transmission", s.tree("transmission"), 0.0)
    distance = s.constant("attenuation_distance")
    if s.is_used("transmission", 0):
        if distance is not None and distance[0] > 0 and s.is_used("thickness", 0):
            s.put("attenuation_distance", "attenuation_distance", constant(distance[0]))
            s.put("attenuation_color", "attenuation_color", s.tree("attenuation_color"))
        elif not s.is_used("thickness", 0):
            s.material["thin_walled"] = True
    color = s.tree("sheen_color")
    if not s.is_black(color):
        _sheen(s, constant(1.0), color, s.tree("sheen_roughness"), "sheen_color")
    _coat(s, "clearcoat", "clearcoat_roughness", None, "clearcoat_normal")
    _film(s, "iridescence_thickness", "iridescence_ior", "iridescence")
    _emission(s, times(s.tree("emissive"), s.tree("emissive_strength")), "emissive")
    mode = int(s.number("alpha_mode", 0))
    if mode:
        s.put("alpha", "alpha", s.tree("alpha"), 1.0)
    if mode == 1:
        s.put("alpha_cutoff", "alpha_cutoff", s.tree("alpha_cutoff"))
    s.normal("normal_map", "normal")
    if s.is_used("dispersion", 0) and (share := s.number("dispersion", 0)) > 0:
        s.abbe(SHOWN_ABBE / share)
    s.lose([
        ("occlusion", 1, "ambient occlusion is left out: the light that reaches a corner is traced"),
    ])  # fmt: skip
    _tangent(s)


def usd_preview_surface(s: Surface) -> None:
    """UsdPreviewSurface 2.6."""
    s.put("base_color", "diffuseColor", s.tree("diffuseColor"))
    if int(s.number("useSpecularWorkflow", 0)):
        color = s.tree("specularColor")
        s.note("useSpecularWorkflow", "a reflectance of its own is used as that of a dielectric; none is a metal")
        strength = largest(color)
        s.put("specular_color", "specularColor", quotient(color, clamped(strength, 1e-6, 1.0)), 1.0)
        s.put("ior", "specularColor", _index(strength))
    else:
        s.put("metallic", "metallic", s.tree("metallic"), 0.0)
        _specular(s, constant(1.0), constant(1.0, 1.0, 1.0), s.tree("ior"), "ior")
    s.put("roughness", "roughness", s.tree("roughness"))
    _coat(s, "clearcoat", "clearcoatRoughness", None, None)
    _emission(s, s.tree("emissiveColor"), "emissiveColor")
    threshold = s.number("opacityThreshold", 0)
    opacity, is_presence = s.constant("opacity"), int(s.number("opacityMode", 0)) == 1
    if opacity is not None and not is_presence and threshold == 0:  # glass: what is left out lets light through
        s.put("transmission", "opacity", complement(s.tree("opacity")), 0.0)
        if opacity[0] < 1:
            s.put(
                "base_color",
                "diffuseColor",
                mixed(constant(1.0, 1.0, 1.0), s.tree("diffuseColor"), s.tree("opacity")),
            )
    else:
        if not is_presence and threshold == 0:
            s.note(
                "opacity",
                "under a texture, a transparent surface is one that rays meet less often, without highlights",
            )
        s.put("alpha", "opacity", s.tree("opacity"), 1.0)
    if threshold > 0:
        s.put("alpha_cutoff", "opacityThreshold", constant(threshold))
    normal = s.graphs.normal(s.node, "normal")
    if normal is not None and normal.value is None:
        # Its texture has been brought to -1..1 already, and the library brings it back.
        halved = added(times(normal, 0.5), constant(0.5, 0.5, 0.5))
        own = normal.operation == "normalmap"
        map = normal if own else applied("normalmap", 3, scale=constant(1.0), **{"in": halved})
        s.normal("normal_map", "normal", map)
    s.height(s.tree("displacement"), s.place("displacement"))
    s.lose([
        ("occlusion", 1, "ambient occlusion is left out: the light that reaches a corner is traced"),
    ])  # fmt: skip


def disney_principled(s: Surface) -> None:
    """The Disney model of 2012, with the glass of 2015."""
    names = {
        "base_color": "baseColor", "metallic": "metallic", "roughness": "roughness", "specular": "specular",
        "specular_tint": "specularTint", "sheen": "sheen", "sheen_tint": "sheenTint", "clearcoat": "clearcoat",
        "clearcoat_gloss": "clearcoatGloss", "subsurface": "subsurface", "transmission": "specTrans",
    }  # fmt: skip
    defaults = {
        "metallic": 0.0, "roughness": 0.5, "specular": 0.5, "specular_tint": 0.0, "sheen": 0.0, "sheen_tint": 0.5,
        "clearcoat": 0.0, "clearcoat_gloss": 1.0, "subsurface": 0.0, "transmission": 0.0,
    }  # fmt: skip
    for parameter, name in names.items():
        s.put(parameter, name, s.tree(name), defaults.get(parameter))
    # Both stretch by 1 - 0.9 a; the library's implementation of it has another form of the same idea.
    s.put("anisotropic", "anisotropic", s.tree("anisotropic"), 0.0)
    if s.is_used("specTrans", 0):
        s.put("ior", "ior", s.tree("ior"))
        s.material.pop("specular", None)
    if s.is_used("subsurface", 0):
        s.note("subsurface", "light does not travel below the surface; the diffuse reflection is flatter instead")


def _aspect_of_standard(s: Surface) -> Tree:
    """alpha across the tangent over that along it."""
    return complement(clamped(s.tree("specular_anisotropy"), 0.0, 0.98))


def _roughness(s: Surface, name: str, anisotropy: str, ratio: Tree, rounder: Tree | None = None) -> None:
    """Roughness and anisotropy. `ratio` is alpha across the tangent over that along it, 1 - 0.9 a on principled."""
    s.put("roughness", name, s.tree(name) if rounder is None else rounder)
    if s.is_used(anisotropy, 0):
        s.put("anisotropic", anisotropy, quotient(complement(ratio), constant(0.9)))


def _index(f0: Tree) -> Tree:
    """The index of refraction of a reflectance head-on."""
    root = raised(clamped(f0, 0.0, 0.9), 0.5)
    return quotient(added(constant(1.0), root), less(constant(1.0), root))


def _reflectance(ior: Tree) -> Tree:
    return raised(applied("absval", 1, **{"in": quotient(less(ior, constant(1.0)), added(ior, constant(1.0)))}), 2.0)


def _specular(s: Surface, weight: Tree, color: Tree, ior: Tree, name: str) -> None:
    """The weight goes into the index, and so does what the colour's largest channel lacks or has beyond 1."""
    if s.material.get("metallic") == 1:
        return  # there is no dielectric
    tinted = s.is_used("specular_color", 1) if s.graphs.is_given(s.node, "specular_color") else False
    strength = times(weight, largest(color)) if tinted else weight
    if tinted and not s.is_black(color):
        s.put("specular_color", "specular_color", quotient(color, clamped(largest(color), 1e-6, 1e6)), 1.0)
    names = [one for one in ("specular", "specular_weight") if s.node.getNodeDef().getActiveInput(one) is not None]
    weighted = tinted or any(s.is_used(one, 1) for one in names)
    if not weighted:
        s.put("ior", name, ior, 1.5)
        return
    transmits = any(
        s.node.getNodeDef().getActiveInput(one) is not None and s.is_used(one, 0)
        for one in ("transmission", "transmission_weight")
    )
    if transmits:
        s.put("ior", name, ior, 1.5)
        s.note(names[0] if names else name, "beside transmission the index alone sets the reflection")
        return
    s.put("ior", name, _index(times(_reflectance(ior), strength)), 1.5)


def _sheen(s: Surface, weight: Tree, color: Tree, roughness: Tree, name: str) -> None:
    if s.is_black(weight):
        return
    s.put("sheen", name, weight, 0.0)
    s.put("sheen_color", name, color)
    s.put("sheen_roughness", name, roughness, 0.5)


def _coat(s: Surface, weight: str, roughness: str, ior: str | None, normal: str | None) -> None:
    if not s.is_used(weight, 0):
        return
    share = s.tree(weight)
    if ior is not None and s.is_used(ior, 1.5):
        share = times(share, times(_reflectance(s.tree(ior)), 1 / COAT_F0))
        s.note(ior, "the coat's index is 1.5; another one makes it stronger or weaker instead")
    s.put("clearcoat", weight, share, 0.0)
    s.put("clearcoat_roughness", roughness, s.tree(roughness))
    if normal is not None:
        s.normal("clearcoat_normal_map", normal)


def _film(s: Surface, thickness: str, ior: str, weight: str | None = None, nanometres: float = 1.0) -> None:
    """A thin film, whose thickness is in units of so many nanometres. Ours covers all or nothing."""
    tree = times(s.tree(thickness), nanometres)
    if weight is not None:
        share = s.constant(weight)
        if share is None:
            s.note(weight, "a film covers all of a texel or nothing here: all where this is 0.5 or more")
            tree = applied(
                "ifgreatereq", 1, value1=s.tree(weight), value2=constant(HALF), in1=tree, in2=constant(0.0)
            )
        elif share[0] < HALF:
            if share[0] > 0:
                s.note(
                    weight,
                    f"a film that covers a part of the surface is not supported; of {share[0]:g} it is left out",
                )
            return
        elif share[0] < 1:
            s.note(
                weight, f"a film that covers a part of the surface is not supported; of {share[0]:g} it covers all"
            )
    if not s.is_black(tree):
        s.put("film_thickness", thickness, tree, 0.0)
    if "film_thickness" in s.material:
        s.put("film_ior", ior, s.tree(ior), 1.4)


def _under_coat(s: Surface, base: Tree, weight: str, color: str) -> Tree:
    if not s.is_used(weight, 0) or not s.is_used(color, 1):
        return base
    s.note(color, COAT_TINT)
    return times(base, mixed(constant(1.0, 1.0, 1.0), s.tree(color), s.tree(weight)))


def _through(s: Surface, base: Tree, weight: str, color: str, depth: str, is_thin: bool) -> Tree:
    """The colour of what light passes through: of the inside where it has a depth, else of the surface."""
    if not s.is_used(weight, 0):
        return base
    distance = 0.0 if is_thin else s.number(depth, 0.0)
    if distance > 0:
        s.put("attenuation_distance", depth, constant(distance))
        s.put("attenuation_color", color, s.tree(color))
        return mixed(base, constant(1.0, 1.0, 1.0), s.tree(weight))
    return mixed(base, s.tree(color), s.tree(weight))


def _emission(s: Surface, light: Tree, name: str) -> None:
    if not s.is_black(light):
        s.put("emission", name, light)


def _thin(s: Surface, name: str) -> bool:
    """Whether the surface is a thin wall, which the material then says."""
    if not s.is_set(name):
        return False
    s.material["thin_walled"] = True
    return True


def _translucent(s: Surface, base: Tree, share: Tree, reflected: Tree, color: str) -> Tree:
    """The base colour of a thin wall, of whose diffuse light `share` goes through with a colour, while `reflected`
    comes back with it."""
    s.material["thin_walled"] = True
    s.put("diffuse_transmission", color, share, 0.0)
    s.put("diffuse_transmission_color", color, s.tree(color))
    return mixed(base, s.tree(color), quotient(reflected, clamped(complement(share), 1e-6, 1.0)))


def _metal_edges(s: Surface, metalness: Tree, name: str) -> None:
    if not s.is_black(metalness) and s.is_used(name, 1):
        s.note(name, "the colour of a metal's edges is not supported: they are white")


def _tangent(s: Surface, *names: str) -> None:
    for name in names or ("tangent",):
        if s.graphs.is_given(s.node, name):
            s.note(name, TANGENT)


Reading = Callable[[Surface], None]


def _either(suits: Callable[[Surface], bool], better: Reading, otherwise: Reading) -> Reading:
    return lambda s: better(s) if suits(s) else otherwise(s)


MODELS: dict[str, Reading] = {
    "standard_surface": _either(openpbr.suits_standard, openpbr.standard_surface, standard_surface),
    "open_pbr_surface": openpbr.open_pbr_surface,
    "gltf_pbr": gltf_pbr,
    "UsdPreviewSurface": usd_preview_surface,
    "disney_principled": disney_principled,
}
