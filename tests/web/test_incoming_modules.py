"""Functions of the page's modules, called in the page: where models stand that come in, what is known of their files,
how images lie on things without coordinates, and what lies behind a click."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Error, Page

from service.formats import images
from tests.web.modules import call

PLACING = "document/placing.js"
FLOOR = {"low": [-20, 0, -20], "high": [20, 0, 20]}
CEILING = {"low": [-20, 4, -20], "high": [20, 4, 20]}
ROOM = {"low": [-10, -1, -4], "high": [10, 5, 10]}
BALL, CRATE = {"low": [-1, 0, -1], "high": [1, 2, 1]}, {"low": [1.5, 0, -1], "high": [3.5, 2, 1]}
MODEL = {"low": [-0.4, 0.5, -0.4], "high": [0.4, 1.3, 0.4]}


def overlap(a: dict[str, list[float]], b: dict[str, list[float]]) -> bool:
    return all(a["low"][k] < b["high"][k] and b["low"][k] < a["high"][k] for k in range(3))


def stood(page: Page, model: dict[str, list[float]], **around: Any) -> tuple[dict[str, list[float]], Any]:
    """The box of a model where it comes to stand, and the neighbour beside which it does."""
    scene = {"grounds": [], "bodies": [], "target": [0, 1, 0], "right": [1, 0, 0], **around}
    found = call(page, PLACING, "standing", model, scene)
    return {end: np.add(model[end], found["offset"]).tolist() for end in ("low", "high")}, found["neighbour"]


def test_a_new_thing_finds_a_place_beside_the_others(page: Page) -> None:
    assert call(page, PLACING, "wayOut", MODEL, [CRATE], [1, 0, 0]) is None, "it is in nobody's way"
    assert call(page, PLACING, "wayOut", MODEL, [BALL], [1, 0, 0])["offset"] == [1.48, 0, 0]
    for right in ([1, 0, 0], [-1, 0, 0], [0.6, 0, 0.8], [0.6, 0.5, 0.6]):
        placed, neighbour = stood(page, MODEL, bodies=[BALL, CRATE], right=right)
        assert neighbour == BALL and placed["low"][1] == pytest.approx(0), "on the ground of the ball"
        assert not overlap(placed, BALL) and not overlap(placed, CRATE), right


@pytest.mark.parametrize("height", [-7.0, 0.5, 90.0])
def test_a_model_stands_on_the_ground_wherever_its_file_has_it(page: Page, height: float) -> None:
    """The floor below what is looked at, no ceiling; in a room its floor; else the lowest foot; else as it was."""
    model = {"low": [3, height, 3], "high": [4, height + 1, 4]}
    eye = [0, 1, 8]
    grounds = call(page, PLACING, "floors", [FLOOR, CEILING, None, BALL], eye)
    assert [each["top"] for each in grounds] == [0, 4]
    assert stood(page, model, grounds=grounds)[0]["low"] == [3, 0, 3]
    room = call(page, PLACING, "floors", [ROOM], eye)
    assert stood(page, model, grounds=room)[0]["low"] == [3, -1, 3]
    low = {"low": [-1, -2, -1], "high": [1, 2, 1]}
    assert stood(page, model, bodies=[BALL, low])[0]["low"] == [3, -2, 3]
    assert stood(page, model)[0] == model
    lost, _ = stood(page, model, grounds=grounds, target=[9, 1, -2], lost=True)
    assert lost["low"] == [8.5, 0, -2.5], "where the camera looks"


def test_floors_and_rooms_are_in_nobodys_way(page: Page) -> None:
    floor = {"low": [-5, -0.1, -5], "high": [5, 0, 5]}
    assert call(page, PLACING, "solids", [ROOM, None, floor, CRATE], [0, 1, 8]) == [CRATE]


def test_a_model_without_a_unit_is_as_large_as_its_neighbours(page: Page) -> None:
    for radius, factor in [(1.5, 1), (0.2, 1), (900, 0.001), (0.012, 100), (35, 0.1), (0, 1)]:
        assert call(page, PLACING, "sized", {"radius": radius}, 1.2) == factor


def test_renaming_a_material_keeps_its_place(page: Page) -> None:
    state = {"scene": {"materials": {"a": {}, "b": {}, "c": {}}, "shapes": [{"material": "b"}]}, "chosen": {}}
    renamed = call(page, "document/materials.js", "renamed", state, "b", "z")["scene"]
    assert list(renamed["materials"]) == ["a", "z", "c"] and renamed["shapes"] == [{"material": "z"}]


# --- files ---

CHECK = """async ([name, bytes, formats]) => {
    const { checkFile } = await import(new URL("lib/check-file.js", location));
    await checkFile(new File([Uint8Array.from(bytes)], name), formats);
}"""
WHOLE = b"glTF" + struct.pack("<II", 2, 12)


@pytest.mark.parametrize(
    ("name", "data", "words"),
    [
        ("a.obj", b"", "is empty"),
        ("a.glb", b"<!DOCTYPE html>", "no GLB file"),
        ("a.glb", WHOLE[:3], "no GLB file"),
        ("a.usdz", b"PK", "USD files need sunbox-server[usd] on the server"),
    ],
)
def test_what_is_wrong_with_a_file_is_known_before_it_is_sent(page: Page, name: str, data: bytes, words: str) -> None:
    with pytest.raises(Error) as error:
        page.evaluate(CHECK, [name, list(data), {"missing": {"usd": "sunbox-server[usd]"}}])
    assert words in error.value.message
    page.evaluate(CHECK, ["a.glb", list(WHOLE), {}])
    page.evaluate(CHECK, ["a.usdz", [1], {"missing": {}}])


# --- images without coordinates ---


def test_an_image_lies_by_box_and_others_keep_theirs(page: Page) -> None:
    """Once over the thing. What another material shows stays: this one gets a copy. A ramp reads the image's copy."""
    image = {"asset": "x", "scale": [2, 1], "uv": 1}
    ramp = {"type": "ramp", "stops": [], "input": {"texture": "shared"}}
    textures = {"own": image, "shared": {"type": "checker", "a": 0, "b": 1}, "ramp": ramp, "noise": {"type": "noise"}}
    knot = {"base_color": {"texture": "own"}, "roughness": {"texture": "ramp", "factor": 0.5},
            "metallic": {"texture": "noise"}}  # fmt: skip
    scene = {
        "shapes": [],
        "textures": textures,
        "materials": {"knot": knot, "ball": {"albedo": {"texture": "shared"}}},
    }
    made = call(page, "document/by-box.js", "byBox", scene, "knot", 4)["scene"]
    assert made["textures"]["own"] == {"asset": "x", "scale": [0.5, 0.25], "mapping": "box"}
    assert (
        made["textures"]["shared"] == textures["shared"] and made["materials"]["ball"] == scene["materials"]["ball"]
    )
    assert made["textures"]["shared-2"] == {**textures["shared"], "scale": [2, 2], "mapping": "box"}
    assert made["textures"]["ramp"]["input"] == {"texture": "shared-2"}
    assert made["materials"]["knot"] == knot
    assert call(page, "document/by-box.js", "byBox", made, "knot", 4) is None, "they do already"


