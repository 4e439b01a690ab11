"""PLY files as other programs write them."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from service.cli.program import main
from service.formats import MeshData
from service.formats.errors import ParseError
from service.formats.formats import sniff
from service.formats.read.zips.importer import read_zip
from service.formats.sandbox.readers import parse_mesh
from service.formats.types import AssetLimits
from tests.asset_files import png
from tests.obj_files import zipped

VERTICES = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 2, 0]]


def parsed(data: bytes) -> MeshData:
    return parse_mesh("ply", memoryview(data), AssetLimits())


def header(*lines: str, format: str = "ascii", vertex: str = "float") -> str:
    axes = [f"property {vertex} {axis}" for axis in "xyz"]
    whole = ["ply", f"format {format} 1.0", f"element vertex {len(VERTICES)}", *axes, *lines, "end_header", ""]
    return "\n".join(whole)


BODY = "".join(" ".join(map(str, row)) + "\n" for row in VERTICES)


def test_strips_are_triangles_that_all_face_one_way() -> None:
    """Two strips in one list; the repeated vertex turns a corner and makes no triangle."""
    text = header("element tristrips 1", "property list int int vertex_indices") + BODY + "9 0 1 2 3 3 -1 2 3 4\n"
    mesh = parsed(text.encode())
    assert mesh.faces.tolist() == [[0, 1, 2], [2, 1, 3], [2, 3, 4]]
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()


def test_binary_strips_and_faces_together() -> None:
    lines = ("element tristrips 2", "property list int int vertex_indices")
    lines += ("element face 1", "property list uchar int vertex_indices")
    body = np.array(VERTICES, "<f4").tobytes() + struct.pack("<4i5i", 3, 0, 1, 2, 4, 1, 3, 2, 4)
    body += struct.pack("<B3i", 3, 2, 3, 4)
    mesh = parsed(header(*lines, format="binary_little_endian").encode() + body)
    assert mesh.faces.tolist() == [[0, 1, 2], [1, 3, 2], [2, 3, 4], [2, 3, 4]]


def test_a_strip_without_triangles_is_refused() -> None:
    text = header("element tristrips 1", "property list int int vertex_indices") + BODY + "2 0 1\n"
    with pytest.raises(ParseError, match="no faces"):
        parsed(text.encode())


@pytest.mark.parametrize("ending", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("name", ["vertex_indices", "vertex_index", "indices"])
@pytest.mark.parametrize(
    "kinds", ["uchar int", "uint8 uint32", "int int", "uint16 int16", "float64 float", "uchar int64"]
)
def test_types_names_and_line_ends(ending: str, name: str, kinds: str) -> None:
    lines = ("element face 2", "property float32 quality", f"property list {kinds} {name}", "property uint8 flags")
    text = header(*lines, vertex="float64") + BODY + "0.5 3 0 1 2 7\n0.25 4 1 3 4 2 7\n"
    mesh = parsed(text.replace("\n", ending).encode())
    assert sorted(map(sorted, mesh.faces.tolist()))[0] == [0, 1, 2] and len(mesh.faces) == 3


@pytest.mark.parametrize("kind", ["uchar", "int", "uint16"])
def test_colours_up_to_255_whatever_their_type(kind: str) -> None:
    colors = [f"property {kind} {name}" for name in ("red", "green", "blue")]
    body = BODY.replace("\n", " 255 0 128\n")
    mesh = parsed(
        (header(*colors, "element face 1", "property list uchar int vertex_indices") + body + "3 0 1 2\n").encode()
    )
    assert mesh.colors is not None and np.allclose(mesh.colors[0], [1, 0, 0.2159], atol=1e-3)


def test_elements_that_nobody_knows_are_passed_over() -> None:
    lines = ("element material 1", "property list uchar uchar name", "property float shine")
    lines += ("element face 1", "property list uchar int vertex_indices", "element edge 1", "property int vertex1")
    text = header(*lines) + BODY + "3 97 98 99 0.5\n3 0 1 2\n0\n"
    assert parsed(text.encode()).faces.tolist() == [[0, 1, 2]]


@pytest.mark.parametrize("near", ["1 0.5", "2 0.5 9"])
def test_lists_and_numbers_beside_what_is_known(near: str) -> None:
    """Of vertices, whose lists may differ in length, and of elements without properties or rows."""
    beside = ("property list uint8 float32 near", "property uint8 red", "property uint8 green", "property uint8 blue")
    lines = (*beside, "element nothing 0", "element face 1", "property list uchar int vertex_indices")
    first, *rest = BODY.splitlines()
    body = "\n".join([f"{first} {near} 255 0 0", *(f"{row} 1 7 0 255 0" for row in rest), "3 0 1 2", ""])
    mesh = parsed((header(*lines) + body).encode())
    assert mesh.vertices.tolist() == VERTICES and mesh.faces.tolist() == [[0, 1, 2]]
    assert mesh.colors is not None and mesh.colors[:2].tolist() == [[1, 0, 0], [0, 1, 0]]


FACE = "property list uchar int vertex_indices"


def linear(byte: float) -> float:
    return ((byte / 255 + 0.055) / 1.055) ** 2.4


def with_faces(*properties: str, rows: list[str], format: str = "ascii") -> bytes:
    """The vertices, and faces of these properties and rows, as text or the same in binary."""
    lines = (f"element face {len(rows)}", *properties)
    text = header(*lines) + BODY + "".join(row + "\n" for row in rows)
    if format == "ascii":
        return text.encode()
    order = "<" if "little" in format else ">"
    codes = {"uchar": "B", "int": "i", "float": "f"}
    body = b"".join(struct.pack(f"{order}3f", *row) for row in VERTICES)
    for row in rows:
        words = iter(row.split())
        for declared in properties:
            kinds = declared.split()[1:-1]
            count = 1
            if kinds[0] == "list":
                count = int(next(words))
                body += struct.pack(order + codes[kinds[1]], count)
            for _ in range(count):
                value = next(words)
                body += struct.pack(order + codes[kinds[-1]], float(value) if kinds[-1] == "float" else int(value))
    return header(*lines, format=format).encode() + body


FORMATS = ["ascii", "binary_little_endian", "binary_big_endian"]


@pytest.mark.parametrize("format", FORMATS)
@pytest.mark.parametrize("counts", ["3 0 1 2|3 1 3 2|3 2 3 4", "3 0 1 2|3 1 3 2|4 2 3 4 0"])
def test_colours_of_faces(format: str, counts: str) -> None:
    """A vertex of faces of two colours is there twice; between faces of one colour it is shared."""
    colors = ["255 0 0", "255 0 0", "0 0 128"]
    rows = [f"{face} {color}" for face, color in zip(counts.split("|"), colors, strict=True)]
    channels = [f"property uchar {name}" for name in ("red", "green", "blue")]
    mesh = parsed(with_faces(FACE, *channels, rows=rows, format=format))
    assert mesh.colors is not None and not mesh.warnings and len(mesh.vertices) == 7 + (len(mesh.faces) > 3)
    assert mesh.colors[mesh.faces[:2]].tolist() == [[[1, 0, 0]] * 3] * 2
    assert np.allclose(mesh.colors[mesh.faces[2:]], [0, 0, linear(128)], atol=1e-6)
    expected = np.array(VERTICES)[[[0, 1, 2], [1, 3, 2], [2, 3, 4]]]
    assert np.array_equal(mesh.vertices[mesh.faces[:3]], expected)


def test_colours_of_faces_in_floats_are_linear_and_of_vertices_come_first() -> None:
    floats = [f"property float {name}" for name in ("red", "green", "blue")]
    mesh = parsed(with_faces(FACE, *floats, rows=["3 0 1 2 0.5 0.25 1"]))
    assert mesh.colors is not None and mesh.colors[0].tolist() == [0.5, 0.25, 1]
    text = header(*floats, "element face 1", FACE, *floats) + BODY.replace("\n", " 1 0 0\n") + "3 0 1 2 0 1 0\n"
    mesh = parsed(text.encode())
    assert mesh.colors is not None and mesh.colors[0].tolist() == [1, 0, 0]
    assert mesh.warnings == ("the colours of its faces are not shown: its vertices have colours of their own",)


@pytest.mark.parametrize("format", FORMATS)
@pytest.mark.parametrize("mixed", [False, True])
def test_texture_coordinates_of_faces(format: str, mixed: bool) -> None:
    rows = ["3 0 1 2 6 0 0 1 0 0 1", "3 1 3 2 6 1 0 .5 .5 0 1"]
    rows += ["4 2 3 4 0 8 .25 .25 .5 .5 .75 .75 0 0"] if mixed else []
    mesh = parsed(with_faces(FACE, "property list uchar float texcoord", rows=rows, format=format))
    assert mesh.uvs is not None and not mesh.warnings
    assert mesh.uvs[mesh.faces[:2]].tolist() == [[[0, 0], [1, 0], [0, 1]], [[1, 0], [0.5, 0.5], [0, 1]]]
    if mixed:
        assert mesh.uvs[mesh.faces[2]].tolist() == [[0.25, 0.25], [0.5, 0.5], [0.75, 0.75]]


def test_faces_without_their_texture_coordinates_are_told() -> None:
    rows = ["3 0 1 2 6 0 0 1 0 0 1", "3 1 3 2 0", "3 2 3 4 6 nan 1 1 1 1 1"]
    mesh = parsed(with_faces(FACE, "property list uchar float texcoord", rows=rows))
    assert mesh.uvs is not None and mesh.uvs[mesh.faces[1:]].tolist() == [[[0, 0]] * 3, [[0, 0], [1, 1], [1, 1]]]
    assert [warning.partition(";")[0] for warning in mesh.warnings] == [
        "1 face has no texture coordinates",
        "the texture coordinate of corner 6 (counted from 0) is not finite: [nan, 1.0]",
    ]


@pytest.mark.parametrize(
    "names",
    ["s t", "u v", "S T", "texture_u texture_v", "texture_s texture_t", "tex_u tex_v", "texcoord_u texcoord_v",
     "tx ty", "u1 v1", "tu tv", "u0 v0"],
)  # fmt: skip
def test_usual_names_of_texture_coordinates(names: str) -> None:
    properties = [f"property float {name}" for name in names.split()]
    text = header(*properties, "element face 1", FACE) + BODY.replace("\n", " 0.25 0.75\n") + "3 0 1 2\n"
    mesh = parsed(text.encode())
    assert mesh.uvs is not None and mesh.uvs[0].tolist() == [0.25, 0.75] and not mesh.warnings


TEXTURED = (
    header("element face 2", FACE, "property list uchar float texcoord").replace(
        "element vertex", "comment VCGLIB generated\ncomment TextureFile my oak.png\nelement vertex"
    )
    + BODY
    + "3 0 1 2 6 0 0 1 0 0 1\n3 1 3 2 6 1 0 1 1 0 1\n"
)
OAK = png(np.full((4, 4, 3), (90, 60, 30), np.uint8))


def test_a_texture_that_does_not_come_along_is_told() -> None:
    mesh = parsed(TEXTURED.encode())
    assert mesh.uvs is not None and len(mesh.warnings) == 1
    assert mesh.warnings[0].startswith("its texture 'my oak.png' is not shown: a PLY file is a mesh alone")


def test_a_zip_with_its_texture_is_a_scene() -> None:
    scene = read_zip(memoryview(zipped({"m/a.ply": TEXTURED, "m/my oak.png": OAK})), AssetLimits())
    assert scene.document["materials"]["my oak.png"]["albedo"]["texture"] in scene.document["textures"]
    assert scene.triangles == 2 and not scene.warnings and len(scene.parts) == 2
    without = read_zip(memoryview(zipped({"a.ply": TEXTURED})), AssetLimits())
    assert without.triangles == 2 and "the texture 'my oak.png' is not there" in without.warnings[0]["detail"]


def test_a_texture_named_after_its_file() -> None:
    """MeshLab's `<this>` stands for the name of the PLY file."""
    text = TEXTURED.replace("my oak.png", "<this>_oak.png")
    scene = read_zip(memoryview(zipped({"m/a.b.ply": text, "m/a.b_oak.png": OAK})), AssetLimits())
    assert list(scene.document["materials"]) == ["a.b_oak.png"] and not scene.warnings


