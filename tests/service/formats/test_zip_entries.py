"""How the entries of a zip are written, and models without a mesh beside materials."""

from __future__ import annotations

import io
import struct
import zipfile
import zlib
from pathlib import Path

import numpy as np
import pytest

from service.formats.errors import MissingExtra
from service.formats.read.usd_names import may_show
from service.formats.read.zips import importer as zips
from service.formats.read.zips.importer import read_zip
from service.formats.types import AssetLimits
from service.problems import AssetError
from service.server.assets import AssetStore
from tests import asset_files as make
from tests.gltf_files import Gltf
from tests.mtlx_files import mtlx, surface, value
from tests.obj_files import TEXTURED, zipped
from tests.usd_files import usdc

OAK = make.png(np.full((2, 2, 3), (200, 100, 50), np.uint8))
MTLX = mtlx(surface("gltf_pbr", value("base_color", "1, 0.5, 0", "color3")))
BARE = b"""#usda 1.0
def Material "M" {
    token outputs:surface.connect = </M/S.outputs:surface>
    def Shader "S" {
        uniform token info:id = "UsdPreviewSurface"
        token outputs:surface
    }
}
"""


def written(entries: list[tuple[zipfile.ZipInfo, bytes | str]]) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as made:
        for entry, data in entries:
            made.writestr(entry, data)
    return out.getvalue()


def shown(store: AssetStore, data: bytes) -> bytes:
    """The image of the only texture."""
    (texture,) = store.materials(store.add(data).id).document["textures"].values()
    return store.read(texture["asset"])


def test_backslashes_part_folders(store: AssetStore) -> None:
    """As some programs on Windows write them, directories as well."""
    files = {"m\\": b"", "m\\tex\\": b"", "m\\a.obj": TEXTURED, "m\\tex\\oak.png": OAK}
    library = "newmtl m\nmap_Kd tex/oak.png\n"
    data = written([(zipfile.ZipInfo(name), text) for name, text in (files | {"m\\m.mtl": library}).items()])
    info = store.add(data)
    assert info.kind == "scene" and not info.warnings and shown(store, data) == OAK


def test_a_name_that_is_written_once_more_in_utf_8(store: AssetStore) -> None:
    def entry(checked: str) -> zipfile.ZipInfo:
        made = zipfile.ZipInfo("xx.png")
        name = b"\1" + struct.pack("<I", zlib.crc32(checked.encode())) + "木.png".encode()
        made.extra = struct.pack("<HH", 0x5555, 1) + b"x" + struct.pack("<HH", 0x7075, len(name)) + name
        return made

    model = [(zipfile.ZipInfo("a.obj"), TEXTURED), (zipfile.ZipInfo("m.mtl"), "newmtl m\nmap_Kd 木.png\n")]
    assert shown(store, written([*model, (entry("xx.png"), OAK)])) == OAK
    other = store.add(written([*model, (entry("another.png"), OAK)]))
    assert "'木.png' is not there" in str(other.warnings), "it belongs to a name that the entry had before"


@pytest.mark.parametrize("library", ["utf-8", "the same"])
@pytest.mark.parametrize(
    ("page", "name"),
    [("cp850", "grün"), ("cp1252", "grün"), ("cp866", "дерево"), ("cp1251", "дерево"), ("cp932", "木目表"),
     ("gbk", "木纹"), ("cp949", "나무"), ("cp950", "木紋")],
)  # fmt: skip
def test_names_in_the_code_page_of_a_system(store: AssetStore, page: str, name: str, library: str) -> None:
    """As Windows zips them; its programs write names in UTF-8 or in the same page."""
    text = f"newmtl m\nmap_Kd tex/{name}.png\n".encode(page if library == "the same" else library)
    raw = name.encode(page)
    data = zipped({"a.obj": TEXTURED, "m.mtl": text, f"tex/{'#' * len(raw)}.png": OAK}, zipfile.ZIP_STORED)
    assert shown(store, data.replace(b"#" * len(raw), raw)) == OAK


def test_the_same_file_twice_is_one(store: AssetStore) -> None:
    files = [("a.obj", TEXTURED), ("m.mtl", "newmtl m\nmap_Kd oak.png\n"), ("oak.png", OAK), ("oak.png", OAK)]
    with pytest.warns(UserWarning, match="Duplicate"):
        data = written([(zipfile.ZipInfo(name), text) for name, text in files])
    assert not store.add(data).warnings and shown(store, data) == OAK


@pytest.mark.usd
def test_materials_beside_a_layer_without_a_mesh(store: AssetStore) -> None:
    """As ambientCG's downloads have them."""
    files: dict[str, bytes | str] = {"bricks.usda": BARE, "bricks_color.png": OAK}
    info = store.add(zipped(files))
    assert info.kind == "materials" and shown(store, zipped(files)) == OAK
    assert [warning["pointer"] for warning in info.warnings or ()] == ["bricks.usda"]
    with pytest.raises(AssetError, match=r"bricks\.usda: the scene has no triangles"):
        store.add(zipped({"bricks.usda": BARE, "cover.png": OAK}))
    with pytest.raises(AssetError, match="no triangles"):
        store.add(zipped(files), entry="bricks.usda")


def test_without_the_extra_materials_are_taken_from_beside_a_layer_that_shows_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(zips, "find_spec", lambda name: None)
    limits = AssetLimits()
    found = read_zip(zipped({"bricks.usda": BARE, "bricks_color.png": OAK}), limits)
    assert list(found.document["materials"]) == ["bricks"]
    assert [warning["pointer"] for warning in found.warnings] == ["bricks.usda"]
    shows = (BARE + b'def Mesh "B" { }', BARE + b'def "A" (references = @a.usdc@) { }', b"PXR-USDC broken")
    for layer in shows:  # a model is not thrown away for its images
        with pytest.raises(MissingExtra, match=r"sunbox-server\[usd\]"):
            read_zip(zipped({"bricks.usda": layer, "bricks_color.png": OAK}), limits)
    with pytest.raises(MissingExtra, match=r"sunbox-server\[usd\]"):
        read_zip(zipped({"bricks.usda": BARE, "cover.png": OAK}), limits)


@pytest.mark.usd
def test_a_binary_layer_says_whether_it_shows_anything(tmp_path: Path) -> None:
    for layer, shows in ((BARE, False), (BARE + b'def Sphere "B" { }', True)):
        assert may_show(usdc(layer, tmp_path)) == may_show(layer) == shows


def test_materialx_beside_a_gltf_without_a_mesh(store: AssetStore) -> None:
    bare = Gltf()
    bare.tree |= {"nodes": [{}], "scenes": [{"nodes": [0]}], "scene": 0}
    info = store.add(zipped({"a.glb": bare.glb(), "a.mtlx": MTLX}))
    assert info.kind == "materials"
    assert [warning["detail"] for warning in info.warnings or ()] == ["a.glb of the zip is not used by the materials"]
