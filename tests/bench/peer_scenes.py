"""The scenes of `peers`: ours, and the same in Mitsuba's words."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from service.bench.scenes import MESH, SOFT_SUN, STUDIO, BenchAssets
from service.document import presets
from service.document.transform import Transform

Document = dict[str, Any]


@dataclass(frozen=True)
class PeerCase:
    name: str
    scene: Document
    max_bounces: int

    @property
    def is_textured(self) -> bool:
        """Textures are not put in Blender's words."""
        return "textures" in self.scene


def cases() -> list[PeerCase]:
    return [
        PeerCase("rough sphere, HDR image", _sphere({"roughness": 0.7}), 8),
        PeerCase("metal sphere r=.1, HDR image", _sphere({"roughness": 0.1, "metallic": 1}), 8),
        PeerCase("Cornell box, depth 4", presets.get("scenes", "cornell-boxes"), 4),
        PeerCase("Cornell box, depth 8", presets.get("scenes", "cornell-boxes"), 8),
        PeerCase("glass sphere on a floor", _glass(), 8),
        PeerCase("glass on a checker, wide soft sun", _glass_on_checker(), 8),
        PeerCase("74k mesh on a plane, HDR image", _mesh(), 8),
    ]


def _base(camera: Document) -> Document:
    return {"version": 1, "camera": camera, "environment": presets.get("environments", STUDIO)}


def _principled(parameters: Document) -> Document:
    return {"type": "principled", "base_color": [0.8, 0.5, 0.3], **parameters}


def _sphere(parameters: Document) -> Document:
    return _base({"position": [0, 0, 4], "target": [0, 0, 0], "vfov": 40}) | {
        "materials": {"subject": _principled(parameters)},
        "shapes": [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "subject"}],
    }


def _ground() -> Document:
    return {"type": "quad", "origin": [-10, 0, 10], "u": [20, 0, 0], "v": [0, 0, -20], "material": "ground"}


def _glass() -> Document:
    glass = {"type": "principled", "base_color": 1, "transmission": 1, "roughness": 0, "ior": 1.5}
    return _base({"position": [0, 1.6, 4.2], "target": [0, 0.9, 0], "vfov": 40}) | {
        "materials": {"subject": glass, "ground": {"type": "diffuse", "albedo": 0.5}},
        "shapes": [{"type": "sphere", "center": [0, 1, 0], "radius": 1, "material": "subject"}, _ground()],
    }


def _glass_on_checker() -> Document:
    scene = _glass()
    scene["environment"] = {"type": "image", "asset": SOFT_SUN}
    scene["textures"] = {"tiles": {"type": "checker", "a": 0.75, "b": 0.1, "scale": [20, 20]}}
    scene["materials"]["ground"] = {"type": "diffuse", "albedo": {"texture": "tiles"}}
    return scene


def _mesh() -> Document:
    return _base({"position": [0, 1.6, 4.2], "target": [0, 0.9, 0], "vfov": 40}) | {
        "materials": {"subject": _principled({"roughness": 0.4}), "ground": {"type": "diffuse", "albedo": 0.5}},
        "shapes": [{"type": "mesh", "asset": MESH, "material": "subject"}, _ground()],
    }


