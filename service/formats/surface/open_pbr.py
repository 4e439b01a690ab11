"""`open_pbr_surface` as `openpbr` [OpenPBR Surface 1.1.1]: the parameters have the same names."""

from __future__ import annotations

from service.formats.surface.inputs import RANGES, Inputs, Triple
from service.formats.surface.plain import Default
from service.formats.surface.trees import Tree, constant, times
from service.formats.types import LARGEST

WHITE: Triple = (1.0, 1.0, 1.0)
BLACK: Triple = (0.0, 0.0, 0.0)
RADIUS_SCALE: Triple = (1.0, 0.5, 0.25)
NITS = 1 / 683  # W/(m^2 sr) of 1 cd/m^2
NEGLIGIBLE = 0.5  # a coat whose roughness is at most this share of the base's makes that at most 3 % rougher
ROUGHER = "a rough coat makes what is under it rougher"
FUZZY = "the sheen is shown as fuzz, whose reach by its roughness is another"
UNCUT = "the model has no cut-off: rays meet the surface by the chance of its opacity"
# Inputs that may be textures, and their defaults, which are those of `openpbr`.
SAME: dict[str, float | Triple] = {
    "base_weight": 1.0, "base_color": (0.8,) * 3, "base_diffuse_roughness": 0.0, "base_metalness": 0.0,
    "specular_weight": 1.0, "specular_color": WHITE, "specular_roughness": 0.3,
    "specular_roughness_anisotropy": 0.0, "specular_ior": 1.5, "transmission_weight": 0.0,
    "transmission_color": WHITE, "coat_weight": 0.0, "coat_color": WHITE, "coat_roughness": 0.0,
    "coat_roughness_anisotropy": 0.0, "coat_ior": 1.6, "coat_darkening": 1.0, "fuzz_weight": 0.0,
    "fuzz_color": WHITE, "fuzz_roughness": 0.5, "geometry_opacity": 1.0, "thin_film_weight": 0.0,
    "thin_film_thickness": 0.5, "thin_film_ior": 1.4, "subsurface_weight": 0.0, "subsurface_color": (0.8,) * 3,
}  # fmt: skip
DEFAULTS: dict[str, Default] = {
    **SAME, "subsurface_radius": 1.0, "subsurface_radius_scale": RADIUS_SCALE, "subsurface_scatter_anisotropy": 0.0,
    "transmission_depth": 0.0, "transmission_scatter": BLACK, "transmission_scatter_anisotropy": 0.0,
    "transmission_dispersion_scale": 0.0, "transmission_dispersion_abbe_number": 20.0, "emission_luminance": 0.0,
    "emission_color": WHITE, "geometry_thin_walled": 0.0, "geometry_normal": None, "geometry_coat_normal": None,
    "geometry_tangent": None, "geometry_coat_tangent": None,
}  # fmt: skip


def open_pbr_surface(s: Inputs) -> None:
    """Nothing is lost but differences from place to place, where `openpbr` has one number."""
    s.material["type"] = "openpbr"
    for name in SAME:
        s.put(name, name, s.tree(name), None if s.is_given(name) else first(name))
    if s.is_used("subsurface_weight", 0):
        number(s, "subsurface_radius", s.number("subsurface_radius", 1.0) * s.unit, 1.0)
        color(s, "subsurface_radius_scale", s.triple("subsurface_radius_scale", RADIUS_SCALE), RADIUS_SCALE)
        name = "subsurface_scatter_anisotropy"
        number(s, name, s.number(name, 0.0), 0.0)
    if s.is_used("transmission_weight", 0):
        inside(s)
    if s.is_set("geometry_thin_walled"):
        s.material["geometry_thin_walled"] = True
    emission(s, "emission_luminance", 1.0)
    s.normal("geometry_normal", "geometry_normal")
    s.normal("geometry_coat_normal", "geometry_coat_normal")
    for name in ("geometry_tangent", "geometry_coat_tangent"):
        s.tangent(name, name)
    if s.is_used("transmission_dispersion_scale", 0):
        scale, abbe = s.number("transmission_dispersion_scale", 0), "transmission_dispersion_abbe_number"
        disperse(s, scale, s.number(abbe, 20))


def first(name: str) -> float:
    """The default of an input, one number of a grey colour."""
    found = SAME[name]
    return found[0] if isinstance(found, tuple) else found


# What other models have as well, when they are read as `openpbr`.


def begin(s: Inputs) -> None:
    """Make the material one of this model."""
    s.material.clear()
    s.material["type"] = "openpbr"


def roughens(s: Inputs, coat: str, base: str) -> bool:
    """True if the coat, whose roughness is the input `coat`, makes what is under it rougher than the file says."""
    above, below = s.constant(coat), s.constant(base)
    return above is None or below is None or above[0] > NEGLIGIBLE * below[0]


def lacquer(s: Inputs, weight: str, roughness: str, base: str, normal: str | None = None) -> None:
    """A clear coat of index 1.5 that darkens nothing."""
    if not s.is_used(weight, 0):
        return
    s.put("coat_weight", weight, s.tree(weight), 0.0)
    s.put("coat_roughness", roughness, s.tree(roughness), 0.0)
    s.material |= {"coat_ior": 1.5, "coat_darkening": 0.0}
    if roughens(s, roughness, base):
        s.note(roughness, ROUGHER)
    if normal is not None:
        s.normal("geometry_coat_normal", normal)


def shine(s: Inputs, light: Tree, name: str) -> None:
    """Emission by one input, a radiance."""
    if not s.is_black(light):
        s.material["emission_luminance"] = round(1 / NITS, 6)
        s.put("emission_color", name, light)


def number(s: Inputs, parameter: str, found: float, default: float) -> None:
    """Set a parameter that has no texture; not where it is its default."""
    low, high = RANGES[parameter]
    if found != default:
        s.material[parameter] = min(max(found, low), high)


def color(s: Inputs, parameter: str, found: Triple, default: Triple) -> None:
    """Set a colour that has no texture; not where it is its default."""
    if found != default:
        s.material[parameter] = [min(max(each, 0.0), 1.0) for each in found]


def inside(s: Inputs) -> None:
    """What light meets between two refractions."""
    number(s, "transmission_depth", s.number("transmission_depth", 0.0) * s.unit, 0.0)
    color(s, "transmission_scatter", s.triple("transmission_scatter", BLACK), BLACK)
    name = "transmission_scatter_anisotropy"
    number(s, name, s.number(name, 0.0), 0.0)


def disperse(s: Inputs, scale: float, abbe: float) -> None:
    if scale > 0 and abbe > 0:
        s.material["transmission_dispersion_scale"] = min(scale, 1.0)
        s.material["transmission_dispersion_abbe_number"] = min(abbe, LARGEST)


def emission(s: Inputs, strength: str, nits: float) -> None:
    """A luminance, `strength` times `nits`, and a colour, which is left out where nothing shines."""
    found = s.constant(strength)
    if found is None:
        s.put("emission_luminance", strength, constant(1 / NITS))
        light = times(s.tree("emission_color"), times(s.tree(strength), nits * NITS))
        s.put("emission_color", "emission_color", light, instead=s.tree("emission_color"))
        return
    s.put("emission_luminance", strength, constant(found[0] * nits), 0.0)
    if s.is_given("emission_color"):
        s.put("emission_color", "emission_color", s.tree("emission_color"))
