"""Scenes that are refused: every mistake with its JSON pointer, in plain words."""

from __future__ import annotations

import copy
import re
from typing import Any

import pytest

from service.document import parse_scene
from service.problems import InvalidDocument

GOOD: dict[str, Any] = {
    "version": 1,
    "camera": {"position": [0, 1, 4], "target": [0, 0.5, 0], "up": [0, 1, 0], "vfov": 40},
    "environment": {"type": "constant", "radiance": 0.5},
    "lights": [
        {"type": "point", "position": [0, 3, 0], "intensity": 10},
        {
            "type": "spot",
            "position": [0, 3, 1],
            "direction": [0, -1, 0],
            "intensity": 5,
            "inner_angle": 10,
            "outer_angle": 20,
        },
        {"type": "directional", "direction": [0, -1, 0], "irradiance": 1, "angular_diameter": 1},
    ],
    "materials": {
        "a": {"type": "diffuse", "albedo": 0.5},
        "b": {"type": "disney"},
        "x/y~z": {"type": "disney"},
        "t": {
            "type": "diffuse",
            "albedo": {"texture": "wood", "channel": "r", "factor": 0.5},
            "alpha": {"texture": "wood", "channel": "a"},
            "normal_map": {"texture": "wood", "scale": 2},
            "height": {"texture": "wood", "scale": -0.1},
        },
    },
    "textures": {
        "wood": {
            "asset": "t.png",
            "color_space": "srgb",
            "wrap": "clamp",
            "scale": [2, 3],
            "rotation": 30,
            "offset": [0, 1],
            "uv": 1,
        },
        "tiles": {"type": "checker", "a": 0.5, "b": "#ff0000"},
    },
    "shapes": [
        {"type": "sphere", "center": [0, 0.5, 0], "radius": 0.5, "material": "a"},
        {"type": "quad", "origin": [-2, 0, 2], "u": [4, 0, 0], "v": [0, 0, -4], "material": "b"},
        {"type": "box", "min": [1, 0, 1], "max": [1.5, 0.5, 1.5], "material": "b"},
        {"type": "mesh", "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "faces": [[0, 1, 2]], "material": "a"},
    ],
}
GONE = object()
NAN, INF = float("nan"), float("inf")
IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]


def edited(pointer: str, value: Any) -> dict[str, Any]:
    document = copy.deepcopy(GOOD)
    *path, last = [step.replace("~1", "/").replace("~0", "~") for step in pointer.split("/")[1:]]
    place: Any = document
    for step in path:
        place = place[int(step) if isinstance(place, list) else step]
    key: Any = int(last) if isinstance(place, list) else last
    if value is GONE:
        del place[key]
    else:
        place[key] = value
    return document


def refused(document: Any, pointer: str = "") -> dict[str, str]:
    with pytest.raises(InvalidDocument) as caught:
        parse_scene(document, pointer)
    return {error.pointer: error.detail for error in caught.value.errors}


def test_the_scene_itself_is_good() -> None:
    parse_scene(GOOD)


