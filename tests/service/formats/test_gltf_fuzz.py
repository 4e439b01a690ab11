"""Files with something wrong in them somewhere: read or refused, in time, by a place of their own."""

from __future__ import annotations

import copy
import random
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.config import Config
from service.document import parse_scene
from service.formats.types import Pose
from service.problems import AssetError, UnsupportedMedia
from service.server.assets import AssetStore
from service.server.assets.posing import posed_scene
from tests import asset_files as make
from tests.gltf_files import QUAD, QUAD_UVS, Gltf
from tests.parsing import one_child

FILES = 200
SECONDS, MEGABYTES = 5, 1024  # what reading any file may cost; after more a child is ended, and another is there
VALUES: list[Any] = [
    *(None, True, False, -1, 0, 1, 2, 3, 7, 255, 2**31, 2**32 - 1, 2**53, 2**62, -(2**40), 0.5, -0.25, 1e300, 1e-300),
    *(
        float("nan"),
        float("inf"),
        "",
        "x",
        "../x",
        "data:,",
        "data:;base64,AAAA",
        [],
        {},
        [0],
        [[]],
        [1, 2, 3],
        {"a": 1},
    ),
    *(5120, 5121, 5125, 5126, "SCALAR", "VEC2", "VEC3", "VEC4", "MAT4", "MASK", "BLEND", [0] * 16, [1e30] * 3),
]


