"""Conversions between `openpbr` and models that say the same in other words: the parts that no common name carries.

Each function changes `made` and gives the names of `old` that it made use of.
"""

from __future__ import annotations

from typing import Any

from service.document.color import color
from service.document.numbers import BRIGHTEST, LARGEST, rounded

Document = dict[str, Any]

NITS = 683.0  # cd/m^2 of 1 W/(m^2 sr) in the middle of the eye's sensitivity
BASE_IOR, COAT_IOR = 1.5, 1.5  # of other models
ABBE = 20.0  # where a document has none
STRETCH = 0.9  # what `anisotropic` of other models is in OpenPBR: a ratio of alphas of 1 to 10 at 1
FILM = 0.5  # um, the default of `thin_film_thickness`
THICKEST = 1e4  # nm, of other models' films
GLOSS = (0.1, 0.001)  # alpha of a coat without and with gloss
_linear = color(BRIGHTEST)


def take(old: Document, made: Document) -> set[str]:
    """Into `made`, an `openpbr`."""
    used = set()
    if "emission" in old:
        used |= _shine(old["emission"], made)
    if isinstance(old.get("specular"), int | float) and "ior" not in old:
        made["specular_weight"] = rounded(2 * old["specular"], 4)  # 0.08 `specular` of the reflectance of index 1.5
        used.add("specular")
    if _is_number(made.get("specular_roughness_anisotropy")):
        made["specular_roughness_anisotropy"] = rounded(STRETCH * made["specular_roughness_anisotropy"], 4)
    if "transmission" in old and "base_color" in old:
        made["transmission_color"] = old["base_color"]
    if "abbe" in old:
        made |= {"transmission_dispersion_scale": 1, "transmission_dispersion_abbe_number": old["abbe"]}
        used.add("abbe")
    if old.get("subsurface", 0) != 0:
        used |= _walk(old, made)
    film = old.get("film_thickness", 0)
    if isinstance(film, dict) or film > 0:
        made |= {"thin_film_weight": 1, "thin_film_thickness": _scaled(film, 1e-3)}
        used.add("film_thickness")
    if old.get("clearcoat", 0) != 0:
        made |= {"coat_ior": COAT_IOR, "coat_darkening": 0}
        gloss = old.get("clearcoat_gloss", 1.0)
        if "clearcoat_roughness" not in old and _is_number(gloss):
            made["coat_roughness"] = rounded((GLOSS[0] + (GLOSS[1] - GLOSS[0]) * gloss) ** 0.5, 4)
            used.add("clearcoat_gloss")
    return used


def film(old: Document, made: Document) -> set[str]:
    """From `old`, an `openpbr` or of any model without a film, into `made`, which has one in nanometres."""
    weight = old.get("thin_film_weight", 0)
    if weight == 0:
        return {"thin_film_thickness", "thin_film_weight"}
    thickness = _scaled(old.get("thin_film_thickness", FILM), 1e3)
    made["film_thickness"] = min(thickness, THICKEST) if _is_number(thickness) else thickness
    return {"thin_film_thickness"} | ({"thin_film_weight"} if weight == 1 else set())


def _scaled(value: Any, factor: float) -> Any:
    """A number, or a texture, times a factor."""
    if isinstance(value, dict):
        return value | {"factor": rounded(factor * value.get("factor", 1.0), 6)}
    return rounded(factor * value, 6)


def _walk(old: Document, made: Document) -> set[str]:
    """Write a subsurface as that of an `openpbr`; it is flat where it has no radius."""
    if "base_color" in old:
        made["subsurface_color"] = old["base_color"]
    radius = _linear(old["subsurface_radius"]) if old.get("subsurface_radius") is not None else (0.0, 0.0, 0.0)
    longest = max(radius)
    made["subsurface_radius"] = rounded(longest, 6)
    if longest > 0:
        made["subsurface_radius_scale"] = [rounded(x / longest, 6) for x in radius]
    return {"subsurface_radius"}


def _walked(old: Document, made: Document) -> set[str]:
    """Write the subsurface of an `openpbr` as that of another model."""
    names = {name for name in old if name.startswith("subsurface_")}
    if old.get("subsurface_weight", 0) == 0:
        return names
    used = (
        names & {"subsurface_weight", "subsurface_radius", "subsurface_radius_scale"}
        if "subsurface" in made
        else set()
    )
    radius, scale = old.get("subsurface_radius", 1.0), _linear(old.get("subsurface_radius_scale", [1.0, 0.5, 0.25]))
    if "subsurface" in made and radius > 0:
        made["subsurface_radius"] = [rounded(radius * x, 6) for x in scale]
    if old["subsurface_weight"] == 1 and "base_color" in made:
        made["base_color"] = old.get("subsurface_color", 0.8)
        used |= {"subsurface_color"}
    return used | (
        names & {"subsurface_scatter_anisotropy"} if old.get("subsurface_scatter_anisotropy") == 0 else set()
    )


def _shine(emission: Any, made: Document) -> set[str]:
    """Emission as a luminance and a colour of at most 1."""
    if isinstance(emission, dict):  # a texture, whose factor is the colour
        made |= {"emission_luminance": NITS, "emission_color": emission}
        return {"emission"}
    linear = _linear(emission)
    brightest = max(linear)
    if brightest > 0:
        made["emission_luminance"] = rounded(NITS * brightest, 6)
        made["emission_color"] = [rounded(x / brightest, 6) for x in linear]
    return {"emission"}


def leave(old: Document, made: Document) -> set[str]:
    """From `old`, an `openpbr`."""
    used = {"emission_luminance", "emission_color"}
    luminance, shine = old.get("emission_luminance", 0), old.get("emission_color", 1.0)
    if luminance > 0 and isinstance(shine, dict):
        factor = _linear(shine.get("factor", 1.0))
        made["emission"] = shine | {"factor": [rounded(luminance / NITS * x, 6) for x in factor]}
    elif luminance > 0:
        made["emission"] = [rounded(luminance / NITS * x, 6) for x in _linear(shine)]
    weight, base = old.get("base_weight", 1), old.get("base_color", 0.8)
    color_name = next((name for name in ("base_color", "albedo", "diffuse") if name in made), "base_color")
    if _is_number(weight) and not isinstance(base, dict) and color_name in made:
        made[color_name] = [rounded(weight * x, 6) for x in _linear(base)]
        used.add("base_weight")
    if _is_number(made.get("anisotropic")):
        made["anisotropic"] = rounded(min(1.0, made["anisotropic"] / STRETCH), 4)
    if (share := old.get("transmission_dispersion_scale", 0)) > 0:
        made["abbe"] = min(old.get("transmission_dispersion_abbe_number", ABBE) / share, LARGEST)
    used |= {"transmission_dispersion_scale", "transmission_dispersion_abbe_number"}
    used |= _walked(old, made)
    if old.get("specular_weight", 1) == 1 or old.get("base_metalness") == 1:
        used.add("specular_weight")
    if old.get("coat_ior") == COAT_IOR:
        used |= {"coat_ior"}
    if old.get("coat_darkening") == 0:
        used |= {"coat_darkening"}
    return used


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float)
