"""Surfaces of MaterialX, as parameters of `principled`: constants and images are read, what other nodes compute is
listed as lost [Autodesk Standard Surface 1.0.1; OpenPBR Surface 1.1.1]."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from service.assets.usd.material_reader import Reader

NITS = 1 / 683  # watts of a lumen
WHITE = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class Names:
    """What a model calls its parameters, and which value of each is its default."""

    weight: str
    color: str
    default: tuple[float, ...]
    metalness: str
    roughness: tuple[str, float]
    specular: str
    specular_color: str
    ior: str
    transmission: str
    coat: str
    coat_roughness: tuple[str, float]
    coat_normal: str
    sheen: tuple[str, str, str, float]  # weight, colour, roughness and the latter's default
    emission: tuple[str, float, float]  # strength, its default, and the radiance of 1
    opacity: str
    normal: str
    anisotropy: str
    lost: tuple[tuple[str, float, str], ...]  # parameter, the value that does nothing, what is not supported


STANDARD = Names(
    "base", "base_color", (0.8,) * 3, "metalness", ("specular_roughness", 0.2), "specular", "specular_color",
    "specular_IOR", "transmission", "coat", ("coat_roughness", 0.1), "coat_normal",
    ("sheen", "sheen_color", "sheen_roughness", 0.3), ("emission", 0.0, 1.0), "opacity", "normal",
    "specular_anisotropy",
    (
        ("subsurface", 0.0, "subsurface scattering"), ("thin_film_thickness", 0.0, "a thin film"),
        ("diffuse_roughness", 0.0, "a rough diffuse base"), ("transmission_scatter", 0.0, "scattering inside"),
        ("transmission_dispersion", 0.0, "dispersion"), ("coat_color", 1.0, "a coloured coat"),
        ("coat_anisotropy", 0.0, "an anisotropic coat"), ("thin_walled", 0.0, "a thin wall"),
    ),
)  # fmt: skip
OPEN_PBR = Names(
    "base_weight", "base_color", (0.8,) * 3, "base_metalness", ("specular_roughness", 0.3), "specular_weight",
    "specular_color", "specular_ior", "transmission_weight", "coat_weight", ("coat_roughness", 0.0),
    "geometry_coat_normal", ("fuzz_weight", "fuzz_color", "fuzz_roughness", 0.5),
    ("emission_luminance", 0.0, NITS), "geometry_opacity", "geometry_normal", "specular_roughness_anisotropy",
    (
        ("subsurface_weight", 0.0, "subsurface scattering"), ("thin_film_weight", 0.0, "a thin film"),
        ("base_diffuse_roughness", 0.0, "a rough diffuse base"), ("transmission_scatter", 0.0, "scattering inside"),
        ("transmission_dispersion_scale", 0.0, "dispersion"), ("coat_color", 1.0, "a coloured coat"),
        ("coat_roughness_anisotropy", 0.0, "an anisotropic coat"), ("geometry_thin_walled", 0.0, "a thin wall"),
    ),
)  # fmt: skip
SURFACES = {"ND_standard_surface_surfaceshader": STANDARD, "ND_open_pbr_surface_surfaceshader": OPEN_PBR}


def materialx_surface(read: Reader) -> dict[str, Any]:
    """The material's document."""
    surface = read.surface
    names = SURFACES[surface.kind]
    out: dict[str, Any] = {"type": "principled"}
    weight = read.constant(names.weight, 1.0)
    out["base_color"] = scaled(read.color(names.color, names.default), weight)
    out["roughness"] = read.scalar(*names.roughness)
    _set(out, "metallic", read.scalar(names.metalness, 0.0), 0.0)
    _set(out, "anisotropic", read.scalar(names.anisotropy, 0.0), 0.0)
    _specular(read, names, out)
    _transmission(read, names, out)
    coat = read.scalar(names.coat, 0.0)
    if coat:
        out["clearcoat"] = coat
        out["clearcoat_roughness"] = read.scalar(*names.coat_roughness)
    sheen = read.scalar(names.sheen[0], 0.0)
    if sheen:
        out["sheen"] = sheen
        out["sheen_color"] = read.color(names.sheen[1], WHITE)
        out["sheen_roughness"] = read.scalar(*names.sheen[2:])
    strength = read.constant(names.emission[0], names.emission[1], 1e20) * names.emission[2]
    if strength:
        out["emission"] = scaled(read.color("emission_color", WHITE, 1e20), strength, 1e20)
    alpha = read.scalar(names.opacity, 1.0)
    _set(out, "alpha", alpha, 1.0)
    for parameter, name in (("normal_map", names.normal), ("clearcoat_normal_map", names.coat_normal)):
        found = read.normal(name)
        if found is not None:
            out[parameter] = found
    for name, neutral, what in names.lost:
        if surface.has(name) and set(surface.numbers(name, (neutral,) * 3)) != {neutral}:
            read.notes.add(surface.at(name), f"{what} is not supported and is left out")
    return out


def _specular(read: Reader, names: Names, out: dict[str, Any]) -> None:
    """The weight scales the reflectance head-on; the index that has the scaled one takes its place."""
    ior, weight = read.constant(names.ior, 1.5, 4.0, 1.0), read.constant(names.specular, 1.0)
    root = (ior - 1) / (ior + 1) * weight**0.5
    shown = (1 + root) / (1 - root)
    _set(out, "ior", round(shown, 6), 1.5)
    color = read.color(names.specular_color, WHITE)
    if color != list(WHITE):
        out["specular_color"] = color


def _transmission(read: Reader, names: Names, out: dict[str, Any]) -> None:
    """Glass: its colour tints at once, or over a depth."""
    share = read.scalar(names.transmission, 0.0)
    if not share:
        return
    out["transmission"] = share
    depth = read.constant("transmission_depth", 0.0, 1e9)
    color = read.color("transmission_color", WHITE)
    if depth > 0 and isinstance(color, list):
        out["attenuation_distance"], out["attenuation_color"] = max(depth, 1e-9), color
        out["base_color"] = list(WHITE) if share == 1 else out["base_color"]
    elif share == 1:
        out["base_color"] = color
    elif color != list(WHITE):
        place = read.surface.at("transmission_color")
        read.notes.add(place, "a tint of the transmission alone is not supported; that of the base is used")


def scaled(value: Any, factor: float, most: float = 1.0) -> Any:
    """A colour or a reference to a texture, times a number."""
    if factor == 1:
        return value
    if isinstance(value, dict):
        before = value.get("factor", 1.0)
        more = [each * factor for each in before] if isinstance(before, list) else before * factor
        return {**value, "factor": more}
    return [min(each * factor, most) for each in value]


def _set(out: dict[str, Any], name: str, value: Any, default: float) -> None:
    if value != default:
        out[name] = value
