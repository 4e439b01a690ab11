"""Surfaces of MaterialX, as parameters of `principled`: constants and images are read, what other nodes compute is
listed as lost [Autodesk Standard Surface 1.0.1; OpenPBR Surface 1.1.1]."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from service.document.numbers import LARGEST
from service.formats.read.usd.material_reader import Reader

NITS = 1 / 683  # watts of a lumen
WHITE = (1.0, 1.0, 1.0)
HALF = 0.5  # a film that covers so much is nearer to a whole one than to none
THICKEST, MICROMETRE = 1e4, 1e3  # nm
RADIUS_SCALE = (1.0, 0.5, 0.25)  # of OpenPBR's own


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
    film: tuple[str, str, float, str | None]  # thickness, index and its default, weight
    thin: str
    scattered: tuple[str, str, float]  # the weight of what is scattered inside, its colour and that one's default
    emission: tuple[str, float, float]  # strength, its default, and the radiance of 1
    opacity: str
    normal: str
    anisotropy: str
    lost: tuple[tuple[str, float, str], ...]  # parameter, the value that does nothing, what is not supported


STANDARD = Names(
    "base", "base_color", (0.8,) * 3, "metalness", ("specular_roughness", 0.2), "specular", "specular_color",
    "specular_IOR", "transmission", "coat", ("coat_roughness", 0.1), "coat_normal",
    ("sheen", "sheen_color", "sheen_roughness", 0.3), ("thin_film_thickness", "thin_film_IOR", 1.5, None),
    "thin_walled", ("subsurface", "subsurface_color", 1.0), ("emission", 0.0, 1.0), "opacity", "normal",
    "specular_anisotropy",
    (
        ("diffuse_roughness", 0.0, "a rough diffuse base"), ("transmission_scatter", 0.0, "scattering inside"),
        ("coat_color", 1.0, "a coloured coat"), ("coat_anisotropy", 0.0, "an anisotropic coat"),
    ),
)  # fmt: skip
OPEN_PBR = Names(
    "base_weight", "base_color", (0.8,) * 3, "base_metalness", ("specular_roughness", 0.3), "specular_weight",
    "specular_color", "specular_ior", "transmission_weight", "coat_weight", ("coat_roughness", 0.0),
    "geometry_coat_normal", ("fuzz_weight", "fuzz_color", "fuzz_roughness", 0.5),
    ("thin_film_thickness", "thin_film_ior", 1.4, "thin_film_weight"), "geometry_thin_walled",
    ("subsurface_weight", "subsurface_color", 0.8), ("emission_luminance", 0.0, NITS), "geometry_opacity",
    "geometry_normal", "specular_roughness_anisotropy",
    (
        ("base_diffuse_roughness", 0.0, "a rough diffuse base"), ("transmission_scatter", 0.0, "scattering inside"),
        ("coat_color", 1.0, "a coloured coat"), ("coat_roughness_anisotropy", 0.0, "an anisotropic coat"),
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
    _scattered(read, names, out)
    _film(read, names, out)
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
    if is_thin := read.constant(names.thin, 0.0) > 0:
        out["thin_walled"] = True
    share = read.scalar(names.transmission, 0.0)
    if not share:
        return
    out["transmission"] = share
    _disperse(read, names, out)
    depth = 0.0 if is_thin else read.constant("transmission_depth", 0.0, 1e9) * read.unit
    color = read.color("transmission_color", WHITE)
    if depth > 0 and isinstance(color, list):
        out["attenuation_distance"], out["attenuation_color"] = min(max(depth, 1e-9), 1e9), color
        out["base_color"] = list(WHITE) if share == 1 else out["base_color"]
    elif share == 1:
        out["base_color"] = color
    elif color != list(WHITE):
        place = read.surface.at("transmission_color")
        read.notes.add(place, "a tint of the transmission alone is not supported; that of the base is used")


def _disperse(read: Reader, names: Names, out: dict[str, Any]) -> None:
    """By an Abbe number, or by one and the share of the dispersion that it stands for."""
    if names is STANDARD:
        abbe, share = read.constant("transmission_dispersion", 0.0, LARGEST), 1.0
    else:
        abbe = read.constant("transmission_dispersion_abbe_number", 20.0, LARGEST)
        share = read.constant("transmission_dispersion_scale", 0.0)
    if abbe > 0 and share > 0:
        out["abbe"] = min(abbe / share, LARGEST)


def _scattered(read: Reader, names: Names, out: dict[str, Any]) -> None:
    """Of light that is scattered inside, what leaves a thin wall on its other side: all of it in Standard Surface,
    half of it in OpenPBR, more where it goes forwards; the rest comes back."""
    weight, color, default = names.scattered
    share = read.constant(weight, 0.0) if read.surface.has(weight) else 0.0
    if share == 0:
        return
    if "thin_walled" not in out:
        _below(read, names, share, read.color(color, (default,) * 3), out)
        return
    forwards = 1.0
    if names is OPEN_PBR:
        forwards = 0.5 + 0.5 * read.constant("subsurface_scatter_anisotropy", 0.0, 1.0, -1.0)
    through, own = share * forwards, read.color(color, (default,) * 3)
    out["diffuse_transmission"], out["diffuse_transmission_color"] = through, own
    if through == share:
        return
    back, base = (share - through) / (1 - through), out["base_color"]
    if isinstance(own, list) and isinstance(base, list):
        out["base_color"] = [a + back * (b - a) for a, b in zip(base, own, strict=True)]
    else:
        detail = "of a wall with a texture the colour that comes back is that of the base"
        read.notes.add(read.surface.at(color), detail)


def _below(read: Reader, names: Names, share: float, own: Any, out: dict[str, Any]) -> None:
    """Light walks below the surface of a body. What does not walk has the same colour here."""
    if names is OPEN_PBR:
        radius, scale = read.constant("subsurface_radius", 1.0, LARGEST), "subsurface_radius_scale"
        radii = [radius * each for each in read.constants(scale, RADIUS_SCALE, 1.0)]
    else:
        factor = read.constant("subsurface_scale", 1.0, LARGEST)
        radii = [factor * each for each in read.constants("subsurface_radius", WHITE, LARGEST)]
    out["subsurface"], out["subsurface_radius"] = share, [min(each * read.unit, LARGEST) for each in radii]
    base = out["base_color"]
    if base == own:
        return
    if isinstance(own, list) and isinstance(base, list):
        out["base_color"] = [a + share * (b - a) for a, b in zip(base, own, strict=True)]
    elif share >= HALF:
        out["base_color"] = own
    if share < 1:
        detail = "the light that walks below the surface and the light that does not have one colour here"
        read.notes.add(read.surface.at(names.scattered[1]), detail)


def _film(read: Reader, names: Names, out: dict[str, Any]) -> None:
    """A thin film, in nanometres in Standard Surface and in micrometres in OpenPBR. Ours covers all or nothing."""
    thickness, ior, default, weight = names.film
    share, unit, own = (1.0, 1.0, 0.0) if weight is None else (read.constant(weight, 0.0), MICROMETRE, 0.5)
    if weight is not None and 0 < share < 1:
        how = "covers all" if share >= HALF else "is left out"
        detail = f"a film that covers a part of the surface is not supported; of {share:g} it {how}"
        read.notes.add(read.surface.at(weight), detail)
    found = read.scalar(thickness, own, THICKEST / unit) if share >= HALF else 0.0
    if found:
        is_texture = isinstance(found, dict)
        out["film_thickness"] = scaled(found, unit) if is_texture else round(found * unit, 6)
        out["film_ior"] = read.constant(ior, default, 4.0, 1.0)


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