def test_a_things_extent_is_that_of_its_own_space(page: Page) -> None:
    extent = "ownExtent"
    mesh = {"type": "mesh", "vertices": [[0, 0, 0], [1, 3, 0], [0, 0, 2]], "transform": {"scale": 9}}
    assert call(page, "document/bounds.js", extent, mesh) == 3
    assert call(page, "document/bounds.js", extent, {"type": "sphere", "center": [9, 9, 9], "radius": 2}) == 4
    assert call(page, "document/bounds.js", extent, {"type": "mesh", "asset": "unknown"}) is None


def test_only_missing_coordinates_are_mended(page: Page) -> None:
    wrong = {"pointer": "/scene/shapes/2/asset", "detail": "material 'm' reads uv set 0; mapping 'box' or 'sphere'"}
    other = {"pointer": "/scene/shapes/2/asset", "detail": "no asset of this id"}
    for errors, expected in [([wrong], True), ([wrong, other], False), ([other], False), ([], False)]:
        assert call(page, "document/textures.js", "isUncharted", {"errors": errors}) is expected


# --- behind a click ---

SQUARE = {
    "type": "mesh",
    "vertices": [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]],
    "faces": [[0, 1, 2], [0, 2, 3]],
}
NESTED: list[dict[str, Any]] = [
    {"type": "cylinder", "base": [0, -2, 0], "axis": [0, 4, 0], "radius": 1.5},  # a glass
    {"type": "box", "min": [-1, -1, -1], "max": [1, 1, 1]},  # what is in it
    {"type": "sphere", "center": [0, 0, 0], "radius": 0.5},
    {"type": "quad", "origin": [-9, -9, -4], "u": [18, 0, 0], "v": [0, 18, 0]},  # a wall
    {"type": "disk", "center": [0, 0, 9], "normal": [0, 0, 1], "radius": 1},  # behind the camera
    {"type": "sphere", "center": [0, 0, 0], "radius": 0.4, "transform": {"translate": [0, 3, 0]}},  # above
    {**SQUARE, "transform": {"translate": [0, 0, -3]}},
]


