"""Scenes as GLB files: read in again they are the same scenes, and what they lose is told."""

from __future__ import annotations

import io
import json
import math
import struct
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import trimesh

from gpu import Renderer, RenderSettings
from service.config import Config
from service.document import parse_scene, presets
from service.exports import FORMATS, Exported, Losses
from service.pack import pack
from service.problems import InvalidDocument, TooLarge
from service.server.assets import AssetStore
from tests.asset_files import png
from tests.exr_files import written

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
    placed = {"scale": [2, 0.75], "rotation": 30, "offset": [0.25, 0.1], "wrap": ["mirror", "clamp"]}
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
        {**TENT, "material": "glass", "name": "Tent/Roof", "transform": TURNED,
         "double_sided": False},
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
    one, other = (pixels(gpu, each, store) for each in (before, after))
    assert one.mean() > 0.1 and np.array_equal(one, other)


def test_dispersion_comes_back_to_the_bit(store: AssetStore) -> None:
    flint = {"type": "principled", "base_color": 1, "transmission": 1, "roughness": 0.25, "ior": 1.75, "abbe": 32}
    before = scene({**TENT, "material": "flint", "double_sided": False}, materials={"flint": flint}, lights=LIGHTS)
    made = exported(before, store)
    assert lost(made) == {}
    after = again(made, store)
    assert after["materials"]["flint"]["abbe"] == 32
    assert_same_arrays(before, after, store)


def test_thin_walls_come_back_to_the_bit(store: AssetStore) -> None:
    pane = {
        "type": "principled",
        "base_color": [1, 0.5, 0.25],
        "transmission": 1,
        "thin_walled": True,
        "roughness": 0.3,
    }
    leaf = {"type": "principled", "base_color": [0.25, 0.5, 0.125], "thin_walled": True, "diffuse_transmission": 0.5}
    leaf |= {"diffuse_transmission_color": [0.5, 1, 0.25], "roughness": 0.5}
    before = scene({**QUAD, "material": "pane"}, {**TENT, "material": "leaf"}, materials={"pane": pane, "leaf": leaf},
                   lights=LIGHTS)  # fmt: skip
    made = exported(before, store)
    assert lost(made) == {}
    after = again(made, store)
    assert after["materials"]["leaf"]["diffuse_transmission_color"] == [0.5, 1, 0.25]
    assert after["materials"]["pane"]["thin_walled"] is True
    assert_same_arrays(before, after, store)


def pixels(gpu: Renderer, document: dict[str, Any], store: AssetStore) -> np.ndarray:
    made = gpu.picture(gpu.load(pack(parse_scene(document), store).arrays), RenderSettings(width=24, height=24))
    made.trace(600.0, 2)
    values = made.read()
    made.release()
    return values


def test_channels_move_without_a_loss(store: AssetStore) -> None:
    """glTF reads roughness from green beside metallic in blue, and alpha beside the colour."""
    color, data = (store.add(png(each)).id for each in (COLOR, DATA))
    material = {
        "type": "principled",
        "base_color": {"texture": "color"},
        "alpha": {"texture": "data", "channel": "r"},
        "roughness": {"texture": "data", "channel": "a"},
        "metallic": 1,
    }
    textures = {"color": {"asset": color}, "data": {"asset": data}}
    made = exported(scene({**QUAD, "material": "m"}, textures=textures, materials={"m": material}), store)
    assert lost(made) == {}
    after = again(made, store)
    found = after["materials"]["m"]
    rough = store.image(after["textures"][found["roughness"]["texture"]]["asset"]).pixels
    both = store.image(after["textures"][found["base_color"]["texture"]]["asset"]).pixels
    assert np.array_equal(rough[..., 1], DATA[..., 3]) and (rough[..., 2] == 255).all()
    assert np.array_equal(both, np.dstack([COLOR, DATA[..., 0]])) and found["alpha"]["channel"] == "a"