NUMBERS = {
    "/camera/vfov": (0, 180, -1, NAN, INF, "40", True, None, [40], 10**400),
    "/camera/aperture_radius": (-0.1, 1.1e9),
    "/camera/focus_distance": (0, -1, 1e-60, None),
    "/shapes/0/radius": (0, -1, 1e10, INF, "1", True, None, 1e-60),
    "/environment/scale": (-1, 1e21),
    "/environment/rotation": (NAN, "90"),
    "/materials/b/roughness": (-0.01, 1.5, True),
    "/materials/a/alpha": (-0.01, 1.01, True, "1", None, NAN, [1, 1, 1]),
    "/materials/b/alpha_cutoff": (-0.01, 1.01, None),
    "/lights/1/inner_angle": (-1, 20.001, 90.1, NAN, "10", None),
    "/lights/1/outer_angle": (GONE, 91, INF),
    "/lights/2/angular_diameter": (-1, 90.1, True),
}
COLOURS = {
    "/materials/a/albedo": (1.5, -0.1, [0.5, 0.5], [0.5] * 4, [-0.1, 0.5, 0.5], [0.5, NAN, 0.5], [0.5, True, 0.5],
                            "#12345g", "#123", "red", "#1234567",
                            "＃123456", None, True, [[1], 0, 0], "#12345\n"),
    "/materials/x~1y~0z/base_color": (2, [0, 0, 1.01]),
    "/materials/a/emission": ([-1, 0, 0], 1.1e20, INF),
    "/lights/0/intensity": (-1, 1.1e20, {"texture": "t"}),
    "/lights/1/intensity": ([0, 0, -1], NAN),
    "/lights/2/irradiance": (GONE, -1, 1.1e20),
    "/environment/radiance": (-1, [0, 0, NAN]),
}  # fmt: skip
VECTORS = {
    "/camera/position": ([0, NAN, 1], [0, 1], [0, 1, 2, 3], 5, "x", None, {}, [0, "1", 2], [0, None, 2]),
    "/camera/target": ([10**400, 0, 0],),
    "/camera/up": ([0, 0, 0], [1e-60, 0, 0]),
    "/shapes/0/center": ([1e39, 0, 0], [1.1e9, 0, 0], [0, True, 0]),
    "/lights/0/position": ([INF, 0, 0],),
    "/lights/1/position": ([2e9, 0, 0],),
    "/lights/1/direction": (GONE, [0, 0, 0], [1e-60, 0, 0], 5, [0, 1]),
    "/lights/2/direction": ([0, 0, 0], [NAN, 0, 1]),
}
STRUCTURE = {
    "/extra": (1,),
    "/textures": ([], None, 5),
    "/textures/wood/asset": (GONE, "", 5, None),
    "/textures/wood/filter": ("x",),
    "/textures/wood/color_space": ("acescg", None),
    "/textures/wood/wrap": ("border", None, 5, {}, [], ["clamp"], ["clamp"] * 3),
    "/textures/wood/scale": (2, [1], [1, NAN], [1, "1"]),
    "/textures/wood/rotation": (INF, "90"),
    "/textures/wood/offset": ([1, 2, 3],),
    "/textures/wood/uv": (2, -1, 0.5, True),
    "/textures/wood/type": ("image", 5, None),
    "/textures/tiles/a": (GONE, {"texture": "tiles"}, -1),
    "/textures/tiles/wrap": ("repeat",),
    "/materials/t/albedo/texture": (GONE, "nosuch", 5, None),
    "/materials/t/albedo/channel": ("x", None, 0),
    "/materials/t/albedo/factor": (-1, [1, 2], NAN, None),
    "/materials/t/albedo/scale": (1,),
    "/materials/t/alpha/channel": ("rgb", None),
    "/materials/t/alpha/factor": ([1, 1, 1], "#ffffff", -1, INF),
    "/materials/t/normal_map/texture": ("nosuch", GONE),
    "/materials/t/normal_map/scale": (-1, NAN),
    "/materials/t/height/texture": ("nosuch", GONE),
    "/materials/t/height/scale": (1e10, NAN, "deep"),
    "/materials/t/normal_map/factor": (1,),
    "/materials/t/clearcoat_normal_map": ({"texture": "tiles"},),
    "/materials/a/normal_map": (0.5, None, "wood"),
    "/materials/b/alpha_cutoff": ([0.5], "half"),
    "/shapes/3/uvs": ([[0, 0]] * 2, [[0, 0]] * 4, [], 5, None),
    "/shapes/3/colors": ([[0, 0, 0]] * 2, 5, None),
    "/version": (GONE, 2, "1", 1.0, True, None),
    "/camera": (GONE, [], None, 5),
    "/camera/fov": (50,),
    "/camera/position": (GONE,),
    "/materials": (GONE, [], None),
    "/materials/a": ([], None, "red"),
    "/materials/a/albdo": (0.5,),
    "/materials/a/albedo": (GONE,),
    "/materials/a/roughness": (0.5,),
    "/materials/b/opacity": (0.5,),
    "/materials/b/emission_sides": ("back", 2, None, True),
    "/materials/a/type": (GONE, "lambert", "plaster", 5, None, [], {}),
    "/shapes": (GONE, {}, None),
    "/shapes/0": (None, 5, []),
    "/shapes/0/radius": (GONE,),
    "/shapes/0/raduis": (1,),
    "/shapes/0/visible_to_camera": (1, "true", None),
    "/shapes/0/type": (GONE, "torus"),
    "/shapes/0/material": (GONE, 0, "nosuch", None),
    "/lights": (None, {}),
    "/lights/0/power": (1,),
    "/lights/0/type": (GONE, "area", 5),
    "/lights/2/position": ([0, 0, 0],),
    "/environment": (None, []),
    "/environment/colour": (1,),
    "/environment/type": (GONE, "dome", "studio"),
    "/environment/background": (1, "true", None),
}


