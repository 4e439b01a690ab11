"""glTF files whose views are compressed by meshopt, and whose images are KTX2."""

from __future__ import annotations

import base64
import random
import sys
from collections.abc import Iterator
from typing import Any

import meshopt
import numpy as np
import pytest

from service.formats import AssetLimits
from service.formats.cache import refused
from service.formats.errors import MissingExtra, ParseError
from service.formats.read.gltf.importer import read_scene
from service.formats.types import Pose
from service.problems import AssetError, NotProvided
from service.server.assets import AssetStore
from service.server.assets.posing import posed_scene
from tests import asset_files as make
from tests.gltf_files import QUAD, QUAD_FACES, Gltf
from tests.parsing import one_child
from tests.service.formats.scenes import corners, imported

EXT = "EXT_meshopt_compression"
NORMALS = np.tile(np.array([0, 0, 1, 0], "<f4"), (4, 1))
COLORS = np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [255, 255, 0]]], np.uint8)
# COLORS on 8 x 8 texels each, encoded by Binomial's encoder; the second with alpha 0 in its lower half.
UASTC = (
    "q0tUWCAyMLsNChoKAAAAAAEAAAAQAAAAEAAAAAAAAAAAAAAAAQAAAAEAAAACAAAAaAAAACwAAACUAAAAJAAAAAAAAAAAAAAAAAAA"
    "AAAAAAC4AAAAAAAAADwAAAAAAAAAAAEAAAAAAAAsAAAAAAAAAAIAKACmAQIAAwMAABAAAAAAAAAAAAB/AAAAAAAAAAAA/////x8A"
    "AABLVFh3cml0ZXIAQmFzaXMgVW5pdmVyc2FsIDIuMTAAACi1L/1gAACVAQDw9x8A4B96ABfgH+AfAg8XAOD/HwLgAff/H+AffA8A"
    "BwAFEgAgnwG5A5YCWGwmAgUwAg=="
)
ETC1S = (
    "q0tUWCAyMLsNChoKAAAAAAEAAAAQAAAAEAAAAAAAAAAAAAAAAQAAAAEAAAABAAAAaAAAADwAAACkAAAAJAAAAMgAAAAAAAAAkwAA"
    "AAAAAABbAQAAAAAAAAwAAAAAAAAAAAAAAAAAAAA8AAAAAAAAAAIAOACjAQIAAwMAAAgIAAAAAAAAAAA/AAAAAAAAAAAA/////0AA"
    "Pw8AAAAAAAAAAP////8fAAAAS1RYd3JpdGVyAEJhc2lzIFVuaXZlcnNhbCAyLjEwAAAGAAMALAAAAA0AAAAyAAAAAAAAAAAAAAAA"
    "AAAABwAAAAcAAAAFAAAAIMBEAAAAAAAA4kQEMBEAAAAAAIAsEAAmAAAAAAAAEAKACQAAAAAAAARwdDZUVVVVBQAAAKiqqqoCFMBE"
    "AAAAAAAA4oEBMAVAAAAAAIBkIALiBgwAAAjCosU4OHICp2gAzAAAAAAAACAFCAB3Bh+8MwgBPVf4dgQ="
)


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[AssetStore]:
    with one_child():
        store = AssetStore(tmp_path_factory.mktemp("data"))
        yield store
        store.close()


def packed(file: Gltf, rows: np.ndarray, mode: str, filter: str = "NONE", name: str = EXT, version: int = 0) -> int:
    """A view that has its bytes in compressed form only: a buffer without data stands for what they would be."""
    data = meshopt.encode_gltf_buffer(rows, mode, version)
    size = rows.dtype.itemsize * (rows.shape[1] if rows.ndim > 1 else 1)
    number = file.view(data)
    at = file.tree["bufferViews"][number]
    how = {"buffer": 0, "byteOffset": at["byteOffset"], "byteLength": len(data), "byteStride": size}
    extension = {name: how | {"count": len(rows), "mode": mode, "filter": filter}}
    view = {"buffer": 1, "byteLength": size * len(rows), "extensions": extension}
    return file.add("bufferViews", view | ({"byteStride": size} if mode == "ATTRIBUTES" else {}))


