"""OBJ with materials: what becomes of each statement, and what of broken, hostile or incomplete zips."""

from __future__ import annotations

import io
import stat
import struct
import zipfile
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from PIL import Image

from service.config import Config
from service.formats import AssetInfo
from service.formats.errors import ParseError
from service.formats.read import archive
from service.formats.read.zips.importer import read_zip
from service.formats.scene_import import take_apart
from service.formats.types import AssetLimits
from service.problems import AssetError
from service.server.assets import AssetStore
from tests.asset_files import OBJ, png
from tests.obj_files import GREY, NORMALS, QUAD, TEXTURED, zipped

BARE = QUAD + "mtllib m.mtl\nusemtl m\nf 1 2 3 4\n"
FADING = np.full((4, 4, 4), 128, np.uint8)
IMAGES = {"grey.png": png(GREY), "normals.png": png(NORMALS), "fading.png": png(FADING)}

BROKEN = IMAGES["grey.png"][:20]


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[AssetStore]:
    opened = AssetStore(tmp_path_factory.mktemp("data"), Config(max_asset=64 << 20))
    yield opened
    opened.close()


def imported(store: AssetStore, files: dict[str, bytes | str]) -> tuple[dict[str, Any], AssetInfo, list[str]]:
    """The document, what the upload was answered with, and its warnings' details."""
    info = store.add(zipped(files))
    return store.scene(info.id).document, info, [warning["detail"] for warning in info.warnings or []]


def material(store: AssetStore, text: str, obj: str = TEXTURED) -> tuple[dict[str, Any], list[str]]:
    """What one material becomes, and the warnings."""
    images = {name: image for name, image in IMAGES.items() if name in text}
    document, _, details = imported(store, {"a.obj": obj, "m.mtl": "newmtl m\n" + text, **images})
    (found,) = document["materials"].values()
    return found, details


