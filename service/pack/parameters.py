"""The camera, the materials with the terms of `microfacet`, and the environment's rotation: an edit changes these
without packing anything else.
"""

from __future__ import annotations

import math

import numpy as np

from gpu import layout
from gpu.layout import models
from gpu.layout.microfacet_records import TERMS, Distribution, Microfacet
from gpu.tables import microfacet as tables
from service.document import Scene
from service.document.camera import AnyCamera
from service.document.environment import Environment, SkyEnvironment
from service.document.material import Material
from service.document.material.microfacet import MicrofacetMaterial
from service.document.material.surface import SolidSurface
from service.document.numbers import Vec3
from service.document.texture import ColorTexture, ScalarTexture
from service.pack.camera_kinds import fill_camera

# The renderer's names of a material's parameters, where they differ from the document's.
RENAMED = {"albedo": "base_color", "diffuse": "base_color", "alpha": "opacity", "alpha_cutoff": "cutoff"}


RENAMED |= {"abbe": "dispersion", "normal_map": "normal", "clearcoat_normal_map": "coat_normal"}


# Names that mean something else in one model.
RENAMED_IN = {
    "blinn_phong": {"specular": "phong_specular"},
    "phong": {"specular": "phong_specular"},
    "microfacet": {"alpha": "alpha", "f0": "specular_color"},
    "openpbr": {
        "base_diffuse_roughness": "diffuse_roughness",
        "base_metalness": "metallic",
        "specular_weight": "specular",
        "specular_roughness": "roughness",
        "specular_roughness_anisotropy": "anisotropic",
        "specular_ior": "ior",
        "transmission_weight": "transmission",
        "transmission_color": "attenuation_color",
        "transmission_depth": "attenuation_distance",
        "transmission_scatter": "scatter_color",
        "transmission_scatter_anisotropy": "scatter_g",
        "subsurface_weight": "subsurface",
        "subsurface_radius": "",  # in its scale
        "subsurface_radius_scale": "subsurface_radius",
        "subsurface_scatter_anisotropy": "subsurface_g",
        "transmission_dispersion_abbe_number": "dispersion",
        "coat_weight": "clearcoat",
        "coat_roughness": "clearcoat_roughness",
        "coat_roughness_anisotropy": "coat_anisotropy",
        "fuzz_weight": "sheen",
        "fuzz_color": "sheen_color",
        "fuzz_roughness": "sheen_roughness",
        "thin_film_weight": "film_weight",
        "thin_film_thickness": "film_thickness",
        "thin_film_ior": "film_ior",
        "emission_color": "emission",
        "geometry_opacity": "opacity",
        "geometry_thin_walled": "thin_walled",
        "geometry_normal": "normal",
        "geometry_tangent": "anisotropic_rotation",
        "geometry_coat_normal": "coat_normal",
        "geometry_coat_tangent": "coat_rotation",
    },
}
SIDES = {"front": 1, "both": 2}


def pack_camera(camera: AnyCamera, origin: Vec3 = (0.0, 0.0, 0.0)) -> np.void:
    """A `layout.Camera`, relative to `SceneArrays.origin`."""
    position, target = np.array(camera.position, np.float64), np.array(camera.target, np.float64)
    view = target - position
    distance = math.hypot(*view)
    forward = view / distance
    right = np.cross(forward, np.array(camera.up, np.float64) / math.hypot(*camera.up))
    right /= math.hypot(*right)
    out: np.void = np.zeros(1, layout.Camera.dtype)[0]
    out["position"] = position - origin
    out["right"] = right
    out["up"] = np.cross(right, forward)
    out["forward"] = forward
    out["focus_distance"] = distance
    fill_camera(out, camera)
    return out


