"""Cryptomatte files, read by the rules of the specification."""

from __future__ import annotations

import io
import json
import os
import struct
from typing import Any

import httpx
import numpy as np
import pytest

from service.formats import images
from service.formats.images.cryptomatte import Cryptomatte, id_bits, murmur3, names_of
from service.formats.images.metadata import exr_attributes
from tests.calls import is_problem
from tests.serving import SCENE, SMALL, Server

SHAPES = [{"name": "ball"}, {}, {"name": "ball"}, {"name": "größe/ß"}]
NAMES = ["ball", "/shapes/1", "ball /shapes/2", "größe/ß"]


@pytest.mark.parametrize(
    ("text", "hash"),
    [("", 0), ("hello", 0x248BFA47), ("hello, world", 0x149BBB7F),
     ("The quick brown fox jumps over the lazy dog", 0x2E4FF723)],
)  # fmt: skip
def test_hashes_are_those_that_others_publish(text: str, hash: int) -> None:
    assert murmur3(text.encode()) == hash


def test_every_id_is_a_normal_float() -> None:
    ids = np.array([id_bits(f"thing {i}") for i in range(20_000)], np.uint32)
    shown = ids.view(np.float32)
    assert np.isfinite(shown).all() and (np.abs(shown) >= np.finfo(np.float32).tiny).all()
    changed = [i for i in range(20_000) if murmur3(f"thing {i}".encode()) != ids[i]]
    assert 20 < len(changed) < 400, "2 of 256 exponents are no normal float"


def test_shapes_of_one_name_are_told_apart() -> None:
    found = names_of({"shapes": SHAPES, "materials": {"b": {}, "a": {}}})
    assert found == {"shape_coverage": NAMES, "material_coverage": ["b", "a"]}


def read(data: bytes) -> dict[str, dict[str, np.ndarray]]:
    """The mattes of a file: {layer: {name: (height, width) coverage}}, by its metadata alone."""
    import OpenImageIO as oiio

    fd = os.memfd_create("test")
    os.write(fd, data)
    file: Any = oiio.ImageInput.open(f"/proc/self/fd/{fd}")
    os.close(fd)
    channels, pixels = list(file.spec().channelnames), np.asarray(file.read_image("float"))
    attributes = exr_attributes(data)
    layers = {name[:-5]: text.decode() for name, text in attributes.items() if name.endswith("/name")}
    out: dict[str, dict[str, np.ndarray]] = {}
    for key, layer in layers.items():
        assert key == f"cryptomatte/{murmur3(layer.encode()):08x}"[:19]
        assert attributes[f"{key}/hash"] == b"MurmurHash3_32"
        assert attributes[f"{key}/conversion"] == b"uint32_to_float32"
        levels = sorted(name[:-2] for name in channels if name.startswith(layer) and name.endswith(".R"))
        at = [channels.index(f"{level}.{c}") for level in levels for c in "RGBA"]
        ids, shares = pixels[..., at[0::2]], pixels[..., at[1::2]]
        assert (np.diff(shares, axis=-1) <= 0).all(), "the largest share comes first"
        out[layer] = {}
        for name, bits in json.loads(attributes[f"{key}/manifest"]).items():
            (id,) = struct.unpack("<f", struct.pack("<I", int(bits, 16)))
            out[layer][name] = np.where(ids == np.float32(id), shares, 0).sum(-1)
    return out


def test_mattes_are_read_back() -> None:
    shapes = np.zeros((2, 3, 12), np.float32)
    shapes[0, 0, :6] = 4, 0.5, 1, 0.25, 2, 0.125
    shapes[1, 2, :4] = -1, 0.75, 3, 0.25
    materials = np.zeros((2, 3, 12), np.float32)
    matte = Cryptomatte(
        {"shape_coverage": shapes, "material_coverage": materials},
        {"shape_coverage": NAMES, "material_coverage": ["m"]},
    )
    color = np.random.default_rng(0).random((2, 3, 4)).astype(np.float32)
    data = images.encode_layers({"color": color}, {"scene": 1}, matte)
    found = read(data)
    assert found["CryptoObject"]["/environment"][1, 2] == 0.75
    assert images.read_metadata(data) == {"scene": 1} and set(found) == {"CryptoObject", "CryptoMaterial"}
    assert [found["CryptoObject"][name][0, 0] for name in NAMES] == [0.25, 0.125, 0, 0.5]
    assert found["CryptoObject"]["ball /shapes/2"][1, 2] == 0.25 and not found["CryptoMaterial"]["m"].any()


def test_a_server_writes_them(server: Server) -> None:
    http: httpx.Client = server.http
    body = {"scene": SCENE, "settings": SMALL}
    id = http.post("/v1/renders", json=body, params={"wait": 60}).json()["id"]
    image = f"/v1/renders/{id}/image"
    found = read(http.get(image, params={"format": "exr", "cryptomatte": True}).content)
    assert set(found["CryptoMaterial"]) == {*SCENE["materials"], "/environment"}
    depth = np.load(io.BytesIO(http.get(image, params={"format": "npy", "aov": "depth"}).content))[..., 0]
    for layer in found.values():
        np.testing.assert_allclose(sum(layer.values()), 1, atol=1e-5)
        assert ((layer["/environment"] < 1) == (depth > 0)).all() and (layer["/environment"] == 1).any()
    assert is_problem(http.get(image, params={"cryptomatte": True}), 422, "/cryptomatte")