PLAIN = {"type": "diffuse", "albedo": 0.5}
SHINY = {"type": "principled", "base_color": 0.5, "metallic": 0.0, "specular": 0.5, "roughness": 1.0}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("Kd 0.5 0.5 0.5", PLAIN),
        ("kd 0.5\nillum 1\nKs 1 1 1\nNs 50", PLAIN),
        ("Kd 0.25 0.5 1  # blue", {"type": "diffuse", "albedo": [0.25, 0.5, 1.0]}),
        ("", {"type": "diffuse", "albedo": 0.8}),
        ("Kd .5 .5 .5\nKe 17 12 4", PLAIN | {"emission": [17.0, 12.0, 4.0]}),
        ("Ka 1 1 1\nKd .5 .5 .5", PLAIN),
        ("Ka 0 0 0\nKd 0 0 0", PLAIN | {"albedo": 0.0}),
        ("Ka spectral a.rfl\nKd .5 .5 .5", PLAIN),
        ("map_Ka grey.png\nKd 0 0 0\nmap_Kd grey.png", PLAIN | {"albedo": {"texture": "grey", "factor": 1.0}}),
        ("Kd .5 .5 .5\nd 0.25", PLAIN | {"alpha": 0.25}),
        ("Kd .5 .5 .5\nTr 0.25", PLAIN | {"alpha": 0.75}),
        ("Kd .5 .5 .5\nKs .5 .5 .5\nNs 0", SHINY),
        ("Kd .5 .5 .5\nKs .5 .5 .5\nNs 30", SHINY | {"roughness": 0.5}),  # alpha^2 = 2 / 32 = 1 / 16
        ("Kd .5 .5 .5\nKs .5 .25 0", SHINY | {"specular_color": [1.0, 0.5, 0.0]}),
        ("Kd .5 .5 .5\nPr 0.3\nPm 0.75", SHINY | {"roughness": 0.3, "metallic": 0.75}),
        ("Kd .5 .5 .5\nPr 1\nPc 1\nPcr 0.1", SHINY | {"clearcoat": 1.0, "clearcoat_roughness": 0.1}),
        ("Kd .5 .5 .5\nPr 1\nPs 0.5", SHINY | {"sheen": 0.5}),
        ("Kd .5 .5 .5\nPr 1\naniso 0.5\nanisor 0.25", SHINY | {"anisotropic": 0.5, "anisotropic_rotation": 90.0}),
        ("Kd .5 .5 .5\nNi 3\nPr 1", SHINY | {"ior": 3.0}),  # F0 = 1/4 at Ks = 0.5
        (
            "Kd 0 0 0\nKs .9 .8 .7\nillum 3\nNs 10",
            {"type": "principled", "base_color": [0.9, 0.8, 0.7], "metallic": 1.0, "roughness": 0.0},
        ),
        (
            "Kd 0 0 0\nTf .9 1 1\nillum 7\nNi 1.33\nNs 10",
            {"type": "principled", "base_color": [0.9, 1.0, 1.0], "metallic": 0.0, "specular": 0.5, "ior": 1.33,
             "roughness": 0.0, "transmission": 1.0},
        ),
        (
            "Kd 1 1 1\nd 0.25\nillum 9",
            {"type": "principled", "base_color": 1.0, "metallic": 0.0, "specular": 0.5, "ior": 1.5,
             "roughness": 0.0, "transmission": 0.75},
        ),
        ("Kd .5 .5 .5\nillum 7\nd 1\nTf 1 1 1", PLAIN),
        ("Kd .5 .5 .5\nmap_Kd grey.png", {"type": "diffuse", "albedo": {"texture": "grey", "factor": 0.5}}),
        ("Kd 0 0 0\nmap_Kd grey.png", {"type": "diffuse", "albedo": {"texture": "grey", "factor": 1.0}}),
        ("Kd .5 .5 .5\nmap_Ke grey.png", PLAIN | {"emission": {"texture": "grey", "factor": 1.0}}),
        ("Kd .5 .5 .5\nmap_d grey.png", PLAIN | {"alpha": {"texture": "grey", "channel": "r", "factor": 1.0}}),
        ("Kd .5 .5 .5\nmap_d fading.png", PLAIN | {"alpha": {"texture": "fading", "channel": "a", "factor": 1.0}}),
        (
            "Kd .5 .5 .5\nmap_d -imfchan g fading.png",
            PLAIN | {"alpha": {"texture": "fading", "channel": "g", "factor": 1.0}},
        ),
        (
            "Kd .5 .5 .5\nmap_Pr grey.png\nmap_Pm -imfchan b grey.png",
            SHINY
            | {
                "roughness": {"texture": "grey", "channel": "r", "factor": 1.0},
                "metallic": {"texture": "grey", "channel": "b", "factor": 1.0},
            },
        ),
        ("Kd .5 .5 .5\nnorm -bm 2 normals.png", PLAIN | {"normal_map": {"texture": "normals", "scale": 2.0}}),
        (
            "Kd .5 .5 .5\nKs 0 0 0\nPr 1\nmap_Ks grey.png",
            SHINY | {"specular": 1.0, "specular_color": {"texture": "grey", "factor": 1.0}},
        ),
    ],
)  # fmt: skip
def test_statements_become_parameters(store: AssetStore, text: str, expected: dict[str, Any]) -> None:
    found, details = material(store, text)
    assert found == expected and details == []