def pack_materials(scene: Scene) -> np.ndarray:
    """`layout.Material` records in the order of the scene's materials."""
    records = np.zeros(len(scene.materials), layout.Material.dtype)
    records["number"] = np.arange(len(records))
    records["film_weight"] = 1.0  # of models that have no weight
    records["subsurface_radius"] = layout.ABSENT
    for record, material in zip(records, scene.materials.values(), strict=True):
        record["model"] = models.NUMBERS[material.type]
        for name in type(material).model_fields:
            if name == "emission_sides":
                record[name] = SIDES[material.emission_sides]
                continue
            member = member_of(material, name)
            if member in layout.Material.members:
                value = material.value(name)
                if isinstance(value, ScalarTexture | ColorTexture):
                    value = np.where(np.greater(value.factor, 0), layout.TEXTURED, 0)
                record[member] = layout.ABSENT if value is None else value
        for member, value in material.derived().items():
            record[member] = value
        record["opacity"] = opacity(material)
        if isinstance(material, SolidSurface) or material.alpha_cutoff is None:
            record["cutoff"] = layout.ABSENT
        elif isinstance(material.alpha, float) and isinstance(material.alpha_cutoff, float) and material.alpha > 0:
            record["cutoff"] /= material.alpha  # the opacity is 1 or 0 already, and a vertex's alpha a share of that
    return records


def member_of(material: Material, name: str) -> str:
    """The renderer's name of a material's parameter."""
    return RENAMED_IN.get(material.type, {}).get(name, RENAMED.get(name, name))


def has_terms(model: str) -> bool:
    """True if a model, by its name, has a distribution, a geometry and a Fresnel term."""
    return models.BY_NUMBER[models.NUMBERS[model]].has_terms


def opacity(material: Material) -> float:
    """The chance that a ray meets the surface."""
    if isinstance(material, SolidSurface):
        return 1.0
    if isinstance(material.alpha, ScalarTexture):
        return layout.TEXTURED
    if material.alpha_cutoff is None or isinstance(material.alpha_cutoff, ScalarTexture):
        return material.alpha
    return 1.0 if material.alpha >= material.alpha_cutoff else 0.0


def pack_turn(environment: Environment) -> tuple[float, float]:
    """(rotation in radians, factor on the radiance), as `Scene.edit` takes them."""
    degrees = math.fmod(environment.rotation, 360.0)
    if isinstance(environment, SkyEnvironment):  # packed with the sun over -Z; its azimuth turns the other way round
        degrees -= math.fmod(environment.sun_azimuth, 360.0)
    return math.radians(degrees), environment.scale


def vec3(v: np.ndarray) -> Vec3:
    x, y, z = v.tolist()
    return x, y, z


def pack_microfacets(scene: Scene) -> np.ndarray:
    """(n, 4) uint32 as `gpu.layout.microfacet_records` says; empty where no material is of that model."""
    records = np.zeros(len(scene.materials), Microfacet.dtype)
    rows: list[np.ndarray] = []
    first = len(records) * Microfacet.words // 4
    found = False
    for record, material in zip(records, scene.materials.values(), strict=True):
        if isinstance(material, MicrofacetMaterial):
            found = True
            made = _fill(record, material)
            record["table"] = first
            first += sum(map(len, made))
            rows += made
    if not found:
        return np.zeros((0, 4), np.uint32)
    return np.concatenate([part.view(np.uint32).reshape(-1, 4) for part in (records, *rows)])


def _fill(record: np.void, material: MicrofacetMaterial) -> list[np.ndarray]:
    """The rows of the material's table. Sets all members of `record` except the place where the table begins."""
    for kind, terms in TERMS.items():
        record[kind] = terms[getattr(material, kind).upper()]
    record["gamma"], record["diffuse_roughness"] = material.gamma, material.diffuse_roughness
    record["conductor_eta"] = material.conductor_eta or (1.0, 1.0, 1.0)
    record["conductor_k"] = material.conductor_k or (0.0, 0.0, 0.0)
    low, high = record["alpha_low"], record["alpha_high"] = material.alpha_range
    distribution = Distribution[material.distribution.upper()]
    masks = material.geometry.startswith("smith") and distribution not in tables.CLOSED_MASKING
    if not masks and distribution in tables.CLOSED_FACTOR:
        return []
    textured = isinstance(material.alpha, ScalarTexture)
    alphas = tables.row_alphas(distribution, low, high) if textured else [material.alpha]
    rows = [tables.row(distribution, alpha, material.gamma, masks) for alpha in alphas]
    offset = tables.ROW_OFFSETS.get(distribution, 0.0)
    start, end = math.log(low + offset), math.log(high + offset)
    record["rows"], record["row_texels"], record["row_offset"] = len(rows), len(rows[0]), offset
    record["row_start"], record["row_scale"] = start, (len(rows) - 1) / (end - start)
    return rows
