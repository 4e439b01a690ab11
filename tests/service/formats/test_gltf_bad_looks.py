"""What is wrong with a glTF file's materials, textures, lights or cameras costs these, and not the scene."""

from __future__ import annotations

import io
import struct
from typing import Any

import numpy as np
import pytest
from PIL import Image

from service.formats.errors import ParseError
from service.formats.read.gltf.importer import read_scene
from service.formats.types import AssetLimits, SceneFile
from tests.gltf_files import Gltf

LIMITS = AssetLimits()
LIGHTS = "KHR_lights_punctual"


def textured() -> Gltf:
    file = Gltf()
    values = {"baseColorTexture": {"index": file.texture(np.full((2, 2, 3), 200, np.uint8))}, "metallicFactor": 0}
    material = file.add("materials", {"pbrMetallicRoughness": values})
    file.node(mesh=file.mesh(file.primitive(material=material)))
    return file


def read(file: Gltf) -> SceneFile:
    return read_scene(file.glb(), LIMITS)


def noted(scene: SceneFile) -> dict[str, str]:
    return {warning["pointer"]: warning["detail"] for warning in scene.warnings}


def put(file: Gltf, path: str, value: Any) -> None:
    """Set the value at a pointer."""
    *steps, last = path.split("/")
    found: Any = file.tree
    for step in steps:
        found = found[int(step)] if isinstance(found, list) else found.setdefault(step, {})
    found[int(last) if isinstance(found, list) else last] = value


INFO = "materials/0/pbrMetallicRoughness/baseColorTexture"


@pytest.mark.parametrize(
    ("path", "value", "place", "detail"),
    [
        (f"{INFO}/index", 9, f"/{INFO}/index", "refers to /textures/9; there are 1"),
        (f"{INFO}/index", -1, f"/{INFO}/index", "must be a whole number of at least 0, not -1"),
        (INFO, {}, f"/{INFO}/index", "is missing"),
        ("textures/0/source", 7, "/textures/0/source", "refers to /images/7; there are 1"),
        ("textures/0/sampler", 3, "/textures/0/sampler", "refers to /samplers/3; there are 0"),
        ("images/0", {"uri": "data:image/bmp;base64,Qk0AAA=="}, "/images/0/uri", "is not a PNG, JPEG, WebP"),
        ("images/0", {}, "/images/0/uri", "is missing"),
        ("images/0/bufferView", 44, "/images/0/bufferView", "refers to /bufferViews/44"),
    ],
)  # fmt: skip
def test_a_texture(path: str, value: Any, place: str, detail: str) -> None:
    file = textured()
    put(file, path, value)
    scene = read(file)
    (material,) = scene.document["materials"].values()
    assert material["base_color"] == 1 and "textures" not in scene.document
    said = noted(scene)[place]
    assert said.startswith(detail) and said.endswith("; the texture is left out")


MATERIAL, PBR = "materials/0", "materials/0/pbrMetallicRoughness"
GLASS, GLOW = (
    f"{MATERIAL}/extensions/KHR_materials_transmission",
    f"{MATERIAL}/extensions/KHR_materials_emissive_strength",
)


@pytest.mark.parametrize(
    ("path", "value", "shown", "detail"),
    [
        (f"{PBR}/roughnessFactor", None, {"roughness": 1}, "must be a finite number, not null; 1 is used instead"),
        (f"{PBR}/roughnessFactor", 1.0000001, {"roughness": 1}, "must be from 0 to 1, not 1.0000001; 1 is used"),
        (f"{PBR}/metallicFactor", 2, {"metallic": 1}, "must be from 0 to 1, not 2; 1 is used instead"),
        (f"{PBR}/metallicFactor", -0.5, {"metallic": 0}, "must be from 0 to 1, not -0.5; 0 is used instead"),
        (f"{PBR}/baseColorFactor", [1, 0.5, 1], {}, "must be 4 numbers, not [1, 0.5, 1]; 1 0.5 1 1 are used instead"),
        (f"{PBR}/baseColorFactor", "red", {}, "must be 4 numbers, not 'red'; 1 1 1 1 are used instead"),
        (f"{PBR}/baseColorFactor", [1, -1, 0.5, 1], {}, "[1.0, -1.0, 0.5, 1.0]; 1 0 0.5 1 are used"),
        (f"{MATERIAL}/normalTexture", None, {}, "must be an object, not null; it is left out"),
        (f"{MATERIAL}/alphaMode", "blend", {}, "must be OPAQUE, MASK or BLEND, not 'blend'; BLEND is used instead"),
        (f"{MATERIAL}/alphaMode", 7, {}, "must be a string, not 7; OPAQUE is used instead"),
        (f"{MATERIAL}/doubleSided", "true", {}, "must be true or false, not 'true'; false is used instead"),
        (f"{MATERIAL}/name", 3, {}, "must be a string, not 3"),
        (f"{GLASS}", None, {}, "must be an object, not null; it is left out"),
        (f"{GLASS}/transmissionFactor", 1.5, {"transmission": 1}, "must be from 0 to 1, not 1.5; 1 is used instead"),
        (f"{GLOW}/emissiveStrength", 1e30, {"emission": 1e20}, "must be at most 1e+20: 1e+30; 1e+20 is used"),
    ],
)  # fmt: skip
def test_a_member_of_a_material_costs_no_other(path: str, value: Any, shown: dict[str, Any], detail: str) -> None:
    file = textured()
    file.tree["materials"][0]["emissiveFactor"] = [1, 1, 1]
    put(file, path, value)
    scene = read(file)
    (material,) = scene.document["materials"].values()
    said = noted(scene)
    place = f"/{MATERIAL}/emissiveFactor" if "Strength" in path else f"/{path}"
    assert detail in said[place], said
    assert "texture" in material["base_color"], "which has nothing to do with it"
    assert shown.items() <= material.items()