@pytest.mark.parametrize(
    ("text", "detail"),
    [
        ("Ka 1 1 1", "a colour of ambient light (Ka) is not used; Kd is"),
        ("Ka 1 0 0\nKd 0 0 0", "a colour of ambient light (Ka) is not used; Kd is"),
        ("Kd .5 .5 .5\nmap_Ka grey.png", "a texture of ambient light (map_Ka) is not used; map_Kd is"),
        ("bump grey.png", "without -bm, 0.01 m from black to white are assumed"),
        ("bump -bm 0.05 grey.png", "-bm 0.05 is taken for the metres"),
        ("map_Bump normals.png", "is used as a normal map"),
        ("norm normals.png\ndisp grey.png", "the normal map shows them"),
        ("refl -type sphere grey.png", "reflection maps"),
        ("map_Kd lost.png", "the texture 'lost.png' is not there"),
        ("map_Kd C:\\\\pictures\\\\lost.png", "is not there; the material is shown without it"),
        ("map_Kd ../lost.png", "the texture '../lost.png' is not there"),
        ("map_Kd m.mtl", "is not in a supported format"),
        ("map_Kd -cc on grey.png", "the option -cc is not supported"),
        ("map_Kd -t 1 1 1 grey.png", "turbulence"),
        ("map_Kd -o 1e20 grey.png", "the option -o has a number beyond 1e9"),
        ("norm -bm -1 normals.png", "a negative scale (-bm) is not supported"),
        ("map_Kd", "map_kd names no file"),
        ("Kd spectral copper.rfl", "kd is not followed by the numbers that it needs"),
        ("Kd 1 nan 1", "kd is not followed by the numbers that it needs"),
        ("Ns 1e999", "ns is not followed by the numbers that it needs"),
        ("Kd 1e300 0 -2", "kd outside 0..1 is not supported; it is clamped"),
        ("Ke 1e30 0 0", "an emission (Ke) below 0 or above 1e20"),
        ("Ns -5\nKs 1 1 1", "an exponent (Ns) of -5 is not supported"),
        ("Ni 1e300\nPr 1", "an index (Ni) of 1e+300 is not supported; 4 is used"),
        ("wobble 3", "the statement 'wobble' is not supported"),
        ("newmtl m\nKd 1 0 0", "defined twice; the first definition is used"),
    ],
)
def test_what_is_not_taken_is_said(store: AssetStore, text: str, detail: str) -> None:
    _, details = material(store, text)
    assert [said for said in details if detail in said], details
    assert len(details) == 1, details


@pytest.mark.parametrize(
    ("text", "height", "said"),
    [
        ("bump -bm 0.05 grey.png", {"scale": 0.05}, ["-bm 0.05 is taken for the metres"]),
        ("map_disp -imfchan b fading.png", {"texture": "fading", "channel": "b"}, ["0.01 m from black to white"]),
        ("disp grey.png\nbump fading.png", {"texture": "fading"}, ["under bump are used", "holds heights"]),
        ("norm normals.png\nbump grey.png", {"shading": False}, ["unless a shape has displacement"]),
        ("bump normals.png\ndisp grey.png", {"shading": False}, ["holds normals", "unless a shape"]),
    ],
)
def test_bump_and_disp_are_heights(store: AssetStore, text: str, height: dict[str, Any], said: list[str]) -> None:
    found, details = material(store, text)
    assert found["height"] == {"texture": "grey", "channel": "r", "scale": 0.01} | height
    assert ("normal_map" in found) == ("normals.png" in text)
    assert len(details) == len(said) and all(any(each in d for d in details) for each in said), details


def test_a_texture_needs_coordinates(store: AssetStore) -> None:
    found, details = material(store, "Kd .5 .5 .5\nPr 1\nmap_Kd grey.png\naniso 1", BARE)
    assert found == SHINY
    assert len(details) == 2 and "no texture coordinates" in details[0] and "anisotropy" in details[1]


def test_options_of_a_map(store: AssetStore) -> None:
    text = "newmtl m\nmap_Kd -clamp on -s 2 3 1 -o 0.5 grey.png\nmap_Ke my grey.png\n"
    files = {"a.obj": TEXTURED, "m.mtl": text, "grey.png": IMAGES["grey.png"], "my grey.png": IMAGES["fading.png"]}
    document, _, details = imported(store, files)
    first, second = document["textures"].values()
    assert first == {"asset": first["asset"], "wrap": "clamp", "scale": [2.0, 3.0], "offset": [0.5, 0.0]}
    assert list(document["textures"]) == ["grey", "my grey"] and set(second) == {"asset"} and details == []
    assert store.image(second["asset"]).pixels.shape == (4, 4, 4)


