"""One scene with every shape, material and light, and the same scene scaled and moved."""

from __future__ import annotations

import copy
import os
from collections.abc import Sequence
from typing import Any

import numpy as np

from gpu import Picture, Renderer, RenderSettings
from service.document import parse_scene
from service.pack import Packed, pack
from tests.rays import ball_mesh, to_world
from tests.rendering import Images

LONG = bool(os.environ.get("SUNBOX_EXTREMES"))  # every row and more samples: `make extremes`


def rows(few: dict[str, Any], many: dict[str, Any]) -> dict[str, Any]:
    """A table's rows: the few that every run of the tests has time for, and the rest where there is time."""
    return {**few, **many} if LONG else few


def ball(material: str, center: Sequence[float] = (0, 0, 0), radius: float = 1.0, **more: Any) -> dict[str, Any]:
    return {"type": "sphere", "center": list(center), "radius": radius, "material": material, **more}


def quad(material: str, origin: Sequence[float], u: Sequence[float], v: Sequence[float]) -> dict[str, Any]:
    return {"type": "quad", "origin": list(origin), "u": list(u), "v": list(v), "material": material}


def icosphere(material: str, divisions: int = 2, **transform: Any) -> dict[str, Any]:
    out = {**ball_mesh(divisions), "material": material, "smooth": True}
    return {**out, "transform": transform} if transform else out


MATERIALS: dict[str, dict[str, Any]] = {
    "white": {"type": "diffuse", "albedo": 0.7},
    "metal": {"type": "disney", "base_color": [1, 0.8, 0.3], "metallic": 1, "clearcoat": 1, "anisotropic": 0.5},
    "plastic": {"type": "principled", "base_color": [0.2, 0.5, 0.8], "roughness": 0.2, "clearcoat": 0.5,
                "sheen": 0.4},
    "glass": {"type": "principled", "base_color": 1, "transmission": 1, "roughness": 0,
              "attenuation_color": [0.5, 0.8, 0.9], "attenuation_distance": 0.8},
    "frost": {"type": "principled", "base_color": 1, "transmission": 1, "roughness": 0.4},
    "gltf": {"type": "metal_rough", "base_color": [0.8, 0.3, 0.2], "metallic": 0.5, "roughness": 0.4},
    "phong": {"type": "blinn_phong", "diffuse": [0.2, 0.5, 0.2], "specular": 0.4, "shininess": 30, "ambient": 0.02},
    "lamp": {"type": "diffuse", "albedo": 0.2, "emission": [6, 5, 4]},
    "glow": {"type": "diffuse", "albedo": 0.2, "emission": [2, 3, 4], "emission_sides": "both"},
}  # fmt: skip