def test_images_keep_their_bytes(store: AssetStore) -> None:
    data = png(COLOR)
    material = {"type": "principled", "base_color": {"texture": "t"}}
    textures = {"t": {"asset": store.add(data).id}}
    assert (
        data in exported(scene({**QUAD, "material": "m"}, textures=textures, materials={"m": material}), store).data
    )


def test_layers_of_one_image_are_images_apart(store: AssetStore) -> None:
    texels = np.full((4, 4, 6), (0.25, 0.25, 0.25, 1, 0, 0), np.float32)
    asset = store.add(written(texels, [f"{layer}.{channel}" for layer in ("AO", "beauty") for channel in "RGB"])).id
    textures = {
        "ao": {"asset": asset, "layer": "AO"},
        "b": {"asset": asset, "layer": "beauty"},
        "c": {"asset": asset},
    }
    materials = {name: {"type": "principled", "base_color": {"texture": name}} for name in textures}
    shapes = [{**QUAD, "material": name} for name in textures]
    made = exported(scene(*shapes, textures=textures, materials=materials), store)
    assert len(tree_of(made)["images"]) >= 2
    found = again(made, store)
    shown = {
        name: store.image(found["textures"][material["base_color"]["texture"]]["asset"]).pixels[0, 0].tolist()
        for name, material in found["materials"].items()
    }
    assert shown["b"] == shown["c"] == [255, 0, 0] and shown["ao"][0] == shown["ao"][1] < 255


BALL = {"type": "sphere", "center": [1, 2, 3], "radius": 0.5, "material": "m"}
TOLD: list[tuple[str, dict[str, Any], str]] = [
    ("a sphere", {"shapes": [BALL]}, "/shapes/0"),
    ("depth of field", {"camera": {"position": [0, 0, 4], "target": [0, 0, 0], "aperture_radius": 0.1}},
     "/camera/aperture_radius"),
    ("the environment", {"environment": {"type": "constant", "radiance": 1}}, "/environment"),
    ("a sun's size", {"lights": [LIGHTS[2] | {"angular_diameter": 0.5}]}, "/lights/0/angular_diameter"),
    ("a sharp edge", {"lights": [LIGHTS[1] | {"inner_angle": 33}]}, "/lights/0/inner_angle"),
    ("what is hidden", {"shapes": [{**QUAD, "material": "m", "visible_to_camera": False}]},
     "/shapes/0/visible_to_camera"),
    ("a number between floats", {"shapes": [{**TENT, "material": "m", "transform": {"scale": 0.7},
     "vertices": [[-1, -1, 0], [0.1, -1, 0.3], [0.1, 1, 0.3], [-1, 1, 0]]}]}, "/shapes/0"),
    ("a half of a lamp", {"materials": {"m": {"type": "principled", "emission": 3}}}, "/shapes/0"),
    ("a parameter", {"materials": {"m": {"type": "principled", "subsurface": 0.5}}}, "/materials/m/subsurface"),
    ("gloss", {"materials": {"m": {"type": "principled", "clearcoat": 1}}}, "/materials/m/clearcoat_gloss"),
    ("a model", {"materials": {"m": {"type": "diffuse", "albedo": 0.5}}}, "/materials/m/type"),
    ("a checker", {"materials": {"m": {"type": "principled", "base_color": {"texture": "t"}}},
     "textures": {"t": {"type": "checker", "a": 1, "b": [1, 0, 0]}}}, "/textures/t"),
    ("a projection", {"materials": {"m": {"type": "principled", "base_color": {"texture": "t"}}},
     "textures": {"t": {"type": "checker", "a": 1, "b": [1, 0, 0], "mapping": "box"}}}, "/materials/m/base_color"),
    ("an idle material", {"materials": {"m": {"type": "principled"}, "n": {"type": "principled"}}}, "/materials/n"),
]  # fmt: skip