def accessor(file: Gltf, view: int, component: int, count: int, type: str, **more: Any) -> int:
    return file.add(
        "accessors", {"bufferView": view, "componentType": component, "count": count, "type": type, **more}
    )


def glb(file: Gltf, name: str = EXT) -> bytes:
    file.tree["extensionsRequired"] = [name]
    fallback = {"byteLength": 1 << 20, "extensions": {name: {"fallback": True}}}
    file.tree["buffers"] = [{"byteLength": len(file.binary)}, fallback]
    return make.glb(file.tree, file.binary + b"\0" * (-len(file.binary) % 4))


def quad(name: str = EXT, version: int = 0) -> Gltf:
    """Positions by the exponential filter, normals by the octahedral one, a turn by the quaternion's."""
    file = Gltf()
    positions = meshopt.encode_filter_exp(QUAD, 15).view("<u4")
    normals = meshopt.encode_filter_oct(NORMALS, 4, 8)
    half = np.sqrt(0.5)
    turns = meshopt.encode_filter_quat(np.array([[0, 0, 0, 1], [0, 0, half, half]], "<f4"), 8, 16)
    position = accessor(file, packed(file, positions, "ATTRIBUTES", "EXPONENTIAL", name, version), 5126, 4, "VEC3")
    shading = packed(file, normals, "ATTRIBUTES", "OCTAHEDRAL", name, version)
    normal = accessor(file, shading, 5120, 4, "VEC3", normalized=True)
    faces = accessor(file, packed(file, QUAD_FACES, "TRIANGLES", name=name), 5123, 6, "SCALAR")
    node = file.node(mesh=file.mesh({"attributes": {"POSITION": position, "NORMAL": normal}, "indices": faces}))
    turn = packed(file, turns.view("<u8").reshape(-1, 1), "ATTRIBUTES", "QUATERNION", name, version)
    sampler = {"input": file.accessor(np.array([0, 1], "<f4")),
               "output": accessor(file, turn, 5122, 2, "VEC4", normalized=True)}  # fmt: skip
    channel = {"sampler": 0, "target": {"node": node, "path": "rotation"}}
    file.add("animations", {"name": "turn", "samplers": [sampler], "channels": [channel]})
    return file


@pytest.mark.parametrize(("name", "version"), [(EXT, 0), ("KHR_meshopt_compression", 1)])
def test_meshopt(store: AssetStore, name: str, version: int) -> None:
    info = store.add(glb(quad(name, version), name))
    assert info.warnings is None
    (shape,) = store.scene(info.id).document["shapes"]
    faces = corners(store, shape)
    # The encoder may turn a triangle's first corner, and nothing else.
    assert sorted(map(sorted, faces.tolist())) == sorted(map(sorted, QUAD[QUAD_FACES.reshape(-1, 3)].tolist()))
    mesh = store.mesh(shape["asset"])
    assert mesh.normals is not None and np.allclose(mesh.normals, NORMALS[:, :3], atol=0.01)
    (shape,) = posed_scene(store, info.id, Pose(animation="turn", time=1)).document["shapes"]
    turned = np.reshape(shape["transform"]["matrix"], (4, 4))[:2, :2]
    assert np.allclose(turned, [[0, -1], [1, 0]], atol=1e-3)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"count": 3}, "asks for 4 items of 12 bytes|cannot be decoded"),
        ({"byteLength": 9}, "byteLength: is of data that cannot be decoded"),
        ({"mode": "POINTS"}, "mode: must be one of ATTRIBUTES"),
        ({"filter": "GAUSS"}, "filter: must be one of NONE"),
        ({"byteStride": 7}, "cannot be decoded .a row must be"),
        ({"count": 1 << 40}, "count: makes .* bytes"),
        ({"byteOffset": 1 << 40}, "byteLength: ends at byte"),
        ({"buffer": 7}, "refers to /buffers/7"),
    ],
)
def test_broken_meshopt_is_refused_by_its_place(change: dict[str, Any], message: str) -> None:
    file = quad()
    view = next(one for one in file.tree["bufferViews"] if one.get("byteStride") == 12)
    view["extensions"][EXT] |= change
    with pytest.raises(ParseError, match=message):
        read_scene(glb(file), AssetLimits())


