"""The scenes that are measured: the built-in ones, a lone sphere, and a mesh of the size that people bring."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from service.config import load_config
from service.document import presets
from service.formats import Assets, ImageData, MeasuredData, MeshData
from service.server.assets import AssetStore, FileAssets

Document = dict[str, Any]
MESH = "mesh"  # the asset that stands for the measured mesh
SOFT_SUN = "soft-sun"  # the image of a sky whose sun is wide, which is made and not stored
STUDIO = "studio"  # the built-in environment that lights what has none of its own


@dataclass(frozen=True)
class Case:
    name: str
    scene: Document
    max_bounces: int


def cases() -> list[Case]:
    matt, metal = {"roughness": 0.7}, {"metallic": 1, "roughness": 0.1}
    return [
        Case("rough sphere, HDR image", _sphere(matt), 8),
        Case("metal sphere, HDR image", _sphere(metal), 8),
        Case("Cornell box, empty", presets.get("scenes", "cornell-empty"), 4),
        Case("Cornell box, two boxes", presets.get("scenes", "cornell-boxes"), 4),
        Case("Cornell box, two spheres", presets.get("scenes", "cornell-spheres"), 4),
        Case("1 000 spheres, HDR image", presets.get("scenes", "sphere-field"), 8),
        Case("hall, 240 lamps", _hall(), 4),
        Case("mesh on a plane, HDR image", mesh_on_plane(), 2),
        Case("mesh on a plane, HDR image", mesh_on_plane(), 8),
    ]


class BenchAssets:
    """The assets of the cases, all of them built in, unless files are given in their place."""

    def __init__(self, mesh_file: Path | None = None, environment_file: Path | None = None) -> None:
        self._mesh_file, self._environment_file = mesh_file, environment_file
        self._builtin = AssetStore(load_config().data_dir, None, presets.builtin_assets)

    def mesh(self, ref: str) -> MeshData:
        if ref != MESH:
            return self._builtin.mesh(ref)
        if self._mesh_file:
            return standing(_beside(self._mesh_file).mesh(self._mesh_file.name))
        (knot,) = (s for s in presets.get("scenes", "generated-mesh")["shapes"] if s["type"] == "mesh")
        return standing(divided(self._builtin.mesh(knot["asset"])))

    def measured(self, ref: str) -> MeasuredData:
        return self._builtin.measured(ref)

    def image(self, ref: str, layer: str = "") -> ImageData:
        if self._environment_file:
            return _beside(self._environment_file).image(self._environment_file.name)
        if ref == SOFT_SUN:
            return _soft_sun()
        return self._builtin.image(ref, layer)


def _soft_sun(height: int = 256, width: float = 8.0) -> ImageData:
    """A pale blue sky over a grey ground, and a warm sun whose radiance falls off over `width` degrees."""
    theta = (np.arange(height) + 0.5)[:, None] * (np.pi / height)
    phi = (np.arange(2 * height) + 0.5) * (np.pi / height) - np.pi
    ones = np.ones_like(phi)
    d = np.stack([np.sin(theta) * np.sin(phi), np.cos(theta) * ones, -np.sin(theta) * np.cos(phi)], axis=-1)
    sun = np.array([0.5, 0.7, 0.5]) / np.linalg.norm([0.5, 0.7, 0.5])
    away = np.degrees(np.arccos(np.clip(d @ sun, -1, 1)))[..., None]
    sky = np.where(d[..., 1:2] > 0, [0.25, 0.35, 0.5], [0.1, 0.1, 0.1])
    return ImageData((sky + np.exp(-((away / width) ** 2)) * [40.0, 36.0, 30.0]).astype(np.float32))


def _beside(path: Path) -> Assets:
    return FileAssets(path.parent, [])


def divided(mesh: MeshData) -> MeshData:
    """The mesh with each triangle cut in three around its middle: 73 728 instead of the knot's 24 576. Its shape and
    its normals stay the same."""
    assert mesh.normals is not None
    a, b, c = mesh.faces.T
    middle = np.arange(len(a), dtype=np.int32) + len(mesh.vertices)
    faces = np.concatenate(
        [np.stack(corners, axis=1) for corners in ((a, b, middle), (b, c, middle), (c, a, middle))]
    )
    vertices = np.concatenate([mesh.vertices, mesh.vertices[mesh.faces].mean(axis=1)])
    between = mesh.normals[mesh.faces].mean(axis=1)
    between /= np.linalg.norm(between, axis=1, keepdims=True)
    return MeshData(vertices, faces, np.concatenate([mesh.normals, between]))


def standing(mesh: MeshData) -> MeshData:
    """The mesh two units large, on the plane y = 0, in the middle."""
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    foot = [(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2]
    return MeshData((mesh.vertices - foot) * (2 / (high - low).max()), mesh.faces, mesh.normals)


def _sphere(material: Document) -> Document:
    return {
        "version": 1,
        "camera": {"position": [0, 0, 4], "target": [0, 0, 0], "vfov": 40},
        "environment": presets.get("environments", STUDIO),
        "materials": {"subject": _disney(**material)},
        "shapes": [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "subject"}],
    }


def _hall(lamps: int = 240) -> Document:
    """A long hall with pillars, under small lamps of six colours."""
    rng = np.random.default_rng(3)
    x, y, z = [40, 0, 0], [0, 4, 0], [0, 0, 8]
    walls = [([0, 0, 0], z, x), (y, x, z), ([0, 0, 0], x, y), (z, y, x), ([0, 0, 0], y, z), (x, z, y)]
    shapes: list[Document] = [
        {"type": "quad", "origin": origin, "u": u, "v": v, "material": "wall"} for origin, u, v in walls
    ]
    for i in range(6):
        for side in (1.5, 5.9):
            low, high = [4 + 6 * i, 0, side], [4.6 + 6 * i, 4, side + 0.6]
            shapes.append({"type": "box", "min": low, "max": high, "material": "wall"})
    places = rng.uniform((0.3, 3, 0.3), (39.7, 3.9, 7.7), (lamps, 3)).tolist()
    shapes += [
        {"type": "sphere", "center": place, "radius": 0.04, "material": f"lamp {i % 6}"}
        for i, place in enumerate(places)
    ]
    colors = 120 * (1 + 0.5 * np.cos(np.arange(6)[:, None] + np.arange(3) * 2))
    glowing = {f"lamp {i}": {"type": "diffuse", "albedo": 0, "emission": c} for i, c in enumerate(colors.tolist())}
    return {
        "version": 1,
        "camera": {"position": [1, 1.7, 4.4], "target": [20, 1.3, 3.6], "vfov": 60},
        "materials": {"wall": {"type": "diffuse", "albedo": [0.7, 0.65, 0.6]}, **glowing},
        "shapes": shapes,
    }


def mesh_on_plane() -> Document:
    return {
        "version": 1,
        "camera": {"position": [0, 1.6, 4.2], "target": [0, 0.9, 0], "vfov": 40},
        "environment": presets.get("environments", STUDIO),
        "materials": {"subject": _disney(roughness=0.4), "ground": {"type": "diffuse", "albedo": 0.5}},
        "shapes": [
            {"type": "mesh", "asset": MESH, "material": "subject"},
            {"type": "quad", "origin": [-10, 0, 10], "u": [20, 0, 0], "v": [0, 0, -20], "material": "ground"},
        ],
    }


def _disney(**parameters: float) -> Document:
    return {"type": "disney", "base_color": [0.8, 0.5, 0.3], **parameters}
