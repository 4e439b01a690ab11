"""Material libraries as other programs write them: names, comments, options after names, images of 16 bits."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.cli.program import main
from service.formats.read.zips.importer import read_zip
from service.formats.types import AssetLimits
from tests.asset_files import png
from tests.obj_files import GREY, NORMALS, QUAD, TEXTURED, zipped

DEEP = png(np.full((2, 2, 3), 32896, np.uint16))
DEEP_ALPHA = png(np.full((2, 2, 4), 32896, np.uint16))
IMAGES = {"t.png": png(GREY), "n.png": png(NORMALS), "deep.png": DEEP, "alpha.png": DEEP_ALPHA}


def read(obj: str, mtl: str, more: dict[str, bytes] | None = None) -> tuple[dict[str, Any], list[str]]:
    """The document, and its warnings' details."""
    files: dict[str, bytes | str] = {"a.obj": obj, "m.mtl": mtl, **IMAGES, **(more or {})}
    found = read_zip(zipped(files), AssetLimits())
    told = [warning["detail"] for warning in found.warnings]
    return found.document, [detail for detail in told if "not used by" not in detail]  # most need none of IMAGES


def one(mtl: str, more: dict[str, bytes] | None = None) -> tuple[dict[str, Any], dict[str, Any], list[str]]:
    """The only material, the textures, and the warnings."""
    document, told = read(TEXTURED, "newmtl m\n" + mtl, more)
    return document["materials"]["m"], document.get("textures", {}), told


@pytest.mark.parametrize(
    "names", [("Material #25", "Material #26"), ("#1", "#2"), ("a#1", "a#2"), ("a # b", "a # c")]
)
def test_materials_whose_names_have_a_hash(names: tuple[str, str]) -> None:
    first, second = names
    obj = QUAD + f"mtllib m.mtl\nusemtl {first}\nf 1 2 3\nusemtl {second}\nf 1 3 4\n"
    document, told = read(obj, f"newmtl {first}\nKd 1 0 0\nnewmtl {second}\nKd 0 0 1\n")
    assert [one["albedo"] for one in document["materials"].values()] == [[1, 0, 0], [0, 0, 1]] and not told


@pytest.mark.parametrize(
    ("defined", "used"), [("red", "red # the red one"), ("red # one", "red"), ("red #", "red # x")]
)
def test_a_comment_after_a_name_where_the_other_has_none(defined: str, used: str) -> None:
    document, told = read(QUAD + f"mtllib m.mtl # all\nusemtl {used}\nf 1 2 3\n", f"newmtl {defined}\nKd 1 0 0\n")
    assert [one["albedo"] for one in document["materials"].values()] == [[1, 0, 0]] and not told


@pytest.mark.parametrize("comment", ["# red", "#red", "  # 1 1 1", "#"])
def test_comments_after_numbers(comment: str) -> None:
    found, _, told = one(f"Kd 1 0 0 {comment}\nd 0.5 {comment}\n{comment}\nillum 2# {comment}\nKe .5 .5 .5# x\n")
    assert found["albedo"] == [1, 0, 0] and found["alpha"] == 0.5 and found["emission"] == 0.5 and not told


@pytest.mark.parametrize("number", ["1.#QNAN00", "-1.#IND", "nan", "inf", "red"])
def test_numbers_that_are_none_are_told(number: str) -> None:
    found, _, told = one(f"Kd {number} 0 0\nNs {number}\nd {number}\n")
    assert found == {"type": "diffuse", "albedo": 0.8}
    assert told == [
        f"{word} is not followed by the numbers that it needs and is ignored" for word in ("kd", "ns", "d")
    ]


@pytest.mark.parametrize("name", ["wood#1.png", "wood #1.png", "wood # 1.png", "#1.png"])
def test_files_whose_names_have_a_hash(name: str) -> None:
    found, textures, told = one(f"map_Kd {name}\n", {name: png(GREY)})
    assert found["albedo"]["texture"] in textures and not told
    document, told = read(TEXTURED.replace("m.mtl", "part#2.mtl"), "", {"part#2.mtl": b"newmtl m\nKd 1 0 0\n"})
    assert document["materials"]["m"]["albedo"] == [1, 0, 0] and not told


PLACED = {"scale": [2, 2], "offset": [0.5, 0], "wrap": "clamp"}