def test_each_material_has_its_triangles(store: AssetStore) -> None:
    uses = ["f 1 2 3", "usemtl two", "usemtl one", "f 1 2 3 4", "usemtl lost", "f 2 3 4", " usemtl one", "f 3 4 5"]
    obj = QUAD + "\n".join(["v 5 5 5", "mtllib m.mtl", *uses])
    document, info, details = imported(store, {"in a/folder/a.obj": obj, "in a/folder/m.mtl": "newmtl one\nKd 1 0 0"})
    assert [shape["material"] for shape in document["shapes"]] == ["default", "one", "lost"]
    meshes = [store.mesh(shape["asset"]) for shape in document["shapes"]]
    assert [len(mesh.faces) for mesh in meshes] == [1, 3, 1] and info.triangles == 5
    np.testing.assert_array_equal(meshes[1].vertices[meshes[1].faces[2]], [[1, 1, 0], [0, 1, 0], [5, 5, 5]])
    assert info.bounds == [[0, 0, 0], [5, 5, 5]]
    assert document["materials"]["lost"] == {"type": "diffuse", "albedo": 0.8}
    assert [said for said in details if "'lost' is not defined" in said]


def test_vertices_carry_what_the_file_gives_them(store: AssetStore) -> None:
    obj = "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nvn 0 0 1\nvt 0.25 0.75\nf 1/1/1 2/1/1 3/1/1\n"
    document, *_ = imported(store, {"a.obj": obj})
    mesh = store.mesh(document["shapes"][0]["asset"])
    assert mesh.normals is not None and mesh.uvs is not None and mesh.colors is not None
    np.testing.assert_array_equal(mesh.normals, [[0, 0, 1]] * 3)
    np.testing.assert_array_equal(mesh.uvs, [[0.25, 0.75]] * 3)
    np.testing.assert_array_equal(mesh.colors[:, :3], np.eye(3))


@pytest.mark.parametrize("library", ["lost.mtl", "a.obj", "../m.mtl", "a.mtl b.mtl", "/etc/passwd"])
def test_a_library_that_is_not_there(store: AssetStore, library: str) -> None:
    """Its materials are grey; a file that names itself is not read again."""
    document, _, details = imported(store, {"a.obj": BARE.replace("m.mtl", library)})
    assert document["materials"] == {"m": {"type": "diffuse", "albedo": 0.8}}
    assert [said for said in details if "is not there; its materials are shown grey" in said]


def test_libraries_with_blanks_and_several_of_them(store: AssetStore) -> None:
    files = {"my m.mtl": "newmtl m\nKd 1 0 0", "b.mtl": "newmtl m\nKd 0 1 0\nnewmtl n\nKd 0 0 1"}
    for libraries in ("my m.mtl\nmtllib b.mtl b.mtl", "my m.mtl b.mtl", "b.mtl  my m.mtl  # two"):
        obj = BARE.replace("m.mtl", libraries) + "usemtl n\nf 1 2 3\n"
        document, _, details = imported(store, {"a.obj": obj, **files})
        first = [0.0, 1.0, 0.0] if libraries.startswith("b") else [1.0, 0.0, 0.0]
        assert [one["albedo"] for one in document["materials"].values()] == [first, [0.0, 0.0, 1.0]]
        assert not [said for said in details if "not there" in said]


WORDS = (
    "nan",
    "1e999",
    "-1",
    "1e19",
    "../",
    "\0",
    "#",
    "\\",
    "newmtl",
    "usemtl",
    "f",
    "C:\\x",
    "-s",
    "-bm",
    "-imfchan",
    "é",
)


