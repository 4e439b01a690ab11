"""The scenes of the price list: one for each kind of difficulty, all made by code."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from service.bench.scenes import MESH, STUDIO, BenchAssets
from service.document import presets
from service.formats import ImageData

Document = dict[str, Any]
PLANKS, BUMPS = "planks", "bumps"  # textures, made below


@dataclass(frozen=True)
class Case:
    name: str
    scene: Document


def cases() -> list[Case]:
    metal, glass = presets.get("materials", "brushed-aluminium"), presets.get("materials", "glass")
    textured = {
        "type": "principled",
        "base_color": {"texture": PLANKS},
        "roughness": {"texture": PLANKS, "channel": "g", "factor": 0.9},
        "normal_map": {"texture": BUMPS},
    }
    textures = {name: {"asset": name, "scale": [4, 2]} for name in (PLANKS, BUMPS)}
    return [
        Case("matte", _balls({"type": "diffuse", "albedo": [0.7, 0.4, 0.3]})),
        Case("metal", _balls({**presets.get("materials", "gold"), "roughness": 0.15}, metal)),
        Case("glass", _balls(glass, presets.get("materials", "frosted-glass"))),
        Case("cornell", presets.get("scenes", "cornell-boxes")),
        Case("textured", _balls(textured) | {"textures": textures}),
        Case("many lights", _many_lights()),
        Case("mesh 74k", _mesh()),
    ]


class TradeoffAssets(BenchAssets):
    """The bench's, and textures."""

    def image(self, ref: str, layer: str = "") -> ImageData:
        made = {PLANKS: planks, BUMPS: bumps}.get(ref)
        return ImageData(made()) if made else super().image(ref, layer)


def planks(size: int = 256) -> np.ndarray:
    """(size, size, 3) uint8: eight boards of their own brown each, with grain."""
    rng = np.random.default_rng(5)
    x, y = np.meshgrid(np.arange(size), np.arange(size))
    board = y * 8 // size
    grain = np.sin(0.12 * x + 6 * rng.random(8)[board] + 2 * np.sin(0.05 * y + 0.3 * board)) ** 4
    shade = 0.5 + 0.35 * rng.random(8)[board] - 0.2 * grain - 0.3 * (y % (size // 8) < 2)
    brown = shade[..., None] * np.array([1.0, 0.7, 0.45])
    pixels: np.ndarray = np.clip(np.rint(255 * brown), 0, 255).astype(np.uint8)
    return pixels


def bumps(size: int = 256) -> np.ndarray:
    """(size, size, 3) uint8: tangent-space normals of a dimpled surface."""
    angles = 2 * np.pi * np.arange(size) / size * 12
    slope_x, slope_y = 0.35 * np.sin(angles)[None, :], 0.35 * np.sin(angles)[:, None]
    normal = np.stack(np.broadcast_arrays(-slope_x, -slope_y, 1.0), axis=2)
    normal = normal / np.linalg.norm(normal, axis=2, keepdims=True)
    pixels: np.ndarray = np.rint(255 * (0.5 + 0.5 * normal)).astype(np.uint8)
    return pixels


def _balls(*matter: Document) -> Document:
    """One or two spheres on a grey floor in a studio."""
    centers = [[0, 0.6, 0]] if len(matter) == 1 else [[-0.65, 0.6, 0], [0.65, 0.6, 0]]
    names = [f"ball {k}" for k in range(len(matter))]
    floor = {"type": "quad", "origin": [-8, 0, 8], "u": [16, 0, 0], "v": [0, 0, -16], "material": "floor"}
    spheres = [
        {"type": "sphere", "center": center, "radius": 0.6, "material": name}
        for center, name in zip(centers, names, strict=True)
    ]
    return {
        "version": 1,
        "camera": {"position": [0, 1.5, 4.2], "target": [0, 0.5, 0], "vfov": 36},
        "environment": presets.get("environments", STUDIO),
        "materials": dict(zip(names, matter, strict=True)) | {"floor": {"type": "diffuse", "albedo": 0.5}},
        "shapes": [*spheres, floor],
    }


def _many_lights() -> Document:
    """A white ball between 48 small coloured lamps, and nothing else that shines."""
    rng = np.random.default_rng(7)
    hues = np.linspace(0, 2 * np.pi, 8, endpoint=False)
    colors = {f"lamp {k}": 12 * (0.55 + 0.45 * np.cos(h + np.array([0, 2.1, 4.2]))) for k, h in enumerate(hues)}
    lamps = [
        {
            "type": "sphere",
            "center": [float(3 * np.cos(a)), float(0.2 + 1.6 * rng.random()), float(1.6 * np.sin(a) - 0.5)],
            "radius": 0.06,
            "material": f"lamp {k % 8}",
        }
        for k, a in enumerate(2 * np.pi * rng.random(48))
    ]
    scene = _balls({"type": "diffuse", "albedo": 0.8})
    glowing = {n: {"type": "diffuse", "albedo": 0, "emission": [float(v) for v in c]} for n, c in colors.items()}
    return {
        **{key: scene[key] for key in ("version", "camera")},
        "materials": scene["materials"] | glowing,
        "shapes": [*scene["shapes"], *lamps],
    }


def _mesh() -> Document:
    scene = _balls(
        {
            "type": "principled",
            "base_color": [0.02, 0.09, 0.36],
            "metallic": 0.75,
            "roughness": 0.42,
            "clearcoat": 1,
            "clearcoat_roughness": 0.02,
        }
    )
    mesh = {"type": "mesh", "asset": MESH, "material": "ball 0"}
    camera = {"position": [0, 1.6, 4.2], "target": [0, 0.9, 0], "vfov": 40}
    return {**scene, "camera": camera, "shapes": [mesh, *scene["shapes"][1:]]}