@pytest.mark.parametrize(
    "line",
    [
        "-s 2 2 1 -o .5 0 0 -clamp on t.png", "t.png -s 2 2 1 -o .5 0 0 -clamp on", "-s 2 2 1 t.png -o .5 -clamp on",
        "-clamp on t.png -o .5 0 -s 2 2 # twice", "t.png -CLAMP on -S 2 2 -O .5", "\"t.png\" -s 2 2 -clamp on -o .5",
    ],
)  # fmt: skip
def test_options_before_and_after_the_name(line: str) -> None:
    found, textures, told = one(f"map_Kd {line}\n")
    assert {key: value for key, value in textures[found["albedo"]["texture"]].items() if key != "asset"} == PLACED
    assert not told


@pytest.mark.parametrize("keyword", ["bump", "map_bump", "norm", "disp", "map_Pr"])
def test_options_after_the_name_of_every_map(keyword: str) -> None:
    image = "n.png" if keyword == "norm" else "t.png"
    found, textures, told = one(f"{keyword} {image} -bm 0.5 -s 3 3\n")
    assert [texture["scale"] for texture in textures.values()] == [[3, 3]]
    assert not any("is not there" in detail for detail in told)
    if keyword != "map_Pr":
        assert (found["normal_map"] if keyword == "norm" else found["height"])["scale"] == 0.5


def test_a_name_with_an_option_in_it_is_a_name_where_there_is_such_a_file() -> None:
    found, textures, told = one("map_Kd t.png -s 2 2 1\n", {"t.png -s 2 2 1": png(GREY)})
    assert "scale" not in textures[found["albedo"]["texture"]] and not told


@pytest.mark.parametrize("line", ["t.png -unknown 2", "gone.png -s 2 2 1", "t.png -s 2 2 1 rest"])
def test_what_is_no_option_is_part_of_the_name(line: str) -> None:
    _, textures, told = one(f"map_Kd {line}\n")
    assert not textures and told == [f"the texture {line!r} is not there; the material is shown without it"]


def test_the_command_line_takes_along_what_such_lines_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("SUNBOX_DATA_DIR", str(tmp_path / "data"))
    (tmp_path / "a.obj").write_text(TEXTURED.replace("mtllib m.mtl", "mtllib part#2.mtl # all"))
    (tmp_path / "part#2.mtl").write_text("newmtl m\nmap_Kd wood#1.png -s 2 2 1\nmap_Ke t.png # glows\n")
    for name in ("wood#1.png", "t.png"):
        (tmp_path / name).write_bytes(IMAGES["t.png"])
    assert main(["import", str(tmp_path / "a.obj"), "-o", str(tmp_path / "a.json")]) == 0
    assert "not there" not in capsys.readouterr().err
    assert len(list((tmp_path / "a.assets").glob("*.png"))) == 1  # the same bytes


@pytest.mark.parametrize(
    ("mtl", "space"),
    [
        ("map_Kd deep.png", "srgb"), ("map_Ks deep.png\nKs 1 1 1", "srgb"), ("map_Ke deep.png\nKe 2 2 2", "srgb"),
        ("map_Pr deep.png", "linear"), ("map_Pm deep.png", "linear"), ("map_d deep.png", "linear"),
        ("map_d alpha.png", "srgb"), ("norm deep.png", "linear"), ("disp deep.png", "linear"), ("map_Kd t.png", None),
    ],
)  # fmt: skip
def test_the_space_of_images_of_16_bits(mtl: str, space: str | None) -> None:
    """Colours are sRGB, as those of 8 bits are, and data linear; alpha is so in any space."""
    _, textures, _ = one(mtl + "\n")
    assert [texture.get("color_space") for texture in textures.values()] == [space]


def test_one_image_for_colours_and_data_is_two_textures() -> None:
    _, textures, _ = one("map_Kd deep.png\nmap_Pr deep.png\n")
    assert sorted(texture["color_space"] for texture in textures.values()) == ["linear", "srgb"]
    _, textures, _ = one("map_Kd alpha.png\nmap_d alpha.png\n")
    assert [texture["color_space"] for texture in textures.values()] == ["srgb"]


@pytest.mark.parametrize(
    ("mtl", "alpha"),
    [("Tr 1", 1.0), ("Tr 1\nillum 2", 1.0), ("Tr 0", 1.0), ("Tr .25", 0.75), ("d 1\nTr 1", 1.0), ("d 0\nTr 1", 0.0)],
)
def test_tr_of_1_alone_is_opaque_and_told(mtl: str, alpha: float) -> None:
    found, _, told = one(mtl + "\n")
    assert found.get("alpha", 1.0) == alpha
    assert bool(told) == (mtl.startswith("Tr 1"))


def test_glass_of_tr_1_is_glass() -> None:
    found, _, told = one("Tr 1\nillum 6\nNi 1.5\n")
    assert found["transmission"] == 1 and not told
