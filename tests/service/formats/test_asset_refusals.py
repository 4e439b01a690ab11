"""Broken, lying and huge files are refused: quickly, cheaply, with a reason, and without a crash."""

from __future__ import annotations

import json
import re
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.config import Config
from service.problems import AssetError, UnsupportedMedia
from service.server.assets import AssetStore
from tests import asset_files as make
from tests.asset_files import OBJ
from tests.gltf_files import Gltf
from tests.parsing import one_child

RNG = np.random.default_rng(11)
SECONDS, MEGABYTES = 5, 1024  # what refusing any file may cost: after more a child is ended, with another reason
QUAD = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
PIXELS = RNG.random((8, 16, 3)).astype(np.float32)
BYTES = RNG.integers(0, 256, (8, 8, 3), np.uint8)


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[AssetStore]:
    with one_child():
        store = AssetStore(tmp_path_factory.mktemp("data"), Config(parse_seconds=SECONDS))
        yield store
        store.close()


def changed(path: str, value: Any) -> bytes:
    """The sound GLB with one value of its JSON replaced."""
    *keys, last = path.split("/")
    tree = make.gltf()
    place: Any = tree
    for key in keys:
        place = place[int(key) if key.isdigit() else key]
    place[int(last) if last.isdigit() else last] = value
    return make.glb(tree)


def with_texel(value: float) -> bytes:
    pixels = PIXELS.copy()
    pixels[2, 3, 1] = value
    return make.exr(pixels)


