"""OBJ files as other programs write them: comments, numbers that are none, colours, bad rows."""

from __future__ import annotations

import numpy as np
import pytest

from service.formats import MeshData
from service.formats.read import obj_lines
from service.formats.read.obj_mesh import read_obj_with_materials
from service.formats.sandbox.readers import parse_mesh
from service.formats.types import AssetLimits

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
NO_NUMBERS = ["nan", "-nan", "NaN", "inf", "-inf", "1e999", "-1.#IND", "1.#QNAN00", "1.#INF", "-nan(ind)", "1.#J"]


def parsed(text: str) -> MeshData:
    return parse_mesh("obj", memoryview(text.encode()), AssetLimits())


def linear(encoded: float) -> float:
    return ((encoded + 0.055) / 1.055) ** 2.4 if encoded > 0.04045 else encoded / 12.92


@pytest.mark.parametrize("comment", ["# first", "#", "#first", " \t# v 9 9 9 # twice", "## 1.#IND"])
def test_comments_after_numbers(comment: str) -> None:
    lines = [*SQUARE.splitlines(), "vt 0 0", "vn 0 0 1", "s 1", "f 1/1/1 2/1/1 3/1/1"]
    mesh = parsed("".join(f"{line} {comment}\n" for line in lines))
    assert mesh.vertices.tolist()[:3] == [[0, 0, 0], [1, 0, 0], [1, 1, 0]] and len(mesh.faces) == 1
    assert mesh.uvs is not None and mesh.normals is not None and not mesh.warnings


@pytest.mark.parametrize("comment", ["# all", "  # all", "#", "#v 5 5 5", "# from C:\\models\\", "# C:\\a\\\\"])
@pytest.mark.parametrize("ending", ["\n", "\r\n", "\r"])
def test_comments_that_are_lines(comment: str, ending: str) -> None:
    """A path may end in a backslash: it carries no comment on."""
    text = f"{comment}\n{SQUARE}{comment}\nf 1 2 3\n".replace("\n", ending)
    mesh = parsed(text)
    assert len(mesh.vertices) == 4 and mesh.faces.tolist() == [[0, 1, 2]] and not mesh.warnings


@pytest.mark.parametrize("name", ["Material #25", "01 - Default #2", "#1", "a#b", "a # b"])
def test_names_keep_what_others_take_for_a_comment(name: str) -> None:
    read = read_obj_with_materials(
        f"{SQUARE}mtllib {name}.mtl\nusemtl {name}\no {name}\ng {name}\nf 1 2 3\n".encode()
    )
    assert read.materials == ["", name] and [one.name for one in read.libraries] == [f"{name}.mtl"]
    assert not read.mesh.warnings


@pytest.mark.parametrize("word", NO_NUMBERS)
@pytest.mark.parametrize("block", [1, obj_lines.BLOCK])
def test_numbers_that_are_none(word: str, block: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A normal is computed, a texture coordinate is 0, a vertex costs its faces; each is told once with its line."""
    monkeypatch.setattr(obj_lines, "BLOCK", block)
    faces = "f 1 2 3\nf 1 3 4\n"
    mesh = parsed(SQUARE + f"v 0 {word} 0\nv {word} 0 0\n" + faces)
    assert len(mesh.faces) == 2
    assert mesh.warnings == (
        f"2 vertices can't be read, the first: line 5: `v` is not finite: '0 {word} 0'; no face uses them",
    )
    mesh = parsed(SQUARE + f"v 0 0 {word}\n" + faces + "f 3 4 5\nf 1 2 5\n")
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3]] and np.isfinite(mesh.vertices).all()
    assert mesh.warnings == (
        f"2 faces are left out, the first: line 8: vertex 5 can't be used (line 5: `v` is not finite: '0 0 {word}')",
    )
    mesh = parsed(SQUARE + f"vt {word} 1\nvt 1 1\n" + "f 1/1 2/2 3/2\n")
    assert mesh.uvs is not None and mesh.uvs[mesh.faces].tolist() == [[[0, 0], [1, 1], [1, 1]]]
    assert mesh.warnings == (
        f"1 texture coordinate can't be read: line 5: `vt` is not finite: '{word} 1'; 0 0 is used instead",
    )
    mesh = parsed(SQUARE + f"vn {word} 0 0\nvn 1 0 0\n" + "f 1//1 2//2 3//2\n")
    assert mesh.normals is not None and mesh.normals[mesh.faces].tolist() == [[[0, 0, 1], [1, 0, 0], [1, 0, 0]]]
    assert mesh.warnings == (
        f"1 normal can't be read: line 5: `vn` is not finite: '{word} 0 0'; a computed one is used instead",
    )


@pytest.mark.parametrize(
    ("row", "why"),
    [
        ("v 0 0", "`v` needs three numbers: '0 0'"),
        ("v", "`v` needs three numbers: nothing follows"),
        ("v 1,5 0 0", "`v` needs three numbers: '1,5 0 0'"),
        ("v 0 0 2e9", "`v` lies beyond 1e9 m: '0 0 2e9'"),
    ],
)
def test_rows_that_are_no_vertices_keep_their_place(row: str, why: str) -> None:
    mesh = parsed(f"v 0 0 0\n{row}\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n")
    assert mesh.vertices[mesh.faces].tolist() == [[[0, 0, 0], [1, 0, 0], [0, 1, 0]]]
    assert mesh.warnings[0] == f"1 face is left out: line 5: vertex 2 can't be used (line 2: {why})"


@pytest.mark.parametrize(
    ("face", "why"),
    [
        ("f", "a face needs at least three corners, this one has 0: nothing follows"),
        ("f 1", "a face needs at least three corners, this one has 1: '1'"),
        ("f 1 2", "a face needs at least three corners, this one has 2: '1 2'"),
        ("f 1 2 # 3", "a face needs at least three corners, this one has 2: '1 2'"),
        ("f 1 2 three", "the line is not understood: '1 2 three'"),
        ("f 1 2 2.5", "the line is not understood: '1 2 2.5'"),
        ("f 1/1/1/1 2 3", "corners are v, v/vt, v//vn or v/vt/vn: '1/1/1/1 2 3'"),
        ("f /1 2 3", "a corner lacks its vertex: '/1 2 3'"),
    ],
)
@pytest.mark.parametrize("block", [1, obj_lines.BLOCK])
def test_faces_that_are_none_are_left_out(face: str, why: str, block: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Materials and smoothing groups stay with their own faces."""
    monkeypatch.setattr(obj_lines, "BLOCK", block)
    text = f"{SQUARE}usemtl a\nf 1 2 3\nusemtl b\ns 1\n{face}\nf 1 3 4\n{face}\nusemtl a\ns off\nf 1 2 4\n"
    read = read_obj_with_materials(text.encode())
    assert read.mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3], [0, 1, 3]]
    assert [read.materials[k] for k in read.of_triangle] == ["a", "b", "a"]
    assert read.mesh.groups is not None and (read.mesh.groups > 0).tolist() == [False, True, False]
    assert read.mesh.warnings == [f"2 faces are left out, the first: line 9: {why}"]


