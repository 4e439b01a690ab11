"""The rule by which every reader finds what a file calls by a name: by its path, else by a kindred one or a name."""

from __future__ import annotations

import base64
import io
import json
import unicodedata
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.cli.program import main
from service.formats.read.references import Finder
from service.formats.types import AssetInfo
from service.server.assets import AssetStore
from tests import asset_files as make
from tests.gltf_files import Gltf
from tests.mtlx_files import from_graph, graph, mtlx, node, surface, value
from tests.obj_files import QUAD, TEXTURED, zipped
from tests.usd_files import material, mesh, texture, usda

OAK = make.png(np.full((2, 2, 3), (200, 100, 50), np.uint8))
PINE = make.png(np.full((2, 2, 3), (50, 100, 200), np.uint8))
SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
Files = dict[str, bytes | str]


def _mtl(reference: str) -> Files:
    return {"a.obj": TEXTURED, "m.mtl": f"newmtl m\nKd 1 1 1\nmap_Kd {reference}\n"}


def _gltf(reference: str) -> Files:
    file = Gltf()
    index = file.texture(np.zeros((2, 2, 3), np.uint8))
    file.of({"pbrMetallicRoughness": {"baseColorTexture": {"index": index}}})
    uri = "data:application/octet-stream;base64," + base64.b64encode(file.binary).decode()
    named = {"images": [{"uri": reference}], "buffers": [{"byteLength": len(file.binary), "uri": uri}]}
    return {"a.gltf": json.dumps({**file.tree, **named})}


def _mtlx(reference: str) -> Files:
    image = node("image", "img", "color3", value("file", reference, "filename", colorspace="srgb_texture"))
    return {"a.mtlx": mtlx(graph(image, out="img color3"), surface("gltf_pbr", from_graph("base_color", "out")))}


def _ply(reference: str) -> Files:
    uvs = {"st": SQUARE[:, :2]}
    made = make.ply(SQUARE, [[0, 1, 2, 3]], more=uvs)
    return {"a.ply": made.replace(b"comment made by hand", f"comment TextureFile {reference}".encode())}


def _usd(reference: str) -> Files:
    shown = texture("T", reference)
    made = material("M", "color3f inputs:diffuseColor.connect = </M/T.outputs:rgb>", shown)
    uvs = 'texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (interpolation = "vertex")'
    return {"a.usda": usda(made + mesh("Q", f"rel material:binding = </M>\n{uvs}"))}


READERS: dict[str, Callable[[str], Files]] = {"MTL": _mtl, "glTF": _gltf, "MaterialX": _mtlx, "PLY": _ply}
NFC, NFD = (unicodedata.normalize(form, "tex/Bäume.png") for form in ("NFC", "NFD"))
# What the file says, the file of the zip that is meant, and whether that is a guess, which is told.
WAYS = {
    "to the letter": ("tex/oak.png", "tex/oak.png", False),
    "a step up and down": ("./x/../tex/oak.png", "tex/oak.png", False),
    "case": ("Tex/OAK.png", "tex/Oak.PNG", False),
    "composed": (NFC, NFD, False),
    "decomposed": (NFD, NFC, False),
    "backslashes": ("tex\\oak.png", "tex/oak.png", False),
    "a drive": ("C:\\work\\maps\\oak.png", "tex/oak.png", True),
    "a share": ("\\\\nas\\maps\\Oak.png", "tex/oak.png", True),
    "a root": ("/home/me/oak.png", "tex/oak.png", True),
    "another folder": ("textures/oak.png", "oak.png", True),
    "no folder": ("oak.png", "textures/oak.png", True),
    "outside": ("../../oak.png", "textures/oak.png", True),
}
BLANKS = {"blanks": ("tex/my oak.png", "tex/my oak.png", False)}
CASES = [
    pytest.param(reader, *way, id=f"{name}, {how}")
    for name, reader in READERS.items()
    for how, way in {**WAYS, **BLANKS}.items()
]
CASES += [
    pytest.param(_usd, *WAYS[how], id=f"USD, {how}", marks=pytest.mark.usd)
    for how in ("to the letter", "case", "decomposed", "a root", "no folder", "another folder")
]