@pytest.mark.parametrize("value", [-1, 5])
def test_a_material_that_does_not_exist(value: int) -> None:
    file = textured()
    put(file, "meshes/0/primitives/0/material", value)
    scene = read(file)
    assert len(scene.document["shapes"]) == 1
    said = noted(scene)["/meshes/0/primitives/0/material"]
    assert said.endswith("; a grey material is shown in its place")


@pytest.mark.parametrize("light", [{"type": "ambient"}, {"type": "point", "intensity": -1}, None])
def test_a_light(light: dict[str, Any] | None) -> None:
    file = textured()
    put(file, f"extensions/{LIGHTS}", {"lights": [{"type": "point"}, *([light] if light else [])]})
    file.node(extensions={LIGHTS: {"light": 0}})
    file.node(extensions={LIGHTS: {"light": 1}})
    scene = read(file)
    assert len(scene.document["lights"]) == 1
    assert any(said.endswith("; the light is left out") for said in noted(scene).values())


@pytest.mark.parametrize(
    "camera",
    [
        {"type": "perspective", "perspective": {"yfov": 45, "znear": 0.1}},
        {"type": "orthographic", "orthographic": {"xmag": 0, "ymag": 0}},
        {"type": "perspective"},
        None,
    ],
)
def test_a_camera(camera: dict[str, Any] | None) -> None:
    """The next one of the file takes its place."""
    file = textured()
    index = file.add("cameras", camera) if camera else -1
    file.node(camera=index)
    sound = file.add("cameras", {"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}})
    file.node(camera=sound)
    scene = read(file)
    assert scene.document["camera"]["vfov"] == pytest.approx(np.degrees(0.5))
    assert any("another camera of the file" in said for said in noted(scene).values())


@pytest.mark.parametrize("format", ["BMP", "TGA", "GIF", "TIFF"])
def test_images_that_gltf_does_not_allow(format: str) -> None:
    made = io.BytesIO()
    Image.new("RGB", (3, 2), (200, 100, 50)).save(made, format)
    file = textured()
    put(file, "images/0", {"bufferView": file.view(made.getvalue()), "mimeType": "image/png"})
    scene = read(file)
    (texture,) = scene.document["textures"].values()
    part = scene.parts[int(texture["asset"].partition(":")[2])]
    with Image.open(io.BytesIO(part.data)) as found:
        assert found.format == "PNG" and found.size == (3, 2) and not scene.warnings


@pytest.mark.parametrize("more", [-4, 4, 1000])
def test_a_glb_of_a_wrong_length(more: int) -> None:
    """Its chunks say what is there."""
    data = textured().glb()
    wrong = data[:8] + struct.pack("<I", len(data) + more) + data[12:]
    assert len(read_scene(wrong, LIMITS).document["shapes"]) == 1
    with pytest.raises(ParseError, match="the file is cut off"):
        read_scene(wrong[:-5], LIMITS)


@pytest.mark.parametrize("indexed", [True, False])
def test_a_primitive_of_nothing(indexed: bool) -> None:
    """An accessor of no items is against the specification, and what exporters write for an empty mesh."""
    file = textured()
    empty = file.add("accessors", {"componentType": 5123 if indexed else 5126, "count": 0, "type": "SCALAR"})
    primitive = file.primitive() | {"indices": empty} if indexed else {"attributes": {"POSITION": empty}}
    file.node(mesh=file.mesh(primitive))
    scene = read(file)
    assert len(scene.document["shapes"]) == 1
    assert noted(scene) == {"/meshes/1/primitives/0": "the primitive has no triangles and is left out"}


def test_images_of_other_files_are_no_loss_but_a_refusal() -> None:
    """The file came alone: a zip has them."""
    file = textured()
    put(file, "images/0", {"uri": "wood.png"})
    with pytest.raises(ParseError, match="upload a zip of the model and its files"):
        read(file)