def test_textures_by_number() -> None:
    two = TEXTURED.replace("comment TextureFile", "comment TextureFile a.png\ncomment TextureFile", 1)
    two = two.replace("float texcoord\n", "float texcoord\nproperty int texnumber\n")
    first, second, *_ = two.splitlines()[-2:]
    two = two.replace(first, first + " 1").replace(second, second + " -1")
    scene = read_zip(memoryview(zipped({"a.ply": two, "a.png": OAK, "my oak.png": OAK})), AssetLimits())
    assert sorted(scene.document["materials"]) == ["default", "my oak.png"]


@pytest.mark.parametrize(("named", "file"), [("my oak", "my oak.png"), ("<this> oak", "a oak.png")])
def test_the_command_line_takes_the_texture_along(
    named: str, file: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("SUNBOX_DATA_DIR", str(tmp_path / "data"))
    (tmp_path / "a.ply").write_text(TEXTURED.replace("my oak", named))
    (tmp_path / file).write_bytes(OAK)
    assert main(["import", str(tmp_path / "a.ply"), "-o", str(tmp_path / "a.json")]) == 0
    assert len(list((tmp_path / "a.assets").glob("*.png"))) == 1 and not capsys.readouterr().err


PLAIN = header("element face 1", FACE) + BODY + "3 0 1 2\n"


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("ply\n", "ply \n", ()),
        ("ply\n", "ply\t\n", ()),
        ("format ascii 1.0\n", "format ascii 1.0 \nobj_info num_cols 2\nobj_info\n", ()),
        ("format ascii 1.0\n", "format ascii 1.0\ncomment the end_header is far\ncomment end_header\n", ()),
        ("format ascii 1.0\n", "format ascii 1.0\ncomment\n\n", ()),
        ("end_header\n", "end_header \n", ()),
        (
            "format ascii 1.0\n", "format ascii 1.0\nauthor me\n",
            ("the header has a line that is not understood and passed over: 'author me'",),
        ),
        ("3 0 1 2\n", "3 0 1 2\n\n \n", ()),
        ("3 0 1 2\n", "3 0 1 2\n3 1 2 3\n", ("4 words after the data that the header promises are not read",)),
        ("3 0 1 2\n", "3 0 1 2\nby hand\n", ("2 words after the data that the header promises are not read",)),
    ],
)  # fmt: skip
@pytest.mark.parametrize("ending", ["\n", "\r\n", "\r"])
def test_headers_and_ends_as_others_write_them(old: str, new: str, told: tuple[str, ...], ending: str) -> None:
    data = PLAIN.replace(old, new, 1).replace("\n", ending).encode()
    assert sniff(data) == "ply"
    mesh = parsed(data)
    assert mesh.faces.tolist() == [[0, 1, 2]] and mesh.vertices.tolist() == VERTICES and mesh.warnings == told