@pytest.mark.parametrize(("what", "part", "pointer"), TOLD, ids=[each[0] for each in TOLD])
def test_what_is_lost_is_told_once(store: AssetStore, what: str, part: dict[str, Any], pointer: str) -> None:
    made = exported({**scene({**QUAD, "material": "m"}), **part}, store)
    assert list(lost(made)) == [pointer] and len(made.losses) == 1


def test_solids_stand_where_the_document_has_them(store: AssetStore) -> None:
    """In trimesh's reading: their boxes, volumes and outward sides; a sheared box as well."""
    sheared = {"matrix": [1, 0.5, 0, 3, 0, 1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1]}
    shapes = [
        BALL,
        {"type": "box", "min": [-2, 0, 0], "max": [-1, 1, 3], "material": "m", "name": "a/b"},
        {"type": "box", "min": [0, 0, 0], "max": [1, 1, 1], "material": "m", "transform": sheared},
    ]
    found = trimesh.load(io.BytesIO(exported(scene(*shapes), store).data), file_type="glb")
    parts = [
        found.geometry[name].copy().apply_transform(place)
        for place, name in (found.graph[node] for node in found.graph.nodes_geometry)
    ]
    volumes = sorted(each.volume for each in parts)
    assert volumes == pytest.approx([math.pi / 6, 2, 3], rel=4e-3)
    assert np.allclose(found.bounds, [[-2, 0, 0], [4.5, 2.5, 3.5]], atol=1e-6)


def test_a_checker_is_painted_the_right_way_up(store: AssetStore) -> None:
    """Where u and v begin stands its first colour; the importer's coordinates lead there."""
    textures = {"t": {"type": "checker", "a": 1, "b": [1, 0, 0], "scale": [2, 4]}}
    material = {"type": "principled", "base_color": {"texture": "t"}}
    made = exported(scene({**QUAD, "material": "m"}, textures=textures, materials={"m": material}), store)
    (texture,) = again(made, store)["textures"].values()
    image = store.image(texture["asset"]).pixels
    for u, v, color in ((0.1, 0.1, 255), (0.6, 0.1, 0), (0.1, 0.3, 0), (0.6, 0.3, 255)):
        x, y = (a * s + o for a, s, o in zip((u, v), texture["scale"], texture.get("offset", (0, 0)), strict=True))
        assert image[int((1 - y % 1) * len(image)), int(x % 1 * len(image)), 1] == color


def test_equal_things_are_written_once(store: AssetStore) -> None:
    """Balls share their triangles; a material of shapes that differ in their sides comes back as one."""
    sides = [{**QUAD, "material": "m", "double_sided": side} for side in (True, False)]
    made = exported(scene(*sides, BALL, {**BALL, "center": [0, 0, 0]}), store)
    tree = tree_of(made)
    assert (len(tree["materials"]), len(tree["meshes"]), len(tree["nodes"])) == (2, 3, 6)
    assert list(again(made, store)["materials"]) == ["m"]


def test_work_is_bounded(store: AssetStore) -> None:
    few = CONFIG.model_copy(update={"max_triangles": 1})
    small = CONFIG.model_copy(update={"max_asset": 500})
    document = parse_scene(scene({**QUAD, "material": "m"}))
    with pytest.raises(InvalidDocument, match="SUNBOX_MAX_TRIANGLES"):
        FORMATS["glb"].scene_writer(document, store, few)
    with pytest.raises(TooLarge, match="SUNBOX_MAX_ASSET"):
        FORMATS["glb"].scene_writer(document, store, small)


def test_a_long_list_fits_a_header() -> None:
    losses = Losses()
    for k in range(500):
        losses.add(f"/shapes/{k}", "the same")
        losses.add(f"/materials/{k}", f"something else, {k}: {'x' * 100}")
    listed = json.loads(losses.header("/scene"))
    assert len(losses.header("/scene")) <= 4096
    assert listed[0] == {"pointer": "/scene/shapes/0", "detail": "the same", "count": 500}
    assert listed[-1]["detail"].startswith("and ") and len(listed) > 5