FACES = OBJ[OBJ.index(b"f") :]
V3 = OBJ[: OBJ.index(b"f")]
GLB = make.glb(make.gltf())
DRACO = make.draco_glb(QUAD.astype(float), np.array([[0, 1, 2], [0, 2, 3]]), QUAD.astype(float))
EXR, HDR, PNG = make.exr(PIXELS), make.hdr(PIXELS), make.png(BYTES)
PLY_BOMB = (
    b"ply\nformat binary_little_endian 1.0\nelement vertex 1000000000\nproperty float x\nproperty float y\n"
    b"property float z\nelement face 0\nproperty list uchar int vertex_indices\nend_header\n" + bytes(100)
)
WINDOW = b"displayWindow\0box2i\0\x10\0\0\0" + bytes(8)
NODES_IN_A_RING: list[dict[str, Any]] = [{"children": [1]}, {"children": [0], "mesh": 0}]
REFUSED: dict[str, tuple[str, bytes, str]] = {
    "OBJ cut in a face": ("m.obj", OBJ[:-4], "line 4: a face needs at least three corners, this one has 1"),
    "OBJ cut after f": ("m.obj", V3 + b"f", "line 4: a face needs"),
    "OBJ cut in a vertex": ("m.obj", b"v 0 0\n" + OBJ, "line 1: `v` needs three numbers"),
    "OBJ index too large": (
        "m.obj",
        V3 + b"f 1 2 4000000000\n",
        "line 4: vertex 4000000000 does not exist; there are 3",
    ),
    "OBJ index of many digits": ("m.obj", V3 + b"f 1 2 " + b"9" * 40, "line 4: vertex"),
    "OBJ index zero": ("m.obj", V3 + b"f 0 1 2\n", "line 4: .*counted from 1"),
    "OBJ index too negative": ("m.obj", V3 + b"f -1 -2 -4\n", "line 4: vertex -4"),
    "OBJ words for numbers": ("m.obj", V3 + b"f 1 2 three\n", "line 4: the line is not understood"),
    "OBJ fractional index": ("m.obj", V3 + b"f 1 2 2.5\n", "line 4: the line is not understood"),
    "OBJ with nan": ("m.obj", OBJ.replace(b"v 1", b"v nan"), "line 2: `v` is not finite"),
    "OBJ with 1e999": ("m.obj", OBJ.replace(b"v 1", b"v 1e999"), "line 2: `v` is not finite"),
    "OBJ beyond 1e9": ("m.obj", OBJ.replace(b"v 1", b"v 2e9"), "line 2: `v` lies beyond 1e9 m"),
    "OBJ without faces": ("m.obj", b"v 0 0 0\n", "no faces"),
    "OBJ of zeros": ("m.obj", bytes(100000), "no faces"),
    "PLY empty": ("m.ply", b"", "empty"),
    "PLY of a billion vertices": ("m.ply", PLY_BOMB, "1000000000 rows of element vertex are promised, 100 bytes"),
    "PLY cut in the header": ("m.ply", PLY_BOMB[:60], "header is cut off"),
    "PLY cut": ("m.ply", make.ply(QUAD, [[0, 1, 2], [0, 1, 2, 3]])[:-1], "cut off: 2 rows of element face"),
    "PLY text cut": ("m.ply", make.ply(QUAD, [[0, 1, 2]], "a")[:-3], "cut off"),
    "PLY index out of range": (
        "m.ply",
        make.ply(QUAD, [[0, 1, 4], [0, 1, 2, -9]]),
        "none of its 2 faces can be used; face 0 .* names vertex 4; there are 4",
    ),
    "PLY of a line": ("m.ply", make.ply(QUAD, [[0, 1]]), "face 0 .* has 2 corners"),
    "PLY with nan": ("m.ply", make.ply(QUAD * np.float32("nan"), [[0, 1, 2]]), "vertex 0 .* not finite"),
    "PLY without faces": ("m.ply", make.ply(QUAD, []), "no faces"),
    "STL cut": ("m.stl", make.stl(np.zeros((1, 3, 3)))[:-7], "not an STL file: 127 bytes; its header promises 134"),
    "STL text cut": ("m.stl", make.stl_text(np.ones((1, 3, 3)))[:-50], "cut off: it does not end with `endsolid`"),
    "STL text with a bad number": (
        "m.stl",
        make.stl_text(np.ones((1, 3, 3))).replace(b"1.0", b"one", 1),
        "triangle 0 .*: vertex 0 .* is not finite",
    ),
    "STL text lacking a vertex": (
        "m.stl",
        make.stl_text(np.ones((4, 3, 3))).replace(b"vertex 1.0 1.0 1.0\nendloop", b"endloop"),
        "none of its 4 facets can be read; the facet of line 2 does not have three vertices",
    ),
    "STL text with a quad": (
        "m.stl",
        make.stl_text(np.ones((1, 3, 3))).replace(b"endloop", b"vertex 1 1 1\nendloop", 1),
        "the facet of line 2 does not have three vertices",
    ),
    "text as STL": ("m.stl", b"hello", "not an STL file"),
    "GLB cut": ("m.glb", GLB[:-50], "cut off: its header promises"),
    "GLB cut in the header": ("m.glb", GLB[:15], "cut off"),
    "text as GLB": ("m.glb", b"hello", "neither a GLB"),
    "GLB asking for 2^31 items": (
        "m.glb",
        changed("accessors/0/count", 2**31 - 1),
        r"/accessors/0/bufferView: asks for",
    ),
    "GLB asking for 2^62 items": (
        "m.glb",
        changed("accessors/0/count", 2**62),
        r"/accessors/0/count: must be a whole number",
    ),
    "GLB with a negative count": ("m.glb", changed("accessors/0/count", -3), "/accessors/0/count: must be"),
    "GLB with no data": (
        "m.glb",
        changed("accessors/0", {"componentType": 5126, "count": 3, "type": "VEC3", "extensions": {"EXT_packed": {}}}),
        r"/accessors/0/extensions: its data are there in compressed form only \(EXT_packed\)",
    ),
    "GLB with sparse zeros without end": (
        "m.glb",
        changed("accessors/0", {"componentType": 5126, "count": 2**40, "type": "VEC3", "sparse": {}}),
        r"/accessors/0/count: is 1099511627776",
    ),
    "GLB view beyond its buffer": (
        "m.glb",
        changed("bufferViews/0/byteLength", 4000),
        r"/bufferViews/0/byteLength: ends",
    ),
    "GLB buffer beyond the file": (
        "m.glb",
        changed("buffers/0/byteLength", 4000),
        r"/buffers/0/byteLength: promises",
    ),
    "GLB for later readers": ("m.glb", changed("asset/minVersion", "2.1"), "/asset/minVersion: .* needs '2.1'"),
    "GLB of another version": ("m.glb", changed("asset/version", "1.0"), "/asset/version: .*version '1.0'"),
    "GLB index out of range": (
        "m.glb",
        changed("accessors/0/count", 2),
        "/meshes/0/primitives/0/attributes/NORMAL: has 3 items for 2",
    ),
    "GLB naming no mesh": (
        "m.glb",
        changed("nodes/0/mesh", 7),
        "/nodes/0/mesh: refers to /meshes/7",
    ),
    "GLB of nodes in a ring": ("m.glb", make.glb(make.gltf(NODES_IN_A_RING)), "must form a tree"),
    "GLB without triangles": ("m.glb", changed("nodes/0", {}), "no triangles"),
    "GLB with a NaN transform": (
        "m.glb",
        changed("nodes/0/scale", [1, float("nan"), 1]),
        "/nodes/0/scale/1: must be a finite",
    ),
    "GLB needing what is not read": (
        "m.glb",
        make.glb(make.gltf(extensionsRequired=["EXT_texture_avif"])),
        "/extensionsRequired/0: .*requires 'EXT_texture_avif'",
    ),
    "GLB with broken Draco": (
        "m.glb",
        DRACO.replace(b"DRACO", b"DRACX"),
        "bufferView: does not hold a readable Draco",
    ),
    "GLB with cut Draco": ("m.glb", DRACO[:-24] + bytes(24), "does not hold a readable Draco"),
    "glTF with its buffer elsewhere": (
        "m.gltf",
        json.dumps(make.gltf(buffers=[{"byteLength": 84, "uri": "../../etc/passwd"}])).encode(),
        "/buffers/0/uri: refers to another file.*save the model as a GLB",
    ),
    "glTF from the network": (
        "m.gltf",
        json.dumps(make.gltf(buffers=[{"byteLength": 84, "uri": "http://127.0.0.1:9/x.bin"}])).encode(),
        "/buffers/0/uri: refers to another file",
    ),
    "glTF nested deeply": ("m.gltf", b'{"asset": ' + b"[" * 100000, "neither a GLB|JSON"),
    "EXR cut": ("e.exr", EXR[:-60], "missing or corrupted"),
    "EXR cut by a byte": ("e.exr", EXR[:-1], "missing or corrupted"),
    "EXR cut in the header": ("e.exr", EXR[:200], "header can't be read or is cut off"),
    "EXR bomb": ("e.exr", make.exr(PIXELS, (0, 0, 99999, 99999)), "100000 x 100000 texels; 1 to"),
    "EXR bomb below the limit": ("e.exr", make.exr(PIXELS, (0, 0, 7999, 7999)), "header|missing"),
    "EXR bomb inside out": ("e.exr", make.exr(PIXELS, (0, 0, -2147483648, 2147483647)), "texels; 1 to"),
    "EXR bomb of a display window": (
        "e.exr",
        EXR.replace(WINDOW + struct.pack("<ii", 15, 7), WINDOW + struct.pack("<ii", 10**6, 10**6)),
        "texels; 1 to",
    ),
    "EXR with NaN": ("e.exr", with_texel(float("nan")), "texel at x=3, y=2 is not finite"),
    "EXR with infinity": ("e.exr", with_texel(float("inf")), "texel at x=3, y=2 is not finite"),
    "HDR cut": ("e.hdr", HDR[:-200], r"cut off: it has \d+ of \d+ texels"),
    "HDR cut by a byte": ("e.hdr", HDR[:-1], r"cut off: it has \d+ of \d+ texels"),
    "HDR cut in the header": ("e.hdr", HDR[:30], "header is cut off"),
    "HDR bomb": ("e.hdr", make.hdr(PIXELS, "-Y 200000 +X 200000"), "200000 x 200000 texels; 1 to"),
    "HDR bomb below the limit": (
        "e.hdr",
        make.hdr(PIXELS, "-Y 8000 +X 8000"),
        "cut off: it has 128 of 64000000 texels",
    ),
    "HDR of XYZ": ("e.hdr", HDR.replace(b"rgbe", b"xyze"), "XYZ"),
    "PNG cut": ("x.png", PNG[:60], "cut off"),
    "PNG cut by a byte": ("x.png", PNG[:-1], "cut off"),
    "PNG bomb": ("x.png", make.png(BYTES, 60000, 60000), "60000 x 60000 texels; 1 to"),
    "PNG lying about its size": ("x.png", make.png(BYTES, 2000, 2000), "can't be read as PNG"),
    "PNG of 16 bits cut": ("x.png", make.png(BYTES.astype(np.uint16))[:80], "PNG|read"),
    "PNG of 16 bits, a bomb": ("x.png", make.png(BYTES.astype(np.uint16), 60000, 60000), "texels; 1 to|PNG"),
    "text as PNG": ("x.png", b"hello world", "not a PNG file: it begins with b'hello"),
    "WebP cut": ("x.webp", b"RIFF\x24\0\0\0WEBPVP8 " + bytes(10), "WEBP"),
    "JPEG cut": ("x.jpg", b"\xff\xd8\xff\xe0\0\x10JFIF\0", "JPEG"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refused(store: AssetStore, case: str) -> None:
    name, data, reason = REFUSED[case]
    with pytest.raises(AssetError) as refusal:
        store.add(data, filename=name)
    assert re.search(reason, refusal.value.detail), refusal.value.detail
    assert "/proc" not in refusal.value.detail and "Traceback" not in refusal.value.detail
    # Nothing crashed or had to be killed: one child has read all of them.
    (child,) = store.loader.sandbox.children.idle
    status = Path(f"/proc/{child.process.pid}/status").read_text()
    peak = re.search(r"VmHWM:\s+(\d+) kB", status)
    assert peak is not None and int(peak[1]) < MEGABYTES << 10


@pytest.mark.parametrize("name", ["m.glb", "m.stl", "m.obj", "x.png", "m.fbx"])
@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"\n<!DOCTYPE html>\n<html><body>", "this is a web page"),
        (b"<html>" + b"x" * 500, "this is a web page"),
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:1\nsize 4\n", "this is a pointer of Git LFS"),
    ],
)
def test_what_was_sent_instead_of_a_file(store: AssetStore, name: str, data: bytes, reason: str) -> None:
    with pytest.raises(UnsupportedMedia, match=reason):
        store.add(data, filename=name)


