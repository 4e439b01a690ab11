"""`open_pbr_surface` and `standard_surface` as `openpbr`, where that loses less than `principled` does. Each formula
is a tree, as in `models`. The tables of docs/files.md say the same in words.
"""

from __future__ import annotations

from service.document.numbers import LARGEST
from service.formats.read.materialx.surface import NITS, Surface
from service.formats.read.materialx.trees import (
    Tree,
    added,
    clamped,
    complement,
    constant,
    mean,
    quotient,
    raised,
    times,
)

# Parameters that the node calls as OpenPBR does, and their defaults, which are those of the library.
SAME = {
    "base_weight": 1.0, "base_color": 0.8, "base_diffuse_roughness": 0.0, "base_metalness": 0.0,
    "specular_weight": 1.0, "specular_color": 1.0, "specular_roughness": 0.3, "specular_roughness_anisotropy": 0.0,
    "specular_ior": 1.5, "transmission_weight": 0.0, "transmission_color": 1.0, "coat_weight": 0.0, "coat_color": 1.0,
    "coat_roughness": 0.0, "coat_roughness_anisotropy": 0.0, "coat_ior": 1.6, "coat_darkening": 1.0,
    "fuzz_weight": 0.0, "fuzz_color": 1.0, "fuzz_roughness": 0.5, "geometry_opacity": 1.0,
    "thin_film_weight": 0.0, "thin_film_thickness": 0.5, "thin_film_ior": 1.4, "subsurface_weight": 0.0,
    "subsurface_color": 0.8,
}  # fmt: skip
Triple = tuple[float, float, float]
BLACK: Triple = (0.0, 0.0, 0.0)
RADIUS_SCALE: Triple = (1.0, 0.5, 0.25)  # of the library's OpenPBR
NEGLIGIBLE = 0.5  # a coat whose roughness is at most this share of the base's makes that at most 3 % rougher


def suits_standard(s: Surface) -> bool:
    """Whether more is used that only `openpbr` has than what only `principled` has."""
    is_thin = s.is_set("thin_walled")
    if s.is_used("subsurface", 0):
        return not is_thin
    if not is_thin and s.is_used("transmission", 0) and s.is_used("transmission_scatter", 0):
        return True
    gained = int(s.is_used("diffuse_roughness", 0)) + int(
        s.is_used("metalness", 0) and s.is_used("specular_color", 1)
    )
    if s.is_used("coat", 0):
        neutral = {
            "coat_color": 1.0, "coat_IOR": 1.5, "coat_anisotropy": 0.0, "coat_affect_color": 0.0,
            "coat_affect_roughness": 0.0,
        }  # fmt: skip
        gained += sum(s.is_used(name, value) for name, value in neutral.items())
    lost = int(s.is_used("sheen", 0)) + int(s.is_used("coat", 0) and _roughens(s))
    turned = ("specular_rotation", *(["coat_rotation"] if s.is_used("coat_anisotropy", 0) else []))
    lost += sum(s.constant(name) is None for name in turned)
    return gained > lost


def open_pbr_surface(s: Surface) -> None:
    """OpenPBR Surface 1.1, whose parameters have the names that `openpbr` has."""
    s.material["type"] = "openpbr"
    for name, default in SAME.items():
        s.put(name, name, s.tree(name), None if s.graphs.is_given(s.node, name) else default)
    if s.is_used("subsurface_weight", 0):
        _number(s, "subsurface_radius", s.number("subsurface_radius", 1.0), 1.0)
        _color(s, "subsurface_radius_scale", s.triple("subsurface_radius_scale", RADIUS_SCALE), RADIUS_SCALE)
        _number(s, "subsurface_scatter_anisotropy", s.number("subsurface_scatter_anisotropy", 0.0), 0.0)
    if s.is_used("transmission_weight", 0):
        _inside(s)
    if s.is_set("geometry_thin_walled"):
        s.material["geometry_thin_walled"] = True
    _emission(s, "emission_luminance", 1.0)
    s.normal("geometry_normal", "geometry_normal")
    s.normal("geometry_coat_normal", "geometry_coat_normal")
    for name in ("geometry_tangent", "geometry_coat_tangent"):
        s.tangent(name, name)
    if s.is_used("transmission_dispersion_scale", 0):
        _disperse(
            s, s.number("transmission_dispersion_scale", 0), s.number("transmission_dispersion_abbe_number", 20)
        )


def standard_surface(s: Surface) -> None:
    """Autodesk Standard Surface 1.0.1."""
    s.material["type"] = "openpbr"
    _set(s, "base_weight", "base")
    s.put("base_color", "base_color", s.tree("base_color"))
    if s.is_used("subsurface", 0):
        _below(s)
    _set(s, "base_diffuse_roughness", "diffuse_roughness")
    _set(s, "base_metalness", "metalness")
    _set(s, "specular_weight", "specular")
    _set(s, "specular_color", "specular_color")
    if s.is_used("metalness", 0) and s.is_used("specular_color", 1):
        s.note("specular_color", "a metal has this colour near its edge rather than at it")
    _set(s, "specular_ior", "specular_IOR")
    _stretched(s, "specular_roughness", "specular_anisotropy", "specular_rotation", "geometry_tangent")
    if s.is_used("transmission", 0):
        _set(s, "transmission_weight", "transmission")
        _set(s, "transmission_color", "transmission_color")
        _inside(s)
        if s.is_used("transmission_dispersion", 0):
            _disperse(s, 1.0, s.number("transmission_dispersion", 0))
    if s.is_used("thin_film_thickness", 0):
        s.material["thin_film_weight"] = 1.0
        s.put("thin_film_thickness", "thin_film_thickness", times(s.tree("thin_film_thickness"), 1e-3), 0.5)
        s.put("thin_film_ior", "thin_film_IOR", s.tree("thin_film_IOR"), 1.4)
    if s.is_set("thin_walled"):
        s.material["geometry_thin_walled"] = True
    if s.is_used("coat", 0):
        _coat(s)
    if s.is_used("sheen", 0):
        _set(s, "fuzz_weight", "sheen")
        _set(s, "fuzz_color", "sheen_color")
        _set(s, "fuzz_roughness", "sheen_roughness")
        s.note("sheen", "the sheen is shown as fuzz, whose reach by its roughness is another")
    _emission(s, "emission", 1 / NITS)
    s.put("geometry_opacity", "opacity", mean(s.tree("opacity")), 1.0)
    s.normal("geometry_normal", "normal")
    s.lose([
        ("transmission_extra_roughness", 0, "a roughness of the transmission alone is not supported"),
    ])  # fmt: skip


