"""`standard_surface` [Autodesk Standard Surface 1.0.1] as `principled`, or as `openpbr` where it loses less.
docs/files.md has the same tables in words."""

from __future__ import annotations

from service.formats.surface import open_pbr, parts
from service.formats.surface.choice import read_best
from service.formats.surface.inputs import PART, ROUGHLY, TANGENT, Inputs, Triple
from service.formats.surface.open_pbr import BLACK, NITS, RADIUS_SCALE, WHITE
from service.formats.surface.plain import Default
from service.formats.surface.trees import (
    Tree,
    added,
    clamped,
    complement,
    constant,
    mean,
    mixed,
    quotient,
    raised,
    times,
)

DEFAULTS: dict[str, Default] = {
    "base": 1.0, "base_color": (0.8,) * 3, "diffuse_roughness": 0.0, "metalness": 0.0, "specular": 1.0,
    "specular_color": WHITE, "specular_roughness": 0.2, "specular_IOR": 1.5, "specular_anisotropy": 0.0,
    "specular_rotation": 0.0, "transmission": 0.0, "transmission_color": WHITE, "transmission_depth": 0.0,
    "transmission_scatter": BLACK, "transmission_scatter_anisotropy": 0.0, "transmission_dispersion": 0.0,
    "transmission_extra_roughness": 0.0, "subsurface": 0.0, "subsurface_color": WHITE, "subsurface_radius": WHITE,
    "subsurface_scale": 1.0, "subsurface_anisotropy": 0.0, "sheen": 0.0, "sheen_color": WHITE,
    "sheen_roughness": 0.3, "coat": 0.0, "coat_color": WHITE, "coat_roughness": 0.1, "coat_anisotropy": 0.0,
    "coat_rotation": 0.0, "coat_IOR": 1.5, "coat_normal": None, "coat_affect_color": 0.0,
    "coat_affect_roughness": 0.0, "thin_film_thickness": 0.0, "thin_film_IOR": 1.5, "emission": 0.0,
    "emission_color": WHITE, "opacity": WHITE, "thin_walled": 0.0, "normal": None, "tangent": None,
}  # fmt: skip
NARROWEST = 0.98  # the anisotropy beyond which nothing changes
EXTRA = ("transmission_extra_roughness", 0.0, "a roughness of the transmission alone is not supported")


def standard_surface(s: Inputs) -> None:
    read_best(s, _principled, _openpbr)


def _principled(s: Inputs) -> None:
    metalness = s.tree("metalness")
    s.put("metallic", "metalness", metalness, 0.0)
    base = times(s.tree("base_color"), s.tree("base"))
    is_thin = s.is_set("thin_walled")
    if is_thin:
        s.material["thin_walled"] = True
    if s.is_used("subsurface", 0) and is_thin:  # all that the library's own graph scatters goes through then
        s.put("diffuse_transmission", "subsurface_color", s.tree("subsurface"), 0.0)
        s.put("diffuse_transmission_color", "subsurface_color", s.tree("subsurface_color"))
    elif s.is_used("subsurface", 0):
        s.note("subsurface", "light that walks below the surface is left out", PART)
    if s.is_used("transmission", 0) and s.is_used("transmission_scatter", 0):
        s.note("transmission_scatter", "what scatters inside of the body is left out", PART)
    base, light = _through(s, base, is_thin), times(s.tree("emission_color"), s.tree("emission"))
    if s.is_used("coat", 0) and s.is_used("coat_color", 1):
        s.note("coat_color", "the colour of the coat tints what is under it, at all angles alike")
        tint = mixed(constant(*WHITE), s.tree("coat_color"), s.tree("coat"))
        base, light = times(base, tint), times(light, tint)
    s.put("base_color", "base_color", base, instead=s.tree("base_color"))
    s.put("roughness", "specular_roughness", s.tree("specular_roughness"))
    if s.is_used("specular_anisotropy", 0):
        parts.stretched(s, "specular_anisotropy", complement(_anisotropy(s, "specular_anisotropy")))
    s.put("anisotropic_rotation", "specular_rotation", times(s.tree("specular_rotation"), 360.0), 0.0)
    _specular(s)
    s.put("transmission", "transmission", s.tree("transmission"), 0.0)
    parts.sheen(s, s.tree("sheen"), s.tree("sheen_color"), s.tree("sheen_roughness"), "sheen")
    parts.coat(s, "coat", "coat_roughness", "coat_IOR", "coat_normal")
    parts.film(s, "thin_film_thickness", "thin_film_IOR")
    if s.is_used("transmission_dispersion", 0):
        parts.abbe(s, s.number("transmission_dispersion", 0))
    parts.emission(s, light, "emission", s.tree("emission_color"))
    s.put("alpha", "opacity", mean(s.tree("opacity")), 1.0)
    s.normal("normal_map", "normal")
    s.lose([
        ("diffuse_roughness", 0, "a rough diffuse base is not supported and is left out"),
        EXTRA,
        ("coat_anisotropy", 0, "an anisotropic coat is not supported"),
        ("coat_affect_color", 0, "the coat does not darken what is under it"),
        ("coat_affect_roughness", 0, "the coat does not roughen what is under it"),
    ])  # fmt: skip
    if not s.is_black(metalness) and s.is_used("specular_color", 1):
        s.note("specular_color", "the colour of a metal's edges is not supported: they are white")
    if s.is_given("tangent"):
        s.note("tangent", TANGENT)


