"""A scene for each flag of the kernels, which needs what the flag stands for."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from gpu.layout.microfacet_records import PLAIN, TERMS
from service.formats import AssetLimits, MeasuredData
from service.formats.read.measured.adaptive import parse_adaptive
from service.formats.read.measured.merl import parse_merl
from tests import measured_files
from tests.extremes.scenes import ball, icosphere, quad
from tests.rendering import Images, document

Doc = dict[str, Any]
RNG = np.random.default_rng(4)


class Shelf(Images):
    """Images, and measurements."""

    def measured(self, ref: str) -> MeasuredData:
        return {"merl": _merl, "bright": _bright, "rgl": _rgl}[ref]()


@cache
def _merl() -> MeasuredData:
    return parse_merl(measured_files.merl(measured_files.Facets()))


@cache
def _bright() -> MeasuredData:
    return parse_merl(measured_files.merl(measured_files.Facets(diffuse=(1.5, 0.8, 0.1))))


@cache
def _rgl() -> MeasuredData:
    arrays = measured_files.adaptive(measured_files.Facets(alpha=(0.5, 0.5)), thetas=4, side=8, fine=16)
    return parse_adaptive(measured_files.tensor_file(arrays), AssetLimits())


IMAGES = Shelf(
    bytes=RNG.integers(0, 256, (4, 4, 3)).astype(np.uint8), floats=RNG.random((4, 8, 3)).astype(np.float32),
    face=RNG.random((4, 4, 3)).astype(np.float32),
)  # fmt: skip
FLOOR = quad("m", (-4, -1, 4), (8, 0, 0), (0, 0, -8))
SKY = {"type": "constant", "radiance": 0.5}
MESH = {**icosphere("m", 0), "smooth": False}
SMALL = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
TRIANGLE = {"type": "mesh", "vertices": SMALL, "faces": [[0, 1, 2]], "smooth": False, "material": "m"}
ODD = {"transform": {"scale": [1, 0.5, 0.7]}}
BOX = {"type": "box", "min": [-1, -1, -1], "max": [1, 1, 1], "material": "m"}
DISK = {"type": "disk", "center": [0, -1, 0], "normal": [0, 1, 0], "radius": 4, "material": "m"}
CYLINDER = {"type": "cylinder", "base": [0, -1, 0], "axis": [0.3, 2, 0.5], "radius": 0.6, "material": "m"}
SUN = {"type": "directional", "direction": [0, -1, 0], "irradiance": 1}
GLTF = {"type": "metal_rough", "base_color": 0.5, "metallic": 0.5, "roughness": 0.5}
PHONG = {"type": "blinn_phong", "diffuse": 0.4, "specular": 0.4, "shininess": 20}
GLASS = {"type": "principled", "transmission": 1, "roughness": 0.2}

LAMP_OF_NO_EXTENT = {"type": "point", "position": [0, 3, 2], "intensity": 20}


def many(shape: Doc) -> list[Doc]:
    return [{**shape, "transform": {"translate": [i - 15, 0, -i], "scale": [0.3, 0.2, 0.3]}} for i in range(30)]


def lit(*shapes: Doc, **more: Any) -> Doc:
    return document(list(shapes) or [FLOOR], environment=SKY, **more)


def made_of(material: Doc, *shapes: Doc, **more: Any) -> Doc:
    return lit(*(shapes or [ball("m"), FLOOR]), materials={"m": material}, **more)


def filled(medium: Doc) -> Doc:
    clear = {"type": "principled", "transmission": 1, "roughness": 0.3, "ior": 1.2}
    return made_of(clear, {**ball("m"), "medium": medium}, FLOOR)


def textured(material: Doc, *shapes: Doc, **texture: Any) -> Doc:
    image = {} if "type" in texture else {"asset": "bytes"}
    return made_of({"type": "principled", **material}, *shapes, textures={"t": {**image, **texture}})


T = {"texture": "t"}
NOISE = {"type": "noise", "scale": [0.8, 0.8, 0.8], "octaves": 2}
RAMP = {"type": "ramp", "stops": [{"position": 0, "color": 0.2}, {"position": 1, "color": [0.9, 0.4, 0.1]}]}
MICROFACET = {"type": "microfacet", "conductor_eta": [0.2, 0.4, 1.4], "conductor_k": 2}
LAMP = {"type": "diffuse", "albedo": 0, "emission": 3}
SCENES: dict[str, Doc] = {
    "SPHERES": lit(ball("m")), "QUADS": lit(), "BOXES": lit(BOX), "ELLIPSOIDS": lit(ball("m", **ODD)),
    "TRIANGLES": lit(TRIANGLE), "VAST_SPHERES": lit(ball("m", (0, -1e5, 0), 1e5), ball("m")),
    "BVH": lit(MESH), "BVH_TRIANGLES": lit(MESH),
    "BVH_SPHERES": lit(*[ball("m", (i, 0, -i), 0.4) for i in range(30)]),
    "BVH_ELLIPSOIDS": lit(*many(ball("m"))), "BVH_BOXES": lit(*many(BOX)), "BVH_QUADS": lit(*many(FLOOR)),
    "DISKS": lit(DISK), "CYLINDERS": lit(CYLINDER),
    "SINGLE_SIDED": lit({**TRIANGLE, "double_sided": False}), "SMOOTH_NORMALS": lit(icosphere("m", 1)),
    "HIDDEN_SHAPES": lit(FLOOR, ball("m", visible_to_camera=False)),
    "OPACITY": made_of({"type": "diffuse", "albedo": 0.5, "alpha": 0.5}), "TEXTURES": textured({"base_color": T}),
    "BYTE_TEXELS": textured({"roughness": T}), "FLOAT_TEXELS": textured({"base_color": T}, asset="floats"),
    "SRGB_TEXELS": textured({"base_color": T}),
    "CHECKERS": made_of({"type": "diffuse", "albedo": T}, textures={"t": {"type": "checker", "a": 0, "b": 1}}),
    "NOISES": textured({"base_color": T}, **NOISE, space="uv"),
    "SOLID_TEXTURES": textured({"base_color": T}, **NOISE),
    "RAMPS": textured({"base_color": T}, **RAMP),
    "PROJECTIONS": textured({"base_color": T}, TRIANGLE, ball("m"), FLOOR, mapping="box"),
    "UVS": textured({"base_color": T}, {**TRIANGLE, "uvs": [[0, 0], [1, 0], [0, 1]]}),
    "VERTEX_COLORS": lit({**TRIANGLE, "colors": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}),
    "NORMAL_MAPS": textured({"normal_map": T}, color_space="linear"),
    "HEIGHTS": textured({"height": T}, {**TRIANGLE, "uvs": [[0, 0], [1, 0], [0, 1]]}, ball("m"), FLOOR),
    "COAT_NORMALS": textured({"clearcoat": 1, "clearcoat_normal_map": T}, color_space="linear"),
    "EMISSION": made_of(LAMP), "EMISSION_BOTH": made_of({**LAMP, "emission_sides": "both"}),
    "LAYERED_LIGHTS": made_of({"type": "principled", "base_color": 0, "emission": 1, "clearcoat": 1}),
    "SPHERE_LIGHTS": made_of(LAMP, ball("m")), "QUAD_LIGHTS": made_of(LAMP, FLOOR),
    "TRIANGLE_LIGHTS": made_of(LAMP, TRIANGLE), "ELLIPSOID_LIGHTS": made_of(LAMP, ball("m", **ODD)),
    "CYLINDER_LIGHTS": made_of(LAMP, CYLINDER),
    "LIGHTS": lit(), "MANY_LIGHTS": lit(lights=[{"type": "point", "position": [0, 2, 0], "intensity": 4}]),
    "LIGHT_TREE": lit(lights=[{"type": "point", "position": [i, 2, 0], "intensity": 4} for i in range(9)]),
    "POINT_LIGHTS": lit(lights=[{"type": "point", "position": [0, 2, 0], "intensity": 4}]),
    "SPOT_LIGHTS": lit(lights=[{"type": "spot", "position": [0, 2, 0], "direction": [0, -1, 0], "intensity": 4,
                                "inner_angle": 20, "outer_angle": 30}]),
    "DIRECTIONAL_LIGHTS": lit(lights=[SUN]), "SUN_DISKS": lit(lights=[{**SUN, "angular_diameter": 1}]),
    "ENVIRONMENT": lit(),
    "SUN": document([FLOOR], environment={"type": "sky", "sun_elevation": 30, "sun_azimuth": 0}),
    "ENVIRONMENT_IMAGE": document([FLOOR], environment={"type": "image", "asset": "floats"}),
    "ENVIRONMENT_CUBE": document([FLOOR], environment={"type": "cubemap", "assets": {
        f"{sign}{axis}": "face" for axis in "xyz" for sign in "pn"}}),
    "ORTHOGRAPHIC": lit(camera={"position": [0, 0, 4], "target": [0, 0, 0], "type": "orthographic", "height": 3}),
    "PANORAMA": lit(camera={"position": [0, 0, 4], "target": [0, 0, 0], "type": "panorama"}),
    "OPENPBR": made_of({"type": "openpbr", "specular_roughness": 0}),
    "OPENPBR_LOBES": made_of({"type": "openpbr"}),
    "DIFFUSE_ROUGHNESS": made_of({"type": "openpbr", "base_diffuse_roughness": 0.5}),
    "APERTURE": lit(camera={"position": [0, 0, 4], "target": [0, 0, 0], "aperture_radius": 0.1}),
    "DISNEY": made_of({"type": "disney"}), "SUBSURFACE": made_of({"type": "disney", "subsurface": 1}),
    "SHEEN": made_of({"type": "disney", "sheen": 1}), "ANISOTROPIC": made_of({"type": "disney", "anisotropic": 1}),
    "TANGENTS": made_of({"type": "disney", "anisotropic": 1}, icosphere("m", 1)),
    "CLEARCOAT": made_of({"type": "disney", "clearcoat": 1}), "METAL_ROUGH": made_of(GLTF),
    "BLINN_PHONG": made_of(PHONG), "PHONG": made_of({**PHONG, "type": "phong"}),
    "AMBIENT": made_of({**PHONG, "ambient": 0.1}),
    "MICROFACET": made_of(MICROFACET), "MICROFACET_TABLES": made_of({**MICROFACET, "distribution": "abc"}),
    **{f"MICROFACET_{kind}_{e.name}".upper(): made_of({**MICROFACET, kind: e.name.lower()})
       for kind, terms in TERMS.items() for e in terms if PLAIN.get(kind) != e},
    "MEASURED": made_of({"type": "measured", "asset": "merl"}),
    "MEASURED_ANGLES": made_of({"type": "measured", "asset": "merl"}),
    "MEASURED_LIMITS": made_of({"type": "measured", "asset": "bright"}),
    "MEASURED_ADAPTIVE": made_of({"type": "measured", "asset": "rgl"}),
    "PRINCIPLED": made_of({"type": "principled"}), "PRINCIPLED_LOBES": made_of({"type": "principled"}),
    "FILM": made_of({"type": "principled", "film_thickness": 300}),
    "METAL_FILM": made_of({"type": "principled", "film_thickness": 300, "metallic": 1}),
    "CONDUCTOR": made_of({"type": "principled", "metallic": 1, "conductor_eta": [0.2, 0.4, 1.4], "conductor_k": 2}),
    "TRANSMISSION": made_of(GLASS), "MIRRORS": made_of({**GLASS, "roughness": 0}),
    "CAUSTICS": made_of({**GLASS, "roughness": 0}, lights=[LAMP_OF_NO_EXTENT]),
    "SHARP_CAUSTICS": made_of({**GLASS, "roughness": 0}, lights=[LAMP_OF_NO_EXTENT]),
    "DISPERSION": made_of({**GLASS, "abbe": 30}),
    "THIN_WALLS": made_of({**GLASS, "thin_walled": True}),
    "STRAIGHT": made_of({**GLASS, "thin_walled": True, "roughness": 0}),
    "ATTENUATION": made_of({**GLASS, "attenuation_color": [0.5, 0.8, 0.9], "attenuation_distance": 1}),
    "MEDIA": filled({"absorption": 1}),
    "PRIORITIES": made_of(GLASS, {**ball("m"), "priority": 1}, FLOOR),
    "SCATTERING": filled({"scattering": 2}),
    "WALKS": made_of({"type": "principled", "subsurface": 1, "subsurface_radius": 0.2}),
    "GLOWING_MEDIA": filled({"emission": 1}),
}  # fmt: skip