@pytest.mark.parametrize(
    ("corner", "told"),
    [
        ("{}//1", "normal 1 does not exist; there are 0 normals"),
        ("{}//0", "an index of 0 does not exist; they are counted from 1"),
        ("{}//99999999999", "normal 99999999999 does not exist; there are 0 normals"),
        ("{}/1", "texture coordinate 1 does not exist; there are 0 texture coordinates"),
        ("{}/-1", "texture coordinate -1 does not exist; there are 0 texture coordinates before it"),
    ],
)
def test_an_index_of_a_normal_or_a_coordinate_that_is_missing(corner: str, told: str) -> None:
    """The face is there without them."""
    mesh = parsed(SQUARE + "f " + " ".join(corner.format(k) for k in (1, 2, 3)) + "\n")
    assert mesh.faces.tolist() == [[0, 1, 2]] and mesh.normals is None and mesh.uvs is None
    rows = "normals" if "//" in corner else "texture coordinates"
    instead = "a computed one is used instead" if "//" in corner else "0 0 is used instead"
    assert mesh.warnings == (f"3 corners name {rows} that do not exist; {instead}; the first: line 5: {told}",)


def test_some_indices_are_missing() -> None:
    mesh = parsed(SQUARE + "vt 1 1\nvn 1 0 0\nf 1/1/1 2/2/1 3/1/2\nf 1 3 4\n")
    assert mesh.uvs is not None and mesh.normals is not None
    assert mesh.uvs[mesh.faces].tolist() == [[[1, 1], [0, 0], [1, 1]], [[0, 0]] * 3]
    assert mesh.normals[mesh.faces].tolist() == [[[1, 0, 0], [1, 0, 0], [0, 0, 1]], [[0, 0, 1]] * 3]
    assert [warning[:41] for warning in mesh.warnings] == [
        "1 corner names texture coordinates that d", "1 corner names normals that do not exist;",
        "3 corners have no texture coordinate; the",
    ]  # fmt: skip


def test_other_statements_are_told_and_names_are_not() -> None:
    mesh = parsed(SQUARE + "o a\ng b\nl 1 2\nl 2 3\np 1\ncurv 0 1 1 2\nf 1 2 3\n")
    assert mesh.warnings == (
        "the statement 'l' is not supported: 2 lines, the first of them 7, are not read",
        "the statement 'p' is not supported: line 9 is not read",
        "the statement 'curv' is not supported: line 10 is not read",
    )
    many = parsed(SQUARE + "".join(f"x{k} 1\n" for k in range(100)) + "f 1 2 3\n")
    assert len(many.warnings) == 21 and "'…' is not supported: 80 lines" in many.warnings[-1]