def _through(s: Inputs, base: Tree, is_thin: bool) -> Tree:
    """The colour of what light passes through: of the inside where it has a depth, else of the surface."""
    color = s.tree("transmission_color")
    if not s.is_used("transmission", 0):
        return base
    distance = 0.0 if is_thin else s.number("transmission_depth", 0.0) * s.unit
    if distance > 0:
        s.put("attenuation_distance", "transmission_depth", constant(distance))
        s.put("attenuation_color", "transmission_color", color)
        color = constant(*WHITE)
    return parts.passing(s, base, color, s.tree("transmission"), "transmission_color")


def _specular(s: Inputs) -> None:
    """The colour multiplies all of the reflection: its hue is a tint, its largest channel a part of the weight."""
    if s.material.get("metallic") == 1:
        return  # there is no dielectric
    is_tinted = s.is_given("specular_color") and s.is_used("specular_color", 1)
    strength = s.tree("specular")
    if is_tinted:
        strength = times(strength, parts.tint(s, "specular_color"))
    is_weighted = is_tinted or s.is_used("specular", 1)
    parts.dielectric(s, "specular_IOR", strength if is_weighted else None, "specular", "transmission")


def _openpbr(s: Inputs) -> None:
    open_pbr.begin(s)
    _same(s, "base_weight", "base")
    s.put("base_color", "base_color", s.tree("base_color"))
    if s.is_used("subsurface", 0):
        _below(s)
    _same(s, "base_diffuse_roughness", "diffuse_roughness")
    _same(s, "base_metalness", "metalness")
    _same(s, "specular_weight", "specular")
    _same(s, "specular_color", "specular_color")
    if s.is_used("metalness", 0) and s.is_used("specular_color", 1):
        s.note("specular_color", "a metal has this colour near its edge rather than at it", ROUGHLY)
    if s.is_used("metalness", 0) and s.is_used("specular", 1):
        s.note("specular", "it multiplies a metal's reflection as well")
    _same(s, "specular_ior", "specular_IOR")
    _stretched(s, "specular_roughness", "specular_anisotropy", "specular_rotation", "geometry_tangent")
    if s.is_used("transmission", 0):
        _same(s, "transmission_weight", "transmission")
        _same(s, "transmission_color", "transmission_color")
        open_pbr.inside(s)
        if s.is_used("transmission_dispersion", 0):
            open_pbr.disperse(s, 1.0, s.number("transmission_dispersion", 0))
    if s.is_used("thin_film_thickness", 0):
        s.material["thin_film_weight"] = 1.0
        s.put("thin_film_thickness", "thin_film_thickness", times(s.tree("thin_film_thickness"), 1e-3), 0.5)
        s.put("thin_film_ior", "thin_film_IOR", s.tree("thin_film_IOR"), 1.4)
    if s.is_set("thin_walled"):
        s.material["geometry_thin_walled"] = True
        if s.is_used("subsurface", 0):
            s.note("subsurface", "what a thin wall scatters leaves it on both sides")
    if s.is_used("coat", 0):
        _coat(s)
    if s.is_used("sheen", 0):
        _same(s, "fuzz_weight", "sheen")
        _same(s, "fuzz_color", "sheen_color")
        _same(s, "fuzz_roughness", "sheen_roughness")
        s.note("sheen", open_pbr.FUZZY)
    open_pbr.emission(s, "emission", 1 / NITS)
    s.put("geometry_opacity", "opacity", mean(s.tree("opacity")), 1.0)
    s.normal("geometry_normal", "normal")
    s.lose([EXTRA])