def mutated(text: str, rng: np.random.Generator) -> bytes:
    """The text with a few characters changed, pieces cut out, doubled, or words put in."""
    for _ in range(rng.integers(1, 7)):
        at = int(rng.integers(len(text) + 1))
        piece = [chr(rng.integers(256)), f" {rng.choice(WORDS)} ", text[at - 20 : at], ""][rng.integers(4)]
        text = text[:at] + piece + text[at + int(rng.integers(8)) :]
    return text.encode()


def test_nonsense_is_a_scene_or_is_refused() -> None:
    """Nothing but a ParseError comes out, and what is read is a valid document."""
    library = "newmtl m\n" + "\n".join(
        ["Kd 0.5 0.5 0.5", "Ks .5 .5 .5", "Ns 100", "Ni 1.5", "Tr 0.5", "illum 7", "Tf 1 1 1", "Ke 1 2 3", "Pr .5",
         "Pm .5", "Pc 1", "aniso .5", "anisor .3", "map_Kd -s 1 2 3 -o .5 -clamp on grey.png", "bump normals.png",
         "map_d -imfchan m fading.png", "map_Pr grey.png", "map_Ke grey.png"]
    )  # fmt: skip
    rng, scenes = np.random.default_rng(5), 0
    for _ in range(400):
        files = {"a.obj": TEXTURED.encode(), "m.mtl": library.encode()} | IMAGES
        broken = "m.mtl" if rng.random() < 0.7 else "a.obj"
        files[broken] = mutated(files[broken].decode(), rng)
        try:
            take_apart(read_zip(archive.zipped(files), AssetLimits()), lambda part: "sha256:" + "0" * 64)
            scenes += 1
        except ParseError:
            pass
    assert scenes > 200


def test_a_plain_obj_stays_a_mesh(store: AssetStore) -> None:
    info = store.add(TEXTURED.encode())
    assert (info.kind, info.triangles, info.warnings) == ("mesh", 2, None)


def test_a_zip_is_a_mesh_where_one_is_needed(store: AssetStore) -> None:
    info = store.add(zipped({"a.obj": TEXTURED}))
    assert info.kind == "scene" and len(store.mesh(info.id).faces) == 2


def renamed(data: bytes, name: str, to: str) -> bytes:
    """A zip with an entry's name changed in both of its places, which `zipfile` itself would not write."""
    assert len(name) == len(to)
    return data.replace(name.encode(), to.encode())


def link() -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as made:
        made.writestr("a.obj", OBJ)
        entry = zipfile.ZipInfo("m.mtl")
        entry.external_attr = (stat.S_IFLNK | 0o777) << 16
        made.writestr(entry, "/etc/passwd")
    return out.getvalue()


def encrypted() -> bytes:
    data = bytearray(zipped({"a.obj": OBJ}))
    for signature, at in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        data[data.index(signature) + at] |= 1
    return bytes(data)


def lying() -> bytes:
    """Its directory promises fewer bytes than there are."""
    data = bytearray(zipped({"a.obj": OBJ + b"# " + b"x" * 5000}))
    struct.pack_into("<I", data, data.index(b"PK\x01\x02") + 24, 40)
    return bytes(data)


