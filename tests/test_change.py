"""What an edit touches: each change costs only itself, and none is missed."""

from __future__ import annotations

import copy
from typing import Any

import pytest

from service.rendering.change import Change, change, risky
from service.scene import Scene, merge_patch, parse_scene
from tests.serving import SCENE

IMAGE = {"type": "image", "asset": "sha256:" + "1" * 64}
MESH = {"type": "mesh", "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "faces": [[0, 1, 2]], "material": "floor"}
BASE = {**SCENE, "shapes": [*SCENE["shapes"], MESH]}


def scene(patch: Any) -> Scene:
    return parse_scene(merge_patch(copy.deepcopy(BASE), patch))


@pytest.mark.parametrize(
    ("patch", "expected"),
    [
        ({}, Change()),
        ({"camera": {"vfov": 40}}, Change()),  # the default, said
        ({"camera": {"vfov": 41}}, Change(camera=True)),
        ({"camera": {"focus_distance": 2}}, Change(camera=True)),
        ({"materials": {"ball": {"roughness": 0.41}}}, Change(materials=True)),
        ({"materials": {"floor": {"albedo": "#808080"}}}, Change(materials=True)),
        ({"environment": {"rotation": 10}}, Change(environment=True)),
        ({"environment": {"scale": 2}}, Change(environment=True)),
        ({"camera": {"vfov": 41}, "environment": {"scale": 2}}, Change(camera=True, environment=True)),
        # what decides lights, flags or geometry
        ({"environment": {"scale": 0}}, Change(whole=True)),
        ({"environment": {"scale": 1e9}}, Change(whole=True)),
        ({"environment": {"background": False}}, Change(whole=True)),
        ({"environment": {"radiance": 1}}, Change(whole=True)),
        ({"environment": IMAGE}, Change(whole=True)),
        ({"environment": None}, Change(whole=True)),
        ({"lights": []}, Change(whole=True)),
        ({"lights": [{**SCENE["lights"][0], "intensity": 31}]}, Change(whole=True)),
        ({"materials": {"ball": {"emission": 1}}}, Change(whole=True)),
        ({"materials": {"ball": {"type": "diffuse", "albedo": 0.5}}}, Change(whole=True)),
        ({"materials": {"another": {"type": "disney"}}}, Change(whole=True)),
        ({"shapes": BASE["shapes"][:2]}, Change(whole=True)),
        ({"shapes": [*SCENE["shapes"], {**MESH, "faces": [[0, 2, 1]]}]}, Change(whole=True)),
    ],
)
def test_change(patch: Any, expected: Change) -> None:
    assert change(scene({}), scene(patch)) == expected


def test_the_order_of_materials_counts() -> None:
    """Shapes refer to them by place."""
    turned = parse_scene({**BASE, "materials": dict(reversed(BASE["materials"].items()))})
    assert change(scene({}), turned).whole


def test_only_files_and_numbers_of_shapes_are_risky() -> None:
    assert not risky(
        scene({}), scene({"camera": {"vfov": 50}, "shapes": [*SCENE["shapes"], {**MESH, "smooth": False}]})
    )
    assert risky(scene({}), scene({"environment": IMAGE}))
    assert risky(scene({}), scene({"shapes": []}))
    assert risky(scene({}), scene({"shapes": [*SCENE["shapes"], {"type": "mesh", "asset": "x", "material": "ball"}]}))


SKY = {"type": "sky", "sun_elevation": 30, "sun_azimuth": 40}
CUBE = {
    "type": "cubemap",
    "assets": {face: f"sha256:{n:064d}" for n, face in enumerate(("px", "nx", "py", "ny", "pz", "nz"))},
}


def test_the_suns_azimuth_is_a_turn() -> None:
    old = scene({"environment": SKY})
    assert change(old, scene({"environment": {**SKY, "sun_azimuth": 90}})) == Change(environment=True)
    assert change(old, scene({"environment": {**SKY, "sun_elevation": 31}})) == Change(whole=True)


def test_another_face_of_a_cubemap_is_a_risk() -> None:
    old = scene({"environment": CUBE})
    other = {**CUBE, "assets": {**CUBE["assets"], "ny": "sha256:" + "f" * 64}}
    assert risky(old, scene({"environment": other}))
    assert not risky(old, scene({"environment": {**CUBE, "rotation": 3}}))