ONE_MISTAKE = {**NUMBERS, **COLOURS, **VECTORS, **STRUCTURE}


@pytest.mark.parametrize(("pointer", "value"), [(at, value) for at, row in ONE_MISTAKE.items() for value in row])
def test_one_mistake_one_pointer(pointer: str, value: Any) -> None:
    told = refused(edited(pointer, value))
    assert list(told) == [pointer]
    assert told[pointer] and not re.search(r"[Ii]nput should|pydantic|\bdict|\bstr\b", told[pointer])


@pytest.mark.parametrize(
    ("place", "value", "pointer"),
    [
        ("/camera/target", [0, 1, 4], "/camera"),
        ("/camera/up", [0, -0.5, -4], "/camera"),
        ("/shapes/1/v", [2, 0, 0], "/shapes/1"),
        ("/shapes/1/u", [0, 0, 0], "/shapes/1"),
        ("/shapes/1/u", [1e-50, 0, 0], "/shapes/1"),
        ("/shapes/2/max", [0, 0, 0], "/shapes/2"),
        ("/shapes/2/max", [1, 0.5, 1.5], "/shapes/2"),
        ("/shapes/2/max", [1 + 1e-12, 0.5, 1.5], "/shapes/2"),
        ("/environment", {"type": "constant", "radiance": 1e20, "scale": 2}, "/environment/scale"),
        ("/environment", {"type": "image", "asset": ""}, "/environment/asset"),
        ("/environment", {"type": "image"}, "/environment/asset"),
        ("/textures/wood/wrap", ["border", "clamp"], "/textures/wood/wrap/0"),
        ("/textures/wood/wrap", ["clamp", None], "/textures/wood/wrap/1"),
        ("/textures/wood/wrap", [["clamp"], "clamp"], "/textures/wood/wrap/0"),
        ("/shapes/0/transform", None, "/shapes/0/transform"),
        ("/shapes/0/transform", {"scale": 0}, "/shapes/0/transform/scale"),
        ("/shapes/0/transform", {"scale": [1, 0, 1]}, "/shapes/0/transform/scale"),
        ("/shapes/0/transform", {"rotate": [0, INF, 0]}, "/shapes/0/transform/rotate"),
        ("/shapes/0/transform", {"move": [0, 0, 0]}, "/shapes/0/transform/move"),
        ("/shapes/0/transform", {"matrix": [1.0] * 15}, "/shapes/0/transform/matrix"),
        ("/shapes/0/transform", {"matrix": [0.0] * 15 + [1]}, "/shapes/0/transform/matrix"),
        ("/shapes/0/transform", {"matrix": [1, 2, 3, 0, 2, 4, 6, 0, *IDENTITY[8:]]}, "/shapes/0/transform/matrix"),
        ("/shapes/0/transform", {"matrix": [*IDENTITY[:15], 2]}, "/shapes/0/transform/matrix"),
        ("/shapes/0/transform", {"matrix": [NAN, *IDENTITY[1:]]}, "/shapes/0/transform/matrix"),
        ("/shapes/0/transform", {"matrix": IDENTITY, "scale": 2}, "/shapes/0/transform/scale"),
        ("/shapes/3/asset", "x.obj", "/shapes/3/vertices"),
        ("/shapes/3/faces", GONE, "/shapes/3/faces"),
        ("/shapes/3/vertices", GONE, "/shapes/3/vertices"),
        ("/shapes/3", {"type": "mesh", "material": "a"}, "/shapes/3/asset"),
        ("/shapes/3/faces", [], "/shapes/3/faces"),
        ("/shapes/3/faces", None, "/shapes/3/faces"),
        ("/shapes/3/vertices", {}, "/shapes/3/vertices"),
        ("/shapes/3/normals", [[0, 1, 0]] * 2, "/shapes/3/normals"),
        ("/shapes/3/normals", [[0, 1, 0], [0, 0, 0], [0, 1, 0]], "/shapes/3/normals/1"),
        ("/shapes/3/uvs", [[0, 0], [0, 0, 0], [1, 1]], "/shapes/3/uvs/1"),
        ("/shapes/3/uvs", [[0, 0], [0, NAN], [1, 1]], "/shapes/3/uvs/1"),
        ("/shapes/3/colors", [[0, 0, 0], [0, 0, 0, 1], [1, 1, 1]], "/shapes/3/colors/1"),
        ("/shapes/3/colors", [[0, 0, 0], [0, 0, 1.5], [1, 1, 1]], "/shapes/3/colors/1"),
        ("/shapes/3/colors", [[0, 0]] * 3, "/shapes/3/colors/0"),
    ],
)
def test_mistakes_that_take_two_numbers(place: str, value: Any, pointer: str) -> None:
    assert list(refused(edited(place, value))) == [pointer]