def test_a_further_click_takes_what_is_behind(page: Page) -> None:
    """From the glass to what is in it, to a mesh and the wall, and round again; not what the ray misses."""
    taken, last = [], 0
    for _ in range(6):
        last = call(page, "document/through.js", "behind", NESTED, [0, 0, 6], [0, 0, -1], 0, last)
        taken.append(last)
    assert taken == [1, 2, 6, 3, 0, 1]
    beside = [0.9, 0.9, 6]
    assert call(page, "document/through.js", "behind", NESTED, beside, [0, 0, -1], 0, 1) == 6, "past the ball"
    assert call(page, "document/through.js", "behind", NESTED, [9, 9, 6], [0, 0, -1], 3, 3) == 3, "nothing else there"
    assert call(page, "document/through.js", "behind", NESTED, [0, 0, 6], [0, 0, -1], 0, 5) == 0, "another was chosen"


@pytest.mark.parametrize("x", [0.5, 0.503, 0.52])
def test_a_hand_is_not_quite_still(page: Page, x: float) -> None:
    there = call(page, "document/picking.js", "isThere", {"x": 0.5, "y": 0.5}, {"x": x, "y": 0.5}, 1.5)
    assert there is (x < 0.51)


# --- poses ---


def test_a_pose_keeps_what_was_done_by_hand(page: Page) -> None:
    """Parts move as the animation has them, where the model was put; what a hand has moved or painted stays so."""
    base = {"type": "mesh", "asset": "wheel", "name": "Wheel", "material": "m"}
    rest = [{**base, "transform": {"translate": [i, 0, 0]}} for i in range(2)]
    offset = [0, 1, 0]
    placed = [
        {**part, "transform": {"translate": np.add(part["transform"]["translate"], offset).tolist()}} for part in rest
    ]
    scene = [{"type": "sphere", "name": "Ball"}, {**placed[0], "material": "gold"},
             {**placed[1], "transform": {"translate": [7, 7, 7]}}]  # fmt: skip
    posed = [{**part, "transform": {**part["transform"], "rotate": [0, 90, 0]}} for part in rest]
    made = call(page, "poses.js", "inPose", scene, placed, posed, offset)
    assert made["shapes"][0] == scene[0] and made["shapes"][2] == scene[2]
    turned = {"translate": [0, 1, 0], "rotate": [0, 90, 0]}
    assert made["shapes"][1] == {**scene[1], "transform": turned}
    assert [part["transform"]["translate"] for part in made["parts"]] == [[0, 1, 0], [1, 1, 0]]


RECIPE = """async (pictures) => {
    const { readRecipe } = await import("/document/recipe-reader.js");
    return Promise.all(pictures.map((bytes) => readRecipe(new File([Uint8Array.from(bytes)], "a"))));
}"""


@pytest.mark.parametrize("is_long", [False, True])
def test_each_format_that_carries_a_recipe_is_read(page: Page, is_long: bool) -> None:
    scene = {"a & \"b\" < 'c'": "é" * (5000 * is_long + 1)}
    made = {"sunbox": "1", "scene": scene, "settings": {}, "samples": 1, "view": {}}
    formats = [name for name, each in images.FORMATS.items() if each.has_metadata]
    files = [images.encode(np.zeros((2, 2, 4), np.float32), format, metadata=made) for format in formats]
    assert len(files) == 3 and page.evaluate(RECIPE, [list(data) for data in files]) == [made] * 3