@pytest.mark.parametrize("more", [b"\n", bytes(7), b"junk"])
@pytest.mark.parametrize("ending", ["\n", "\r\n", "\r"])
def test_bytes_after_binary_data_are_told(more: bytes, ending: str) -> None:
    head = header("element face 1", FACE, format="binary_little_endian").replace("\n", ending).encode()
    mesh = parsed(head + np.array(VERTICES, "<f4").tobytes() + struct.pack("<B3i", 3, 0, 1, 2) + more)
    count = "1 byte" if len(more) == 1 else f"{len(more)} bytes"
    assert mesh.faces.tolist() == [[0, 1, 2]]
    assert mesh.warnings == (f"{count} after the data that the header promises are not read",)


def test_a_property_named_twice_is_read_once() -> None:
    text = header("property float x", "element face 1", FACE) + BODY.replace("\n", " 9\n") + "3 0 1 2\n"
    mesh = parsed(text.encode())
    assert mesh.vertices.tolist() == VERTICES
    assert mesh.warnings == ("element vertex has several properties named 'x'; the first is read",)


@pytest.mark.parametrize("ending", ["\n", "\r\n"])
def test_rows_with_more_numbers_than_the_header_declares(ending: str) -> None:
    """As MeshLab writes colours of corners, and exporters an alpha: each row has a line."""
    faces = "3 0 1 2 6 0 0 1 0 0 1 9 1 1 1\n4 0 1 3 2 8 0 0 1 0 1 1 0 1 9 1 1 1\n"
    lines = ("element face 2", FACE, "property list uchar float texcoord")
    mesh = parsed((header(*lines) + BODY.replace("\n", " 255\n") + faces).replace("\n", ending).encode())
    assert mesh.uvs is not None
    assert np.allclose(mesh.vertices[mesh.faces][:, 0], [VERTICES[0]] * 3) and len(mesh.faces) == 3
    assert np.allclose(mesh.uvs[mesh.faces][0], [(0, 0), (1, 0), (0, 1)])
    assert mesh.warnings == tuple(
        f"rows of element {name} have more numbers than the header declares; the last are not read"
        for name in ("vertex", "face")
    )