def sound() -> Gltf:
    """A little of everything that is read."""
    file = Gltf()
    pixels = np.arange(48, dtype=np.uint8).reshape(4, 4, 3)
    sampler = file.add("samplers", {"wrapS": 33071, "wrapT": 33071, "magFilter": 9729})
    info = {
        "index": file.texture(pixels, sampler=sampler),
        "texCoord": 0,
        "extensions": {
            "KHR_texture_transform": {"offset": [0.1, 0.2], "rotation": 1, "scale": [2, 2], "texCoord": 1}
        },
    }
    extensions = {
        "clearcoat": {"clearcoatFactor": 1, "clearcoatTexture": info, "clearcoatNormalTexture": info},
        "sheen": {"sheenColorFactor": [1, 1, 1], "sheenColorTexture": info, "sheenRoughnessTexture": info},
        "specular": {"specularFactor": 0.5, "specularTexture": info, "specularColorFactor": [2, 1, 1]},
        "anisotropy": {"anisotropyStrength": 0.5, "anisotropyTexture": info},
        "transmission": {"transmissionFactor": 0.5, "transmissionTexture": info},
        "volume": {"thicknessFactor": 1, "attenuationDistance": 2, "attenuationColor": [1, 0, 0]},
        "ior": {"ior": 1.3},
        "diffuse_transmission": {"diffuseTransmissionFactor": 0.5, "diffuseTransmissionTexture": info},
        "emissive_strength": {"emissiveStrength": 3},
    }
    rough = {"baseColorTexture": info, "metallicRoughnessTexture": info, "baseColorFactor": [1, 1, 1, 0.5]}
    made = {
        "pbrMetallicRoughness": rough,
        "normalTexture": info,
        "emissiveTexture": info,
        "emissiveFactor": [1, 1, 1],
    }
    named = {f"KHR_materials_{name}": value for name, value in extensions.items()}
    file.add("materials", {**made, "extensions": named, "alphaMode": "BLEND", "doubleSided": True})
    glossy = {"diffuseTexture": info, "specularGlossinessTexture": info}
    file.add("materials", {"extensions": {"KHR_materials_pbrSpecularGlossiness": glossy}, "alphaMode": "MASK"})
    normals, joints = np.tile(np.array([0, 0, 1], "<f4"), (4, 1)), np.zeros((4, 4), np.uint8)
    weights, colors = np.tile(np.array([1, 0, 0, 0], "<f4"), (4, 1)), np.ones((4, 4), "<f4")
    rows = {"POSITION": QUAD, "NORMAL": normals, "TEXCOORD_0": QUAD_UVS, "TEXCOORD_1": QUAD_UVS, "COLOR_0": colors}
    target = {"POSITION": file.accessor(QUAD), "NORMAL": file.accessor(normals)}
    first = file.primitive(rows, material=0, targets=[target])
    replaced = {"bufferView": file.view(b"\2"), "componentType": 5121}
    sparse = {"count": 1, "indices": replaced, "values": {"bufferView": file.view(QUAD[:1].tobytes())}}
    file.tree["accessors"][first["attributes"]["POSITION"]]["sparse"] = sparse
    strip = file.primitive(rows, np.array([0, 1, 3, 2], np.uint8), mode=5, material=1)
    mesh = file.mesh(first, strip, weights=[0.5])
    skinned = file.mesh(file.primitive({"POSITION": QUAD, "JOINTS_0": joints, "WEIGHTS_0": weights}))
    joint = file.node(translation=[0, 1, 0])
    bound = file.accessor(np.eye(4, dtype="<f4").reshape(1, 16))
    skin = file.add("skins", {"joints": [joint], "inverseBindMatrices": bound})
    child = file.node(False, mesh=mesh, matrix=np.eye(4).reshape(-1).tolist())
    file.node(mesh=mesh, children=[child], translation=[1, 2, 3], rotation=[0, 0, 0, 1], scale=[1, -1, 1])
    file.node(mesh=skinned, skin=skin)
    moves = {"attributes": {"TRANSLATION": file.accessor(QUAD)}}
    file.node(mesh=mesh, extensions={"EXT_mesh_gpu_instancing": moves})
    lens = {"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1}}
    file.node(camera=file.add("cameras", lens), extensions={"KHR_lights_punctual": {"light": 0}})
    light = {"type": "spot", "color": [1, 1, 1], "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.3}}
    variants = {"variants": [{"name": "other"}]}
    file.tree["extensions"] = {"KHR_lights_punctual": {"lights": [light]}, "KHR_materials_variants": variants}
    first["extensions"] = {"KHR_materials_variants": {"mappings": [{"material": 1, "variants": [0]}]}}
    spline = np.arange(18).reshape(6, 3)
    bent = (joint, "translation", "CUBICSPLINE", [0, 1], spline)
    file.animation("bend", bent, (joint, "rotation", "LINEAR", [0, 1], np.eye(4)[:2]))
    return file


def places(value: Any, keys: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    for key, inner in value.items() if isinstance(value, dict) else enumerate(value):
        yield (*keys, key)
        if isinstance(inner, dict | list):
            yield from places(inner, (*keys, key))


def mutated(file: Gltf, rng: random.Random) -> bytes:
    """One to three values changed, taken away or made to point elsewhere; or bytes flipped, or the end cut off."""
    way = rng.random()
    if way < 0.2:
        data = bytearray(file.glb())
        for _ in range(rng.randint(1, 8)):
            data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
        return bytes(data)
    if way < 0.25:
        return file.glb()[: rng.randrange(20, 4000)]
    changed = Gltf()
    changed.binary, changed.tree = file.binary, copy.deepcopy(file.tree)
    for _ in range(rng.randint(1, 3)):
        *keys, last = rng.choice(list(places(changed.tree)))
        holder: Any = changed.tree
        for key in keys:
            holder = holder[key]
        if rng.random() < 0.2:
            del holder[last]
        elif isinstance(holder[last], int) and rng.random() < 0.5:
            holder[last] = rng.randrange(12)
        else:
            holder[last] = copy.deepcopy(rng.choice(VALUES))
    return changed.glb()


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[AssetStore]:
    with one_child():
        store = AssetStore(tmp_path_factory.mktemp("data"), Config(parse_seconds=SECONDS))
        yield store
        store.close()


def tried(store: AssetStore, data: bytes) -> str:
    """Why it was refused, or "" when it was read."""
    try:
        info = store.add(data, "model/gltf-binary")
    except (AssetError, UnsupportedMedia) as error:
        return error.detail
    if info.kind == "scene":
        try:
            parse_scene(store.scene(info.id).document)
            name = info.animations[0]["name"] if info.animations else None
            pose = Pose(info.variants[0] if info.variants else None, name, 0.4)
            parse_scene(posed_scene(store, info.id, pose).document)
        except AssetError as error:
            return error.detail
    return ""


def test_the_sound_file_is_read(store: AssetStore) -> None:
    assert tried(store, sound().glb()) == ""


@pytest.mark.slow
def test_files_with_a_mistake_are_read_or_refused(store: AssetStore) -> None:
    file, rng, read = sound(), random.Random(6), 0
    for _ in range(FILES):
        reason = tried(store, mutated(file, rng))
        read += not reason
        # A library's own words, or none at all, are no help to whoever made the file.
        assert "Traceback" not in reason and "Error:" not in reason, reason
    assert 0.05 * FILES < read < 0.9 * FILES
    (child,) = store.loader.sandbox.children.idle  # nothing crashed or had to be killed
    peak = re.search(r"VmHWM:\s+(\d+) kB", Path(f"/proc/{child.process.pid}/status").read_text())
    assert peak is not None and int(peak[1]) < MEGABYTES << 10


@pytest.mark.parametrize("count", [2**26, 2**31 - 1])
def test_accessors_that_ask_for_gigabytes(store: AssetStore, count: int) -> None:
    file = sound()
    file.tree["accessors"][0] = {"componentType": 5126, "count": count, "type": "VEC3", "sparse": {}}
    assert re.match(r"the GLB file: (/accessors/0/|reading it takes more than)", tried(store, file.glb()))


def test_one_buffer_in_very_many_views(store: AssetStore) -> None:
    """A megabyte of file that asks for gigabytes: a thousand primitives, each a new mesh of one long buffer."""
    file = Gltf()
    position = file.accessor(np.random.default_rng(1).random((1 << 17, 3), np.float32))
    primitives = []
    for k in range(1000):
        view = {"bufferView": 0, "byteOffset": 12 * k, "componentType": 5126, "count": (1 << 17) - k, "type": "VEC3"}
        primitives.append({"attributes": {"POSITION": file.add("accessors", view)}})
    assert position == 0
    file.node(mesh=file.mesh(*primitives))
    assert "allowed" in tried(store, file.glb())


def test_nested_without_end(store: AssetStore) -> None:
    file = Gltf()
    file.node(mesh=file.mesh())
    for k in range(5000):
        file.node(False, children=[k + 2])
    file.node(False, children=[1])
    file.tree["scenes"][0]["nodes"].append(1)
    assert "a second time" in tried(store, file.glb())
    assert "JSON" in tried(store, make.glb({"asset": {}}).replace(b'{"asset": {}}', b'{"asset":' + b"[" * 4))