def for_mitsuba(case: PeerCase, size: int) -> tuple[Document, dict[str, np.ndarray]]:
    """The scene in plain JSON for `peer_mitsuba`, and the arrays that it names."""
    document, assets = case.scene, BenchAssets()
    arrays: dict[str, np.ndarray] = {}
    camera = document["camera"]
    scene: Document = {
        "type": "scene",
        # Ours counts scattering events, theirs segments.
        "integrator": {"type": "path", "max_depth": case.max_bounces + 1, "rr_depth": 5},
        "sensor": {
            "type": "perspective",
            "fov": camera["vfov"],
            "fov_axis": "y",
            "to_world": {"matrix": _looking(camera["position"], camera["target"])},
            "film": {
                "type": "hdrfilm",
                "width": size,
                "height": size,
                "rfilter": {"type": "box"},
                "pixel_format": "rgb",
            },
            "sampler": {"type": "independent"},
        },
    }
    textures = document.get("textures", {})
    bsdfs = {name: _bsdf(material, textures) for name, material in document["materials"].items()}
    if "environment" in document:
        arrays["environment"] = assets.image(document["environment"]["asset"]).pixels[..., :3].astype(np.float32)
        # Their middle column looks along +Z, ours along -Z.
        half_turn = np.diag([-1.0, 1.0, -1.0, 1.0]).ravel().tolist()
        scene["environment"] = {"type": "envmap", "bitmap_array": "environment", "to_world": {"matrix": half_turn}}
    for i, shape in enumerate(document["shapes"]):
        emission = document["materials"][shape["material"]].get("emission")
        made = _shape(shape, bsdfs[shape["material"]])
        if emission is not None:
            made["emitter"] = {"type": "area", "radiance": _rgb(emission)}
        scene[f"shape{i}"] = made
        if shape["type"] == "mesh":
            mesh = assets.mesh(shape["asset"])
            arrays |= {"vertices": mesh.vertices, "faces": mesh.faces, "normals": np.asarray(mesh.normals)}
    return scene, arrays


def _looking(position: list[float], target: list[float]) -> list[float]:
    """Their camera looks along its +Z with +X to the left."""
    forward = np.subtract(target, position).astype(float)
    forward /= np.linalg.norm(forward)
    left = np.cross([0.0, 1.0, 0.0], forward)
    left /= np.linalg.norm(left)
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2], matrix[:3, 3] = left, np.cross(forward, left), forward, position
    return [float(x) for x in matrix.ravel()]


def _rgb(color: Any) -> Document:
    return {"type": "rgb", "value": list(np.broadcast_to(color, 3).astype(float))}


def _checker(texture: Document) -> Document:
    """Their pattern repeats after two fields, as ours does after two units of the scaled coordinates."""
    scale = np.diag([*(s / 2 for s in texture["scale"]), 1.0, 1.0])
    colors = {"color0": _rgb(texture["a"]), "color1": _rgb(texture["b"])}
    return {"type": "checkerboard", **colors, "to_uv": {"matrix": scale.ravel().tolist()}}


def _bsdf(material: Document, textures: Document) -> Document:
    if material["type"] == "diffuse":
        albedo = material["albedo"]
        reflectance = _checker(textures[albedo["texture"]]) if isinstance(albedo, dict) else _rgb(albedo)
        return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": reflectance}}
    if material.get("transmission"):
        return {"type": "dielectric", "int_ior": material["ior"], "ext_ior": 1.0}
    return {
        "type": "principled",
        "base_color": _rgb(material["base_color"]),
        "roughness": material["roughness"],
        "metallic": float(material.get("metallic", 0)),
        "specular": 0.5,
    }


def _shape(shape: Document, bsdf: Document) -> Document:
    """A sphere, parallelogram, box or the one mesh, in Mitsuba's words."""
    if shape["type"] == "sphere":
        return {"type": "sphere", "center": shape["center"], "radius": shape["radius"], "bsdf": bsdf}
    if shape["type"] == "mesh":
        return {"type": "arrays", "bsdf": bsdf}
    matrix = np.eye(4)
    if shape["type"] == "quad":  # theirs spans -1 to 1 about the middle
        u, v = np.array(shape["u"], float) / 2, np.array(shape["v"], float) / 2
        normal = np.cross(u, v)
        matrix[:3, :3] = np.stack([u, v, normal / np.linalg.norm(normal)], axis=1)
        matrix[:3, 3] = np.array(shape["origin"], float) + u + v
        kind = "rectangle"
    else:
        low, high = np.array(shape["min"], float), np.array(shape["max"], float)
        matrix[:3, :3], matrix[:3, 3] = np.diag((high - low) / 2), (low + high) / 2
        matrix = Transform(**shape.get("transform", {})).matrix4() @ matrix
        kind = "cube"
    return {"type": kind, "bsdf": bsdf, "to_world": {"matrix": [float(x) for x in matrix.ravel()]}}