@pytest.mark.parametrize(
    "row",
    [[1, -INF, 0], [1], [1, 2, True], [1, 2, "3"], [1, 2, None], 5, None, [[1], 2, 3], [1, 2, 10**99], [0, 0, 3e9]],
)
@pytest.mark.parametrize("field", ["vertices", "faces"])
def test_bad_rows_of_a_mesh_are_named(field: str, row: Any) -> None:
    assert list(refused(edited(f"/shapes/3/{field}", [[0, 1, 2], [0, 1, 2], row]))) == [f"/shapes/3/{field}/2"]


@pytest.mark.parametrize("row", [[0, 1, 3], [0, 1, -1], [0, 1, 1.5], [0, 1, 2**31]])
def test_bad_indices_are_named(row: Any) -> None:
    assert list(refused(edited("/shapes/3/faces", [[0, 1, 2], row, row]))) == ["/shapes/3/faces/1"]


def test_messages_say_what_would_be_right() -> None:
    assert "did you mean 'albedo'?" in refused(edited("/materials/a/albdo", 1))["/materials/a/albdo"]
    assert "'diffuse', 'disney'" in refused(edited("/materials/a/type", "lambert"))["/materials/a/type"]
    assert "'a', 'b'" in refused(edited("/shapes/1/material", "c"))["/shapes/1/material"]
    assert "at most 1" in refused(edited("/materials/b/roughness", 1.5))["/materials/b/roughness"]
    assert "between 0 and 1, not 1.5" in refused(edited("/materials/a/albedo", 1.5))["/materials/a/albedo"]
    assert "the last is 2" in refused(edited("/shapes/3/faces/0", [0, 1, 3]))["/shapes/3/faces/0"]


def test_all_mistakes_are_told_at_once_from_the_caller_s_root() -> None:
    document = edited("/shapes/0/radius", -1)
    document["shapes"][1]["material"] = "nosuch"
    document["camera"]["fov"] = 3
    told = refused(document, "/scene")
    assert set(told) == {"/scene/shapes/0/radius", "/scene/shapes/1/material", "/scene/camera/fov"}


def test_a_wrong_type_hides_what_it_makes_look_wrong() -> None:
    area = {"type": "area", "position": [0, 0, 0], "direction": [0, -1, 0], "width": 30}
    assert list(refused(edited("/lights/0", area))) == ["/lights/0/type"]


def test_names_that_look_like_types_stay_in_the_pointer() -> None:
    wrong = {"type": "diffuse", "albedo": 2, "diffuse": 1}
    document = edited("/materials", {"diffuse": wrong, "type": {"type": "disney", "sheen": 2}, "<matrix>": wrong})
    document["shapes"] = []
    assert set(refused(document)) == {
        "/materials/diffuse/albedo",
        "/materials/diffuse/diffuse",
        "/materials/type/sheen",
        "/materials/<matrix>/albedo",
        "/materials/<matrix>/diffuse",
    }


@pytest.mark.parametrize("document", [[], None, 5, "scene", True])
def test_the_document_is_an_object(document: Any) -> None:
    assert refused(document, "/scene") == {"/scene": refused(document)[""]}


def test_a_thousand_mistakes_are_not_all_told() -> None:
    document = edited("/shapes", [{"type": "sphere", "center": 1, "radius": 1, "material": "none"}] * 1000)
    assert 100 <= len(refused(document)) <= 200
