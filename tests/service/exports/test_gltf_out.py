"""Scenes as GLB files: read in again they are the same scenes, and what they lose is told."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from gpu import Renderer
from service import presets
from service.assets import AssetStore
from service.config import Config
from service.exports import FORMATS, Exported
from service.pack import pack
from service.scene import parse_scene
from tests.asset_files import png

CONFIG = Config()
RNG = np.random.default_rng(5)
COLOR = RNG.integers(0, 256, (8, 8, 3), np.uint8)
DATA = RNG.integers(0, 256, (8, 8, 4), np.uint8)
QUAD: dict[str, Any] = {
    "type": "mesh",
    "vertices": [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]],
    "faces": [[0, 1, 2], [0, 2, 3]],
    "uvs": [[0, 0], [1, 0], [1, 1], [0, 1]],
}
TENT = {**QUAD, "vertices": [[-1, -1, 0], [0.125, -1, 0.5], [0.125, 1, 0.75], [-1, 1, 0]]}

TURNED = {"translate": [0.3, 0.1, 0.7], "rotate": [10, 20, 30], "scale": [1, 2, 0.5]}
LIGHTS: list[dict[str, Any]] = [
    {"type": "point", "position": [1, 2, 3], "intensity": [30, 20.7, 10]},
    {"type": "spot", "position": [-2, 1, 3], "direction": [2, -1, -3], "intensity": 77, "inner_angle": 10,
     "outer_angle": 33},
    {"type": "directional", "direction": [1, -1, 0], "irradiance": [0, 1, 1.3]},
]  # fmt: skip


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[AssetStore]:
    store = AssetStore(tmp_path_factory.mktemp("data"), None, presets.builtin_assets)
    yield store
    store.close()


def scene(*shapes: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {
        "version": 1,
        "camera": {"position": [0.5, 0.75, 4], "target": [0, 0.1, 0], "vfov": 33},
        "lights": [{"type": "point", "position": [1, 2, 3], "intensity": [30, 20.7, 10]}],
        "materials": {"m": {"type": "principled"}},
        "shapes": list(shapes),
        **more,
    }


def exported(document: dict[str, Any], store: AssetStore) -> Exported:
    return FORMATS["glb"].scene_writer(parse_scene(document), store, CONFIG)


def again(made: Exported, store: AssetStore) -> dict[str, Any]:
    """The document that the file is imported as."""
    return store.scene(store.add(made.data).id).scene(presets.default_environment())


def tree_of(made: Exported) -> dict[str, Any]:
    (size,) = struct.unpack_from("<I", made.data, 12)
    found: dict[str, Any] = json.loads(made.data[20 : 20 + size])
    return found


def lost(made: Exported) -> dict[str, str]:
    return dict(made.losses)


def assert_same_arrays(one: dict[str, Any], other: dict[str, Any], store: AssetStore) -> None:
    """All that the renderer is given, but for the order of textures and materials."""
    a, b = (pack(parse_scene(each), store).arrays for each in (one, other))
    for name, value in vars(a).items():
        if isinstance(value, np.ndarray):
            assert value.tobytes() == getattr(b, name).tobytes(), name
    lens = [name for name in a.camera.dtype.names if name != "focus_distance"]  # which a pinhole does not use
    assert a.camera[lens] == b.camera[lens]
    if a.textures is not None:
        assert b.textures is not None
        assert a.textures.words.tobytes() == b.textures.words.tobytes()
        assert a.textures.texels.tobytes() == b.textures.texels.tobytes()


def textured(store: AssetStore) -> dict[str, Any]:
    color, data = (store.add(png(each)).id for each in (COLOR, DATA))
    placed = {"scale": [2, 0.75], "rotation": 30, "offset": [0.25, 0.1], "wrap": "mirror"}
    material = {
        "type": "principled",
        "base_color": {"texture": "color", "factor": [0.9, 0.8, 0.7]},
        "roughness": {"texture": "data", "channel": "g", "factor": 0.8},
        "metallic": {"texture": "data", "channel": "b", "factor": 0.5},
        "normal_map": {"texture": "data", "scale": 0.5},
        "emission": {"texture": "color", "factor": [0.3, 2.2, 0]},
        "emission_sides": "both",
        "specular_color": [0.5, 0.25, 1],
        "clearcoat": 0.6,
        "clearcoat_roughness": 0.2,
    }
    glass = {"type": "principled", "base_color": [1, 1, 1], "transmission": 1, "ior": 1.5, "roughness": 0.3}
    glass |= {"attenuation_color": [0.9, 0.5, 0.1], "attenuation_distance": 0.7}
    satin = {"type": "principled", "base_color": 0.3, "roughness": 0.6, "metallic": 0, "sheen": 1,
             "sheen_color": [0.2, 0.4, 0.8], "sheen_roughness": 0.3, "anisotropic": 0.7,
             "anisotropic_rotation": 20}  # fmt: skip
    return scene(
        {**QUAD, "material": "printed", "name": "Wall"},
        {**TENT, "material": "glass", "name": "Tent/Roof", "transform": TURNED},
        {**TENT, "material": "satin", "name": "Tent/Floor", "double_sided": False, "smooth": False,
         "transform": {"scale": [-1, 1, 1]}},
        textures={"color": {"asset": color, **placed}, "data": {"asset": data}},
        materials={"printed": material, "glass": glass, "satin": satin},
        lights=LIGHTS,
    )  # fmt: skip


def test_a_scene_of_meshes_comes_back_to_the_bit(store: AssetStore, gpu: Renderer) -> None:
    before = textured(store)
    made = exported(before, store)
    assert lost(made) == {}
    after = again(made, store)
    assert [shape["name"] for shape in after["shapes"]] == ["Wall", "Tent/Roof", "Tent/Floor"]
    assert "environment" not in after
    assert_same_arrays(before, after, store)