def test_what_follows_numbers_is_told() -> None:
    mesh = parsed("v 0 0 0 first\nv 1 0 0 1 2\nv 0 1 0 1 1 1 1 1\nf 1 2 3\n")
    assert mesh.faces.tolist() == [[0, 1, 2]] and mesh.colors is None
    assert (
        "3 lines, the first of them 1, go on after their numbers with something that is not understood"
        in mesh.warnings
    )


HALF, WHITE = [linear(0.5)] * 3, [1, 1, 1]


@pytest.mark.parametrize(
    ("more", "expected", "told"),
    [
        ([".5 .5 .5"] * 3, [HALF] * 3, ()),
        (["1 .5 .5 .5"] * 3, [HALF] * 3, ()),
        (["2 1 1 1", "1 0 0 0", "1 .5 .5 .5"], [[1, 1, 1], [0, 0, 0], HALF], ()),
        ([".5 .5 .5 1"] * 3, [HALF] * 3, ()),
        (["1 0 0", "", ""], [[1, 0, 0], WHITE, WHITE], ("2 vertices have no colour; they are shown white",)),
        (["", "1", "1 0 0 1"], [WHITE, WHITE, [0, 0, 1]], ("2 vertices have no colour; they are shown white",)),
        (
            ["255 0 0", "0 51 0", "0 0 0"], [[1, 0, 0], [0, linear(0.2), 0], [0, 0, 0]],
            ("its vertices' colours reach 255; they are taken for 0 to 255",),
        ),
        (
            ["127.5 0 0", "0 0 0", "0 0 0"], [[linear(0.5), 0, 0], [0, 0, 0], [0, 0, 0]],
            ("its vertices' colours reach 127.5; they are taken for 0 to 255",),
        ),
        (
            ["1.5 0 0", "-.5 0 0", ".5 .5 .5"], [[1, 0, 0], [0, 0, 0], HALF],
            ("the colours of 2 vertices were clamped to 0..1",),
        ),
        (
            ["nan 0 0", "1.#IND 0 0", "0 0 1"], [[1, 1, 1], [1, 1, 1], [0, 0, 1]],
            ("the colours of 2 vertices are not finite; they are shown white",),
        ),
    ],
)  # fmt: skip
@pytest.mark.parametrize("block", [1, obj_lines.BLOCK])
def test_colours_of_vertices_are_srgb(
    more: list[str], expected: list[list[float]], told: tuple[str, ...], block: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(obj_lines, "BLOCK", block)
    places = ["0 0 0", "1 0 0", "0 1 0"]
    mesh = parsed("".join(f"v {at} {color}\n" for at, color in zip(places, more, strict=True)) + "f 1 2 3\n")
    assert mesh.colors is not None and np.allclose(mesh.colors, expected, atol=1e-6)
    assert mesh.warnings == told


@pytest.mark.parametrize(
    ("comments", "expected", "told"),
    [
        (
            ["#MRGB ffff0000ff808080", "#MRGB ff0000ff00ff00ff"],
            [[1, 0, 0], [linear(128 / 255)] * 3, [0, 0, 1], [1, 0, 1]], (),
        ),
        (["#MRGB FFFF0000"], [[1, 0, 0], WHITE, WHITE, WHITE], ("3 vertices have no colour; they are shown white",)),
        (
            ["#MRGB " + "ff0000ff" * 6], [[0, 0, 1]] * 4,
            ("its #MRGB comments have 6 colours for 4 vertices; the last ones are not used",),
        ),
        (
            ["#MRGB ff0000zz", "#MRGB " + "ff000000" * 3], [[1, 1, 1], [0, 0, 0], [0, 0, 0], [0, 0, 0]],
            ("1 of its #MRGB comments are no hexadecimal digits; their vertices are shown white",),
        ),
    ],
)  # fmt: skip
@pytest.mark.parametrize("block", [1, obj_lines.BLOCK])
def test_zbrush_s_colours(
    comments: list[str], expected: list[list[float]], told: tuple[str, ...], block: int,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.setattr(obj_lines, "BLOCK", block)
    mesh = parsed(SQUARE + "#\n" + "\n".join(comments) + "\nf 1 2 3 4\n")
    assert mesh.colors is not None and np.allclose(mesh.colors, expected, atol=1e-6)
    assert mesh.warnings == told


def test_a_mesh_s_own_colours_come_before_comments() -> None:
    mesh = parsed(SQUARE.replace(" 0\n", " 0 0 0 1\n") + "#MRGB " + "ffff0000" * 4 + "\nf 1 2 3\n")
    assert mesh.colors is not None and mesh.colors[0].tolist() == [0, 0, 1] and "#MRGB" in mesh.warnings[0]


def test_colours_follow_their_vertices_where_corners_split_them() -> None:
    mesh = parsed("v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nvt 0 0\nvt 1 1\nf 1/1 2/1 3/1\nf 1/2 2/2 3/2\n")
    assert mesh.colors is not None and mesh.colors[mesh.faces].tolist() == [np.eye(3).tolist()] * 2