def test_what_is_not_read_is_told() -> None:
    lines = ("property float quality", "property uchar alpha", "element face 1", FACE, "property uchar flags")
    lines += ("element edge 2", "property int vertex1", "property int vertex2", "element user 0", "property int a")
    mesh = parsed((header(*lines) + BODY.replace("\n", " .5 9\n") + "3 0 1 2 7\n0 1\n1 2\n").encode())
    assert mesh.warnings == (
        "of element vertex these properties are not read: quality, alpha",
        "of element face these properties are not read: flags",
        "element edge is not read; it has 2 rows",
    )


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("element face 1", "element face 2", "the file is cut off: 2 rows of element face are promised"),
        ("element vertex 5", "element vertex 50", "the file is cut off: 50 rows of element vertex are promised"),
        ("element vertex 5", "element vertex 4", "element face has a list of length|cut off|faces? .* corners"),
        ("element vertex 5", "element vertex -5", "a line that is not understood: 'element vertex -5'"),
        ("property float x", "property real x", "a line that is not understood: 'property real x'"),
        ("format ascii 1.0", "comment ascii", "names no format"),
        ("end_header", "comment end_header", "no `end_header`"),
    ],
)
def test_headers_that_do_not_describe_the_data_are_refused(old: str, new: str, reason: str) -> None:
    with pytest.raises(ParseError, match=reason):
        parsed(PLAIN.replace(old, new, 1).encode())


def test_indices_of_eight_bytes() -> None:
    """Which the format does not have, and libraries write that take an array as it is."""
    lines = ("element face 2", "property list uchar int64 vertex_indices")
    rows = ((3, 0, 1, 2), (4, 1, 3, 4, 2))
    body = np.array(VERTICES, "<f4").tobytes() + b"".join(struct.pack(f"<B{len(row) - 1}q", *row) for row in rows)
    mesh = parsed(header(*lines, format="binary_little_endian").encode() + body)
    assert len(mesh.faces) == 3 and not mesh.warnings


@pytest.mark.parametrize("end", ["", "\n\n", "\0", "\n \0\x1a", "\x1a"])
def test_the_end_of_a_text_is_no_data(end: str) -> None:
    text = header("element face 1", "property list uchar int vertex_indices") + BODY + "3 0 1 2\n"
    mesh = parsed((text + end).encode())
    assert mesh.faces.tolist() == [[0, 1, 2]] and not mesh.warnings
