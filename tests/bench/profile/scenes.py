"""The scenes that are profiled."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from gpu import SceneArrays
from service.bench.scenes import BenchAssets, cases, mesh_on_plane, standing
from service.document import parse_scene, presets
from service.formats import Assets, MeshData
from service.pack import pack
from tests.bench import peer_scenes
from tests.bench.tradeoff_scenes import BUMPS, PLANKS, TradeoffAssets

Document = dict[str, Any]
MAX_BOUNCES = 8
CHARTED = "charted"  # the built-in mesh with texture coordinates


@dataclass(frozen=True)
class Subject:
    """A scene that is profiled; `packed` makes arrays of its document or of one like it."""

    name: str
    document: Document
    packed: Callable[[Document], SceneArrays]


class ProfileAssets(TradeoffAssets):
    """The price list's, and a mesh with texture coordinates."""

    def mesh(self, ref: str) -> MeshData:
        return charted() if ref == CHARTED else super().mesh(ref)


def charted() -> MeshData:
    """The built-in mesh, 24 576 triangles, with u around the y axis and v along it."""
    (knot,) = (shape for shape in presets.get("scenes", "generated-mesh")["shapes"] if shape["type"] == "mesh")
    mesh = standing(BenchAssets().mesh(knot["asset"]))
    x, y, z = mesh.vertices.T
    uvs = np.stack([np.arctan2(x, z) / (2 * np.pi) + 0.5, y / 2], axis=1)
    return MeshData(mesh.vertices, mesh.faces, mesh.normals, uvs.astype(np.float32))


def built_in() -> list[Subject]:
    glass = next(case for case in peer_scenes.cases() if "glass" in case.name)
    assets = ProfileAssets()

    def packed(document: Document) -> SceneArrays:
        return pack(parse_scene(document), assets).arrays

    return [
        Subject("rough sphere, HDR image", cases()[0].scene, packed),
        Subject("mesh on a plane, HDR image", mesh_on_plane(), packed),
        Subject(glass.name, glass.scene, packed),
        Subject("textured meshes, alpha and glass", textured(), packed),
    ]


def of_file(name: str, document: Document, assets: Assets) -> Subject:
    """The scene of a user's file. Its document may be changed, as long as it names no other assets."""
    return Subject(name, document, lambda changed: pack(parse_scene(changed), assets).arrays)


def textured() -> Document:
    """What a glTF file may hold: a mesh with textures, a normal map and holes in its alpha, the same mesh of rough
    glass, and a textured floor."""
    plane = mesh_on_plane()
    mesh, floor = plane["shapes"]
    cut = {
        "type": "principled",
        "base_color": {"texture": PLANKS},
        "roughness": {"texture": PLANKS, "channel": "g", "factor": 0.9},
        "normal_map": {"texture": BUMPS},
        "alpha": {"texture": "holes"},
    }
    glass = {
        "type": "principled",
        "base_color": {"texture": PLANKS},
        "transmission": 1,
        "roughness": 0.15,
        "ior": 1.5,
    }
    beside = [
        {**mesh, "asset": CHARTED, "transform": {"translate": [x, 0, 0]}, "material": name}
        for x, name in ((-1, "cut"), (1, "glass"))
    ]
    return {
        **plane,
        "textures": {
            **{name: {"asset": name, "scale": [4, 2]} for name in (PLANKS, BUMPS)},
            "holes": {"type": "checker", "a": 1, "b": 0.3, "scale": [24, 24]},
            "tiles": {"type": "checker", "a": 0.6, "b": 0.2, "scale": [16, 16]},
        },
        "materials": {
            "cut": cut,
            "glass": glass,
            "ground": {"type": "principled", "base_color": {"texture": "tiles"}, "roughness": 0.6},
        },
        "shapes": [*beside, floor],
    }