_TRIANGLE = {"type": "mesh", "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "faces": [[0, 1, 2]], "material": "glow"}
SHAPES: list[dict[str, Any]] = [
    quad("white", (-4, 0, 4), (8, 0, 0), (0, 0, -8)),
    ball("metal", (-1.6, 0.5, 0.3), 0.5),
    ball("plastic", transform={"scale": [0.3, 0.6, 0.4], "translate": [-0.6, 0.6, 0.5], "rotate": [0, 20, 10]}),
    ball("glass", (0.4, 0.5, 1.0), 0.4),
    {"type": "box", "min": [1, 0, 0.2], "max": [1.6, 0.8, 0.8], "material": "gltf"},
    {"type": "box", "min": [-0.3, -0.3, -0.3], "max": [0.3, 0.3, 0.3], "material": "frost",
     "transform": {"translate": [2.2, 0.5, 0.8], "rotate": [20, 30, 40]}},
    icosphere("phong", scale=0.5, translate=[0.3, 0.6, -0.8]),
    {**icosphere("white", scale=0.4, translate=[-1.2, 0.5, -1.2]), "smooth": False},
    quad("lamp", (-1, 3.5, -1), (1.5, 0, 0), (0, 0.2, 1.5)),
    ball("lamp", (2.5, 2, -1.5), 0.3),
    ball("glow", transform={"scale": [0.2, 0.3, 0.1], "translate": [-2.5, 1.5, -0.5]}),
    {**_TRIANGLE, "transform": {"translate": [-3, 1.5, -2]}},
]  # fmt: skip
LIGHTS: list[dict[str, Any]] = [
    {"type": "point", "position": [1, 3, 3], "intensity": 6},
    {"type": "spot", "position": [-2, 3, 2], "direction": [0.5, -1, -0.5], "intensity": 20,
     "inner_angle": 10, "outer_angle": 20},
    {"type": "directional", "direction": [-1, -2, -1], "irradiance": 1, "angular_diameter": 2},
]  # fmt: skip
CAMERA = {
    "position": [0, 1.6, 5.5], "target": [0, 0.6, 0], "vfov": 38, "aperture_radius": 0.02, "focus_distance": 5,
}  # fmt: skip
SKY = {"type": "constant", "radiance": 0.3}


def everything(**changed: Any) -> dict[str, Any]:
    """Every shape, material, light and a thin lens; of the materials those that are used."""
    out = {"version": 1, "camera": CAMERA, "environment": SKY, "lights": LIGHTS, "shapes": SHAPES, **changed}
    used = {shape["material"] for shape in out["shapes"]}
    return copy.deepcopy({**out, "materials": {name: m for name, m in MATERIALS.items() if name in used}})


def placed(shape: dict[str, Any], matrix: np.ndarray) -> dict[str, Any]:
    """The shape under a further transform."""
    return {**shape, "transform": {"matrix": (matrix @ to_world(shape)).ravel().tolist()}}


def scaled(scene: dict[str, Any], factor: float) -> dict[str, Any]:
    """All lengths times `factor`, and light with them, so that the picture stays the same."""
    out = copy.deepcopy(scene)
    for name in ("position", "target"):
        out["camera"][name] = (np.array(out["camera"][name]) * factor).tolist()
    for name in ("aperture_radius", "focus_distance"):
        if name in out["camera"]:
            out["camera"][name] *= factor
    for light in out.get("lights", []):
        if "position" in light:
            light["position"] = (np.array(light["position"]) * factor).tolist()
            light["intensity"] *= factor**2
    for material in out["materials"].values():
        if "attenuation_distance" in material:
            material["attenuation_distance"] *= factor
    out["shapes"] = [placed(s, np.diag([factor, factor, factor, 1.0])) for s in out["shapes"]]
    return out


def moved(scene: dict[str, Any], by: float | Sequence[float]) -> dict[str, Any]:
    """The scene somewhere else, its shapes by their transforms."""
    out, way = copy.deepcopy(scene), np.broadcast_to(np.asarray(by, float), 3)
    for name in ("position", "target"):
        out["camera"][name] = (np.array(out["camera"][name]) + way).tolist()
    for light in out.get("lights", []):
        if "position" in light:
            light["position"] = (np.array(light["position"]) + way).tolist()
    matrix = np.eye(4)
    matrix[:3, 3] = way
    out["shapes"] = [placed(s, matrix) for s in out["shapes"]]
    return out


def packed(scene: dict[str, Any]) -> Packed:
    return pack(parse_scene(scene), Images())


class Seen:
    """A rendered scene: linear colour (h, w, 3) and the variance of its pixels' means, both float64 and sound."""

    def __init__(self, gpu: Renderer, scene: dict[str, Any], samples: int = 16, **settings: Any) -> None:
        made = packed(scene)
        defaults: dict[str, Any] = {"width": 96, "height": 64, "max_bounces": 6, "filter": "box"}
        picture: Picture = gpu.picture(gpu.load(made.arrays), RenderSettings(**{**defaults, **settings}))
        picture.trace(600.0, samples)
        self.color = picture.read()[..., :3].astype(float)
        self.variance = picture.read("variance").astype(float)
        self.warnings = made.warnings + picture.warnings
        self.origin = made.arrays.origin
        guides = [picture.read(aov) for aov in ("normal", "depth", "albedo")]
        picture.release()
        picture.scene.release()
        assert all(np.isfinite(a).all() for a in (self.color, self.variance, *guides))
        assert (self.color >= 0).all() and (self.variance >= 0).all()

    def deviation(self, other: Seen, block: int = 8) -> float:
        """Root mean square of the difference over its standard error, of blocks of pixels: 1 for two honest runs."""
        z = (self._blocks(self.color, block) - self._blocks(other.color, block)) * block
        error = self._blocks(self.variance, block) + self._blocks(other.variance, block)
        return float(np.sqrt(np.mean(z**2 / (error + 1e-30))))

    def alike(self, other: Seen, tolerance: float = 1e-3) -> float:
        """Share of the pixels that are the same but for rounding."""
        return float((np.abs(self.color - other.color) <= tolerance * other.color).mean())

    @staticmethod
    def _blocks(values: np.ndarray, k: int) -> np.ndarray:
        h, w = (n - n % k for n in values.shape[:2])
        return np.asarray(values[:h, :w].reshape(h // k, k, w // k, k, -1).mean((1, 3)))