def test_the_child_outlived_them_all(store: AssetStore) -> None:
    store.add(OBJ)
    pid = store.loader.sandbox.children.idle[0].process.pid
    for name, data, _ in REFUSED.values():
        with pytest.raises(AssetError):
            store.add(data, filename=name)
    assert [child.process.pid for child in store.loader.sandbox.children.idle] == [pid]


def test_too_many_triangles(tmp_path: Path) -> None:
    store = AssetStore(tmp_path, Config(max_triangles=3))
    two = Gltf()
    for scale in (1, 2):
        two.node(mesh=two.mesh(two.primitive({"POSITION": QUAD * np.float32(scale)})))
    four = make.gltf([{"mesh": 0, "children": [1, 2]}, {"mesh": 0}, {"mesh": 0, "children": [3]}, {"mesh": 0}])
    assert store.add(make.glb(four)).triangles == 4  # of one mesh, held once
    for data in (two.glb(), OBJ + FACES * 3, make.stl(np.zeros((4, 3, 3)))):
        with pytest.raises(AssetError, match="triangles"):
            store.add(data)
    store.add(OBJ + FACES * 2)
    store.close()


def test_limits_come_from_the_configuration(tmp_path: Path) -> None:
    store = AssetStore(tmp_path, Config(max_texels=100, max_asset=2000))
    with pytest.raises(AssetError, match=r"texels|100"):
        store.add(make.png(np.zeros((8, 16, 3), np.uint8)))
    with pytest.raises(AssetError, match="2000 are allowed"):
        store.add(OBJ + b"#" * 2000)
    store.close()


def test_a_text_chunk_that_inflates(store: AssetStore) -> None:
    squeezer = zlib.compressobj(9)
    body = b"note\0\0" + b"".join(squeezer.compress(bytes(1 << 24)) for _ in range(16)) + squeezer.flush()
    chunk = len(body).to_bytes(4, "big") + b"zTXt" + body + zlib.crc32(b"zTXt" + body).to_bytes(4, "big")
    with pytest.raises(AssetError, match="MAX_TEXT_CHUNK"):
        store.add(PNG[:33] + chunk + PNG[33:])