def test_meshopt_data_broken_at_random(store: AssetStore) -> None:
    """Whatever the bytes are, the file is read or refused with a pointer, and the child goes on."""
    rng, count = random.Random(3), 0
    for _ in range(60):
        file = quad()
        data = bytearray(file.binary)
        for _ in range(rng.randint(1, 4)):
            data[rng.randrange(len(data))] = rng.randrange(256)
        file.binary = bytes(data)
        try:
            store.add(glb(file))
        except AssetError as error:
            count += 1
            assert error.place.startswith("/"), error
    assert 0 < count < 60
    assert len(store.loader.sandbox.children.idle) == 1, "none crashed"


def textured(data: bytes, **more: Any) -> Gltf:
    file = Gltf()
    image = file.add("images", {"bufferView": file.view(data), "mimeType": "image/ktx2"})
    index = file.add("textures", {"extensions": {"KHR_texture_basisu": {"source": image}}, **more})
    file.tree["extensionsRequired"] = ["KHR_texture_basisu"]
    return file.of({"pbrMetallicRoughness": {"baseColorTexture": {"index": index}}, "alphaMode": "BLEND"})


@pytest.mark.parametrize(("text", "bands"), [(UASTC, 3), (ETC1S, 4)])
def test_ktx2(store: AssetStore, text: str, bands: int) -> None:
    """Its texels, upright; it has alpha only where the file has."""
    found = imported(store, textured(base64.b64decode(text)))
    (texture,) = found.document["textures"].values()
    pixels = store.image(texture["asset"]).pixels
    assert pixels.shape == (16, 16, bands) and not found.warnings
    assert np.abs(pixels[4::8, 4::8, :3].astype(int) - COLORS).max() < 4
    (material,) = found.document["materials"].values()
    assert ("alpha" in material) == (bands == 4)


def test_broken_ktx2_is_left_out(store: AssetStore) -> None:
    whole, rng = base64.b64decode(UASTC), random.Random(2)
    plain = bytearray(whole)
    plain[12:16] = (37).to_bytes(4, "little")  # VK_FORMAT_R8G8B8A8_UNORM
    faces = bytearray(whole)
    faces[36:40] = (6).to_bytes(4, "little")
    wide = bytearray(whole)
    wide[20:24] = (1 << 30).to_bytes(4, "little")
    count = 0
    for data in (plain, faces, wide, whole[:60], whole[:-9], *(_flipped(whole, rng) for _ in range(40))):
        info = store.add(textured(bytes(data)).glb())
        if info.warnings:
            count += 1
            assert "left out" in str(info.warnings) and not store.scene(info.id).document.get("textures")
    assert count > 20
    assert len(store.loader.sandbox.children.idle) == 1, "none crashed"


def _flipped(data: bytes, rng: random.Random) -> bytes:
    changed = bytearray(data)
    for _ in range(3):
        changed[rng.randrange(12, len(changed))] = rng.randrange(256)
    return bytes(changed)


def test_a_missing_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """By 501, as it is the server that lacks something."""
    cases = {"meshopt": glb(quad()), "opengl_basisu": textured(base64.b64decode(UASTC)).glb()}
    for module, data in cases.items():
        monkeypatch.setitem(sys.modules, module, None)
        with pytest.raises(MissingExtra, match=module.replace("_", "-")) as missing:
            read_scene(data, AssetLimits())
        assert isinstance(refused("the GLB file", missing.value), NotProvided)