def _same(s: Inputs, parameter: str, name: str) -> None:
    s.put(parameter, name, s.tree(name), open_pbr.first(parameter))


def _below(s: Inputs) -> None:
    """Read the subsurface, whose radius is a colour times a scale."""
    _same(s, "subsurface_weight", "subsurface")
    s.put("subsurface_color", "subsurface_color", s.tree("subsurface_color"))
    radius, scale = s.triple("subsurface_radius", WHITE), s.number("subsurface_scale", 1.0)
    most = max(radius)
    share: Triple = (radius[0] / most, radius[1] / most, radius[2] / most) if most > 0 else WHITE
    open_pbr.number(s, "subsurface_radius", most * scale * s.unit, 1.0)
    open_pbr.color(s, "subsurface_radius_scale", share, RADIUS_SCALE)
    open_pbr.number(s, "subsurface_scatter_anisotropy", s.number("subsurface_anisotropy", 0.0), 0.0)


def _coat(s: Inputs) -> None:
    for parameter, name in (("coat_weight", "coat"), ("coat_color", "coat_color"), ("coat_ior", "coat_IOR")):
        _same(s, parameter, name)
    _stretched(s, "coat_roughness", "coat_anisotropy", "coat_rotation", "geometry_coat_tangent")
    s.put("coat_darkening", "coat_affect_color", clamped(s.tree("coat_affect_color"), 0.0, 1.0), 1.0)
    if s.is_used("coat_affect_color", 0):
        s.note("coat_affect_color", "the coat darkens what is under it by its reflections, not by a power", ROUGHLY)
    if s.constant("coat_affect_roughness") != [1.0] and open_pbr.roughens(s, "coat_roughness", "specular_roughness"):
        s.note("coat_affect_roughness", open_pbr.ROUGHER)
    s.normal("geometry_coat_normal", "coat_normal")


def _anisotropy(s: Inputs, name: str) -> Tree:
    """1 - b, of the ratio b of alpha across the tangent to that along it."""
    return clamped(s.tree(name), 0.0, NARROWEST)


def _stretched(s: Inputs, roughness: str, anisotropy: str, rotation: str, tangent: str) -> None:
    """A roughness, how far its highlight is stretched, and where. With b the ratio of both alphas, one is
    r^2 / sqrt(b) in Standard Surface and r^2 sqrt(2 / (1 + b^2)) in OpenPBR."""
    tree: Tree = s.tree(roughness)
    if s.is_used(anisotropy, 0):
        across = complement(_anisotropy(s, anisotropy))
        wider = quotient(added(constant(1.0), times(across, across)), times(across, 2.0))
        tree = times(tree, raised(wider, 0.25))
        s.put(f"{roughness}_anisotropy", anisotropy, complement(across), 0.0, s.tree(anisotropy))
        s.tangent(tangent, "tangent", s.number(rotation, 0.0) * 360)
    s.put(roughness, roughness, tree, open_pbr.first(roughness), s.tree(roughness))