def image(store: AssetStore, info: AssetInfo) -> bytes | None:
    textures = store.materials(info.id).document.get("textures", {})
    return store.read(next(iter(textures.values()))["asset"]) if textures else None


def told(info: AssetInfo, word: str = "is not there") -> list[str]:
    return [warning["detail"] for warning in info.warnings or [] if word in warning["detail"]]


@pytest.mark.parametrize(("reader", "reference", "path", "is_guess"), CASES)
def test_a_part_is_found(
    store: AssetStore, reader: Callable[[str], Files], reference: str, path: str, is_guess: bool
) -> None:
    """Beside another image, which nothing names."""
    info = store.add(zipped({**reader(reference), path: OAK, "tex/other.png": PINE}))
    assert image(store, info) == OAK
    guesses = told(info)
    assert bool(guesses) == is_guess
    assert all(repr(path) in detail and "is used" in detail for detail in guesses)


@pytest.mark.parametrize("name", READERS)
def test_two_files_of_one_name_are_none(store: AssetStore, name: str) -> None:
    """A guess between them would be a wrong picture half of the time; the one beside the file is no guess between
    them."""
    files = {**READERS[name]("C:\\maps\\oak.png"), "b/oak.png": OAK, "c/OAK.png": PINE}
    info = store.add(zipped(files))
    assert image(store, info) is None
    assert any("oak.png" in detail for detail in told(info, "oak.png"))
    info = store.add(zipped({**files, "oak.png": PINE}))
    assert image(store, info) == PINE and "beside it" in told(info)[0]


def test_the_letter_comes_before_case() -> None:
    finder = Finder(["a/Oak.png", "a/oak.png", "A/x.png", "b/Y.png", "b/y.PNG"])
    for reference in ("a/oak.png", "a/Oak.png"):
        found = finder.find("m.obj", reference)
        assert found is not None and (found.path, found.remark) == (reference, "")
    assert finder.find("m.obj", "b/y.png") is None, "two, neither of which is meant more than the other"
    assert finder.find("m.obj", "") is None and finder.find("m.obj", "a") is None


def test_a_library_and_a_buffer_are_found_likewise(store: AssetStore) -> None:
    obj = QUAD + "mtllib C:\\work\\My Parts.mtl\nusemtl m\nf 1/1 2/2 3/3 4/4\n"
    info = store.add(zipped({"source/a.obj": obj, "lib/my parts.mtl": "newmtl m\nmap_Kd oak.png", "oak.png": OAK}))
    assert image(store, info) == OAK and len(told(info)) == 2
    file = Gltf().of({})
    tree = {**file.tree, "buffers": [{"byteLength": len(file.binary), "uri": "../bin/The%20Scene.bin"}]}
    info = store.add(zipped({"model/a.gltf": json.dumps(tree), "the scene.bin": file.binary}))
    assert info.triangles == 2 and len(told(info)) == 1
    two = QUAD + "mtllib a.mtl B.mtl\nusemtl m\nf 1/1 2/2 3/3 4/4\n"
    libraries: Files = {"A.mtl": "newmtl n\nKd 1 0 0", "b.mtl": "newmtl m\nmap_Kd oak.png"}
    info = store.add(zipped({"a.obj": two, **libraries, "oak.png": OAK}))
    assert image(store, info) == OAK and told(info) == []


def latin(files: dict[str, bytes], name: bytes, coded: bytes) -> bytes:
    """A zip in which a name has other bytes, with no word of which characters they are."""
    data = zipped(dict(files))
    assert len(name) == len(coded) and data.count(name) >= 2
    return data.replace(name, coded)


@pytest.mark.parametrize("coding", ["utf-8", "latin-1"])
@pytest.mark.parametrize("stored", ["utf-8 with its flag", "utf-8 without", "latin-1", "cp437"])
def test_names_in_old_code_pages(store: AssetStore, coding: str, stored: str) -> None:
    """Of libraries, textures and materials; bytes of the zip's names that say nothing of their characters."""
    library = "newmtl Bäume\nKd 1 1 1\nmap_Kd grün.png\n".encode(coding)
    model = (QUAD + "mtllib m.mtl\nusemtl Bäume\nf 1/1 2/2 3/3 4/4\n").encode(coding)
    if stored.endswith("flag"):
        data = zipped({"a.obj": model, "m.mtl": library, "grün.png": OAK})
    else:
        coded = "grün.png".encode(stored.split()[0])
        plain = b"gr" + b"_" * (len(coded) - 7) + b"n.png"
        data = latin({"a.obj": model, "m.mtl": library, plain.decode(): OAK}, plain, coded)
    info = store.add(data)
    assert info.warnings is None and image(store, info) == OAK
    assert list(store.materials(info.id).document["materials"]) == ["Bäume"]