def _inside(s: Surface) -> None:
    """What light meets between two refractions, which both nodes describe alike."""
    _number(s, "transmission_depth", s.number("transmission_depth", 0.0), 0.0)
    _color(s, "transmission_scatter", s.triple("transmission_scatter", BLACK), BLACK)
    _number(s, "transmission_scatter_anisotropy", s.number("transmission_scatter_anisotropy", 0.0), 0.0)


def _below(s: Surface) -> None:
    """The subsurface of Standard Surface, whose radius is a colour times a scale."""
    _set(s, "subsurface_weight", "subsurface")
    s.put("subsurface_color", "subsurface_color", s.tree("subsurface_color"))
    radius, scale = s.triple("subsurface_radius", (1.0, 1.0, 1.0)), s.number("subsurface_scale", 1.0)
    most = max(radius)
    share = (radius[0] / most, radius[1] / most, radius[2] / most) if most > 0 else (1.0, 1.0, 1.0)
    _number(s, "subsurface_radius", most * scale, 1.0)
    _color(s, "subsurface_radius_scale", share, RADIUS_SCALE)
    _number(s, "subsurface_scatter_anisotropy", s.number("subsurface_anisotropy", 0.0), 0.0)


def _number(s: Surface, parameter: str, found: float, default: float) -> None:
    least, most = (-1.0, 1.0) if parameter.endswith("anisotropy") else (0.0, LARGEST)
    if found != default:
        s.material[parameter] = min(max(found, least), most)


def _color(s: Surface, parameter: str, found: Triple, default: Triple) -> None:
    if found != default:
        s.material[parameter] = [min(max(each, 0.0), 1.0) for each in found]


def _disperse(s: Surface, scale: float, abbe: float) -> None:
    if scale > 0 and abbe > 0:
        s.material["transmission_dispersion_scale"] = min(scale, 1.0)
        s.material["transmission_dispersion_abbe_number"] = min(abbe, LARGEST)


def _set(s: Surface, parameter: str, name: str) -> None:
    s.put(parameter, name, s.tree(name), SAME[parameter])


def _coat(s: Surface) -> None:
    for parameter, name in (("coat_weight", "coat"), ("coat_color", "coat_color"), ("coat_ior", "coat_IOR")):
        _set(s, parameter, name)
    _stretched(s, "coat_roughness", "coat_anisotropy", "coat_rotation", "geometry_coat_tangent")
    s.put("coat_darkening", "coat_affect_color", clamped(s.tree("coat_affect_color"), 0.0, 1.0), 1.0)
    if s.is_used("coat_affect_color", 0):
        s.note("coat_affect_color", "the coat darkens what is under it by its reflections, not by a power")
    if _roughens(s):
        s.note("coat_affect_roughness", "a rough coat makes what is under it rougher")
    s.normal("geometry_coat_normal", "coat_normal")


def _roughens(s: Surface) -> bool:
    """Whether the coat makes what is under it rougher than the file says."""
    affects = s.constant("coat_affect_roughness")
    if affects == [1.0]:
        return False
    coat, base = s.constant("coat_roughness"), s.constant("specular_roughness")
    return coat is None or base is None or coat[0] > NEGLIGIBLE * base[0]


def _stretched(s: Surface, roughness: str, anisotropy: str, rotation: str, tangent: str) -> None:
    """A roughness, how far its highlight is stretched, and where. With b the ratio of both alphas, one is
    r^2 / sqrt(b) in Standard Surface and r^2 sqrt(2 / (1 + b^2)) in OpenPBR."""
    tree: Tree = s.tree(roughness)
    if s.is_used(anisotropy, 0):
        across = complement(clamped(s.tree(anisotropy), 0.0, 0.98))
        wider = quotient(added(constant(1.0), times(across, across)), times(across, 2.0))
        tree = times(tree, raised(wider, 0.25))
        s.put(f"{roughness}_anisotropy", anisotropy, complement(across), 0.0)
        s.tangent(tangent, "tangent", s.number(rotation, 0.0) * 360)
    s.put(roughness, roughness, tree, SAME[roughness])


def _emission(s: Surface, strength: str, nits: float) -> None:
    """A luminance, `strength` times `nits`, and a colour, which is left out where nothing shines."""
    found = s.constant(strength)
    if found is None:
        s.put("emission_luminance", strength, constant(1 / NITS))
        light = times(s.tree("emission_color"), times(s.tree(strength), nits * NITS))
        s.put("emission_color", "emission_color", light)
        return
    s.put("emission_luminance", strength, constant(found[0] * nits), 0.0)
    if s.graphs.is_given(s.node, "emission_color"):
        s.put("emission_color", "emission_color", s.tree("emission_color"))