def bomb(entries: int = 1) -> bytes:
    return zipped({"a.obj": OBJ, **{f"{k}.png": bytes(48 << 20) for k in range(entries)}})


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (zipped({"a.txt": "hello"}), "the zip holds a.txt; no model"),
        (zipped({"a.obj": OBJ, "b/c.OBJ": OBJ}), "the zip holds 2 models, a.obj and b/c.OBJ; choose one by its name"),
        (zipped({"/etc/a.obj": OBJ}), "leads out of its folder"),
        (zipped({"b/../../a.obj": OBJ}), "leads out of its folder"),
        (renamed(zipped({"a.obj": OBJ, "C__x": ""}), "C__x", "C:/x"), "leads out of its folder"),
        (renamed(zipped({"a.obj": OBJ, "C__x": ""}), "C__x", "..\\x"), "leads out of its folder"),
        (renamed(zipped({"a.obj": OBJ, "_x": ""}), "_x", "\\x"), "leads out of its folder"),
        (renamed(zipped({"a.obj": OBJ, "b.obj": "x"}), "b.obj", "a.obj"), "two files named 'a.obj'"),
        (link(), "is a link"),
        (encrypted(), "is encrypted"),
        (zipped({"a.obj": OBJ}, zipfile.ZIP_LZMA), "compressed in a way that is not supported"),
        (zipped({"a.obj": OBJ})[:-30], "can't be read as a zip"),
        (b"PK\x03\x04" + bytes(100), "can't be read as a zip"),
        (zipped({"a.obj": OBJ}, zipfile.ZIP_STORED).replace(b"v 1 0 0", b"v 2 0 0"), "bad crc-32"),
        (lying(), "can't be unpacked"),
        (bomb(), "its files hold 50331680 bytes; 18349696 are allowed, for a zip of 49140"),
        (bomb(2), "its files hold 100663328 bytes; "),
        (zipped({"a.obj": b""}), "it has no faces"),
        (zipped({"a.obj": OBJ.replace(b"1 0 0", b"1e999 0 0")}), "is not finite"),
        (zipped({"a.obj": OBJ.replace(b"1 0 0", b"1e30 0 0")}), "beyond 1e9 m"),
        (zipped({"a.obj": BARE, "m.mtl": b"x" * (17 << 20)}, zipfile.ZIP_STORED), "allowed of a material library"),
    ],
)  # fmt: skip
def test_bad_zips_are_refused(store: AssetStore, data: bytes, said: str) -> None:
    with pytest.raises(AssetError) as refused:
        store.add(data)
    assert said in refused.value.detail, refused.value.detail


@pytest.mark.parametrize("statement", ["map_d", "map_Kd", "bump", "map_Ke"])
def test_broken_images_are_left_out(store: AssetStore, statement: str) -> None:
    cut = png(np.full((8, 8, 3), 200, np.uint8))[:-20]
    for image in (BROKEN, cut):
        files = {"a.obj": TEXTURED, "m.mtl": f"newmtl m\nKd .5 .5 .5\n{statement} p.png", "p.png": image}
        info = store.add(zipped(files))
        assert not store.scene(info.id).document.get("textures") and info.warnings
        assert "left out" in str(info.warnings) and "p.png" in str(info.warnings)


@pytest.mark.parametrize("format", ["BMP", "TGA", "GIF", "TIFF", "PCX"])
def test_images_of_older_programs_are_textures(store: AssetStore, format: str) -> None:
    made = io.BytesIO()
    Image.new("RGB", (3, 2), (200, 100, 50)).save(made, format)
    name = f"p.{format.lower()}"
    files = {"a.obj": TEXTURED, "m.mtl": f"newmtl m\nmap_Kd {name}", name: made.getvalue()}
    info = store.add(zipped(files))
    (texture,) = store.scene(info.id).document["textures"].values()
    assert store.image(texture["asset"]).pixels[0, 0].tolist() == [200, 100, 50] and not info.warnings


def test_a_zip_of_many_entries_is_refused(store: AssetStore) -> None:
    data = zipped({"a.obj": OBJ, **{str(k): "" for k in range(archive.MOST_ENTRIES)}}, zipfile.ZIP_STORED)
    with pytest.raises(AssetError, match="10001 entries; 10000 are allowed"):
        store.add(data)


def test_what_is_not_referred_to_is_not_unpacked(store: AssetStore) -> None:
    """A broken file that no material names is nobody's business, and so is what macOS puts into a zip."""
    data = zipped({"a.obj": OBJ, "notes.txt": "hello", "__MACOSX/a.obj": "junk", "b/.DS_Store": "junk"})
    broken = data.replace(b"hello", b"jello")
    assert broken == data or store.add(broken).kind == "scene"
    assert store.add(data).triangles == 1
