"""What an edit touches: each change costs only itself, and none is missed."""

from __future__ import annotations

import copy
from dataclasses import replace
from typing import Any

import pytest

from service.document import Scene, merge_patch, parse_scene
from service.server.streams.scene_diff import SceneDiff, scene_diff
from tests.serving import SCENE

TEXTURE = {"asset": "sha256:" + "2" * 64}
IMAGE = {"type": "image", "asset": "sha256:" + "1" * 64}
MESH = {"type": "mesh", "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "faces": [[0, 1, 2]], "material": "floor"}
BASE = {**SCENE, "shapes": [*SCENE["shapes"], MESH]}


def scene(patch: Any) -> Scene:
    return parse_scene(merge_patch(copy.deepcopy(BASE), patch))


@pytest.mark.parametrize(
    ("patch", "expected"),
    [
        ({}, SceneDiff()),
        ({"camera": {"vfov": 40}}, SceneDiff()),  # the default, said
        ({"camera": {"vfov": 41}}, SceneDiff(camera=True)),
        ({"camera": {"focus_distance": 2}}, SceneDiff(camera=True)),
        ({"materials": {"ball": {"roughness": 0.41}}}, SceneDiff(materials=True)),
        ({"materials": {"floor": {"albedo": "#808080"}}}, SceneDiff(materials=True)),
        ({"environment": {"rotation": 10}}, SceneDiff(environment=True)),
        ({"environment": {"scale": 2}}, SceneDiff(environment=True)),
        ({"camera": {"vfov": 41}, "environment": {"scale": 2}}, SceneDiff(camera=True, environment=True)),
        ({"lights": [{**SCENE["lights"][0], "name": "Key"}]}, SceneDiff()),  # names are for people
        ({"shapes": [{**each, "name": "Room/Thing"} for each in BASE["shapes"]]}, SceneDiff()),
        # what decides lights, flags or geometry
        ({"environment": {"scale": 0}}, SceneDiff(whole=True)),
        ({"environment": {"scale": 1e9}}, SceneDiff(whole=True)),
        ({"environment": {"background": False}}, SceneDiff(whole=True)),
        ({"environment": {"radiance": 1}}, SceneDiff(whole=True)),
        ({"environment": IMAGE}, SceneDiff(whole=True)),
        ({"environment": None}, SceneDiff(whole=True)),
        ({"lights": []}, SceneDiff(whole=True)),
        ({"lights": [{**SCENE["lights"][0], "intensity": 31}]}, SceneDiff(whole=True)),
        ({"materials": {"ball": {"emission": 1}}}, SceneDiff(whole=True)),
        ({"materials": {"ball": {"type": "diffuse", "albedo": 0.5}}}, SceneDiff(whole=True)),
        ({"materials": {"another": {"type": "disney"}}}, SceneDiff()),  # that nothing wears
        ({"textures": {"one": TEXTURE}}, SceneDiff(may_be_refused=True)),  # that nothing reads
        ({"shapes": BASE["shapes"][:2]}, SceneDiff(whole=True)),
        ({"shapes": [*SCENE["shapes"], {**MESH, "faces": [[0, 2, 1]]}]}, SceneDiff(whole=True)),
    ],
)
def test_change(patch: Any, expected: SceneDiff) -> None:
    found = scene_diff(scene({}), scene(patch))
    assert (replace(found, may_be_refused=False) if expected.whole else found) == expected


def test_the_order_of_materials_is_that_of_their_numbers() -> None:
    turned = parse_scene({**BASE, "materials": dict(reversed(BASE["materials"].items()))})
    assert scene_diff(scene({}), turned) == SceneDiff(numbers=True)


def with_names(of: dict[str, str]) -> Scene:
    """BASE with other names for its materials."""
    materials = {of.get(name, name): each for name, each in BASE["materials"].items()}
    shapes = [{**each, "material": of.get(each["material"], each["material"])} for each in BASE["shapes"]]
    return parse_scene({**BASE, "materials": materials, "shapes": shapes})


def test_names_of_materials_are_for_people() -> None:
    assert scene_diff(scene({}), with_names({"ball": "Gold"})) == SceneDiff()
    assert scene_diff(scene({}), with_names({"ball": "floor", "floor": "ball"})) == SceneDiff(), "they change places"
    renamed = merge_patch(copy.deepcopy(BASE), {"materials": {"ball": None, "Gold": BASE["materials"]["ball"]}})
    for shape in renamed["shapes"]:
        shape["material"] = {"ball": "Gold"}.get(shape["material"], shape["material"])
    found = scene_diff(scene({}), parse_scene(renamed))
    assert not (found.whole or found.materials or found.may_be_refused), "a patch puts a new name at the end"


def test_what_nothing_wears_may_be_refused_for_its_files() -> None:
    bare = {"textures": {"one": TEXTURE}, "materials": {"spare": {"type": "diffuse", "albedo": 0.5}}}
    read = {**bare, "materials": {"spare": {"type": "diffuse", "albedo": {"texture": "one"}}}}
    file = {**bare, "materials": {"spare": {"type": "measured", "asset": "sha256:" + "3" * 64}}}
    assert scene_diff(scene(bare), scene({**bare, "materials": {"spare": {"type": "disney"}}})) == SceneDiff()
    for asking in (read, file):
        assert scene_diff(scene(bare), scene(asking)) == SceneDiff(may_be_refused=True)


def test_only_files_and_numbers_of_shapes_are_risky() -> None:
    assert not scene_diff(
        scene({}), scene({"camera": {"vfov": 50}, "shapes": [*SCENE["shapes"], {**MESH, "smooth": False}]})
    ).may_be_refused
    assert scene_diff(scene({}), scene({"environment": IMAGE})).may_be_refused
    assert scene_diff(scene({}), scene({"shapes": []})).may_be_refused
    assert scene_diff(
        scene({}), scene({"shapes": [*SCENE["shapes"], {"type": "mesh", "asset": "x", "material": "ball"}]})
    ).may_be_refused


SKY = {"type": "sky", "sun_elevation": 30, "sun_azimuth": 40}
CUBE = {
    "type": "cubemap",
    "assets": {face: f"sha256:{n:064d}" for n, face in enumerate(("px", "nx", "py", "ny", "pz", "nz"))},
}


def test_the_suns_azimuth_is_a_turn() -> None:
    old = scene({"environment": SKY})
    assert scene_diff(old, scene({"environment": {**SKY, "sun_azimuth": 90}})) == SceneDiff(environment=True)
    assert scene_diff(old, scene({"environment": {**SKY, "sun_elevation": 31}})) == SceneDiff(whole=True)


def test_another_face_of_a_cubemap_is_a_risk() -> None:
    old = scene({"environment": CUBE})
    other = {**CUBE, "assets": {**CUBE["assets"], "ny": "sha256:" + "f" * 64}}
    assert scene_diff(old, scene({"environment": other})).may_be_refused
    assert not scene_diff(old, scene({"environment": {**CUBE, "rotation": 3}})).may_be_refused
