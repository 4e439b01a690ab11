"""The scenes of `peers` in Blender's words, for `peer_cycles`: all is triangles, and Z is up."""

from __future__ import annotations

from typing import Any

import numpy as np

from service.bench.scenes import BenchAssets
from service.document.transform import Transform
from tests.bench.peer_scenes import Document, PeerCase

# Ours to theirs. The middle of an image of the sky is our -Z and their +X, its right half our +X and their -Y: so
# turned, the same image needs no turn of its own.
BLENDER_FROM_OURS = np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
# Cycles has no sphere. 256 by 126 are 64 000 triangles, 1e-4 of the radius inside it in the mean.
COLUMNS, ROWS = 256, 126
Arrays = dict[str, np.ndarray]


def for_cycles(case: PeerCase, size: int) -> tuple[Document, Arrays]:
    """The scene in plain JSON, and its arrays.

    Shape i is `vertices{i}` (n, 3), `faces{i}` (m, 3), counter-clockwise seen from outside, and where it is smooth
    `normals{i}` (n, 3); the sky is `environment` (h, w, 3), row 0 at the top.
    """
    document, assets = case.scene, BenchAssets()
    arrays: Arrays = {}
    if "environment" in document:
        arrays["environment"] = assets.image(document["environment"]["asset"]).pixels[..., :3].astype(np.float32)
    for i, shape in enumerate(document["shapes"]):
        for name, array in _triangles(shape, assets).items():
            turned = array if name == "faces" else array @ BLENDER_FROM_OURS.T
            arrays[f"{name}{i}"] = turned.astype(np.int32 if name == "faces" else np.float32)
    scene = {
        "size": size,
        # Ours counts scattering events, theirs those after the first.
        "bounces": case.max_bounces - 1,
        "camera": _camera(document["camera"]),
        "materials": {name: _material(material) for name, material in document["materials"].items()},
        "shapes": [shape["material"] for shape in document["shapes"]],
    }
    return scene, arrays


def _camera(camera: Document) -> Document:
    """Theirs looks along its -Z with +Y up, as ours does."""
    position = np.array(camera["position"], float)
    back = position - camera["target"]
    back /= np.linalg.norm(back)
    right = np.cross([0.0, 1.0, 0.0], back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3] = BLENDER_FROM_OURS @ np.stack([right, np.cross(back, right), back, position], axis=1)
    return {"matrix": matrix.tolist(), "vfov": float(np.radians(camera["vfov"]))}


def _material(material: Document) -> Document:
    if material["type"] == "diffuse":
        made: Document = {"kind": "diffuse", "color": _color(material["albedo"])}
    elif material.get("transmission"):
        made = {"kind": "glass", "color": _color(material["base_color"]), "ior": material["ior"]}
    else:
        made = {
            "kind": "principled",
            "color": _color(material["base_color"]),
            "roughness": material["roughness"],
            "metallic": float(material.get("metallic", 0)),
        }
    if "emission" in material:
        made["emission"] = _color(material["emission"])
    return made


def _color(color: Any) -> list[float]:
    return [float(x) for x in np.broadcast_to(color, 3)]


def _triangles(shape: Document, assets: BenchAssets) -> Arrays:
    """Vertices, faces and, of what is smooth, normals: in our axes."""
    if shape["type"] == "mesh":
        mesh = assets.mesh(shape["asset"])
        return {"vertices": mesh.vertices, "faces": mesh.faces, "normals": np.asarray(mesh.normals)}
    if shape["type"] == "sphere":
        return _sphere(np.array(shape["center"], float), shape["radius"])
    if shape["type"] == "quad":
        origin, u, v = (np.array(shape[key], float) for key in ("origin", "u", "v"))
        return {
            "vertices": np.stack([origin, origin + u, origin + u + v, origin + v]),
            "faces": np.array([[0, 1, 2], [0, 2, 3]]),
        }
    return _box(shape)


def _box(shape: Document) -> Arrays:
    """Corner 4x + 2y + z, with 0 for low and 1 for high."""
    bits = np.array([[i >> 2, i >> 1 & 1, i & 1] for i in range(8)])
    low, high = np.array(shape["min"], float), np.array(shape["max"], float)
    corners = low + bits * (high - low)
    matrix = Transform(**shape.get("transform", {})).matrix4()
    sides = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    return {
        "vertices": corners @ matrix[:3, :3].T + matrix[:3, 3],
        "faces": np.concatenate([sides[:, [0, 1, 2]], sides[:, [0, 2, 3]]]),
    }


def _sphere(center: np.ndarray, radius: float) -> Arrays:
    """A grid of longitudes and latitudes, with one vertex at each pole."""
    theta = np.pi * np.arange(1, ROWS) / ROWS
    phi = 2 * np.pi * np.arange(COLUMNS) / COLUMNS
    rings = np.stack(
        [
            np.outer(np.sin(theta), np.sin(phi)),
            np.outer(np.cos(theta), np.ones(COLUMNS)),
            np.outer(np.sin(theta), np.cos(phi)),
        ],
        axis=-1,
    ).reshape(-1, 3)
    normals = np.concatenate([rings, [[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]]])
    top, bottom = len(rings), len(rings) + 1
    here = np.arange(COLUMNS)
    beside = (here + 1) % COLUMNS
    below = COLUMNS * np.arange(ROWS - 2)[:, None]
    a, b = below + here, below + beside
    c, d = a + COLUMNS, b + COLUMNS
    last = COLUMNS * (ROWS - 2)
    faces = np.concatenate(
        [
            np.stack([a, c, d], axis=-1).reshape(-1, 3),
            np.stack([a, d, b], axis=-1).reshape(-1, 3),
            np.stack([np.full(COLUMNS, top), here, beside], axis=-1),
            np.stack([np.full(COLUMNS, bottom), last + beside, last + here], axis=-1),
        ]
    )
    return {"vertices": center + radius * normals, "faces": faces, "normals": normals}