@pytest.mark.parametrize(
    ("uri", "path"),
    [
        ("my%20tex.png", "my tex.png"),
        ("my%20tex.png", "my%20tex.png"),
        ("gr%C3%BCn.png", "grün.png"),
        ("gr%FCn.png", "grün.png"),
        ("a%5Cb.png", "a/b.png"),
        ("file:///C:/work/oak.png", "tex/oak.png"),
    ],
)
def test_uris_of_gltf(store: AssetStore, uri: str, path: str) -> None:
    assert image(store, store.add(zipped({**_gltf(uri), path: OAK}))) == OAK


@pytest.mark.parametrize("scheme", ["data:", "Data:", "DATA:"])
@pytest.mark.parametrize("coding", [";base64", ";BASE64", ""])
def test_schemes_have_no_case(store: AssetStore, scheme: str, coding: str) -> None:
    """`data:` without base64 has its bytes by percent signs."""
    body = base64.b64encode(OAK).decode() if coding else "".join(f"%{byte:02X}" for byte in OAK)
    (text,) = _gltf(f"{scheme}image/png{coding},{body}").values()
    info = store.add(str(text).encode())
    assert info.kind == "scene" and image(store, info) == OAK


def test_a_data_uri_needs_a_comma(store: AssetStore) -> None:
    (text,) = _gltf("data:image/png").values()
    (warning,) = store.add(str(text).encode()).warnings or []
    assert warning["pointer"] == "/images/0/uri" and warning["detail"].startswith("is a `data:` URI without a comma")


ON_DISK = {"MTL": "a.obj", "glTF": "a.gltf", "MaterialX": "a.mtlx", "PLY": "a.ply"}


@pytest.mark.parametrize("name", ON_DISK)
@pytest.mark.parametrize("how", ["to the letter", "case", "decomposed", "backslashes", "a drive", "no folder"])
def test_the_command_line_finds_parts_by_the_same_rule(
    name: str, how: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("SUNBOX_DATA_DIR", str(tmp_path / "data"))
    reference, path, is_guess = WAYS[how]
    for each, data in {**READERS[name](reference), path: OAK, "tex/other.png": PINE}.items():
        (tmp_path / "in" / each).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "in" / each).write_bytes(data.encode() if isinstance(data, str) else data)
    target = tmp_path / "s.json"
    assert main(["import", str(tmp_path / "in" / ON_DISK[name]), "-o", str(target)]) == 0
    assert ("is not there" in capsys.readouterr().err) == is_guess
    (found,) = json.loads(target.read_text())["textures"].values()
    assert (tmp_path / found["asset"]).read_bytes() == OAK


def test_a_ply_s_texture_needs_coordinates_and_may_be_lost(store: AssetStore) -> None:
    bare = make.ply(SQUARE, [[0, 1, 2, 3]]).replace(b"made by hand", b"TextureFile oak.png")
    info = store.add(zipped({"a.ply": bare, "oak.png": OAK}))
    assert image(store, info) is None and told(info, "no texture coordinates")
    info = store.add(zipped(_ply("lost.png")))
    assert told(info, "'lost.png' is not there")


def test_the_package_of_a_model_holds_its_parts_by_their_own_names(store: AssetStore) -> None:
    """Taken from among others, it is read as before."""
    files: dict[str, Any] = {**_mtl("C:\\oak.png"), "tex/Oak.png": OAK, "b.stl": make.stl(SQUARE[[[0, 1, 2]]])}
    info = store.add(zipped(files), entry="a.obj")
    assert image(store, info) == OAK and len(told(info)) == 1
    names = zipfile.ZipFile(io.BytesIO(store.read(info.id))).namelist()
    assert names == ["a.obj", "m.mtl", "tex/Oak.png"]
