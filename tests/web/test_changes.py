"""What differs between two scenes, in words."""

from __future__ import annotations

import copy
from typing import Any

import pytest
from playwright.sync_api import Page

from tests.web.modules import call

BALL = {"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "clay"}
FLOOR = {"type": "quad", "origin": [0, 0, 0], "u": [1, 0, 0], "v": [0, 0, 1], "material": "floor"} | {
    "name": "Room/Floor"
}
SCENE: dict[str, Any] = {
    "camera": {"position": [0, 0, 4]},
    "environment": {"type": "constant"},
    "lights": [{"type": "point", "name": "Key"}, {"type": "point"}],
    "materials": {name: {"type": "diffuse", "albedo": 0.5} for name in ("clay", "floor", "worn_brass", "spare")},
    "textures": {},
    "shapes": [BALL, FLOOR],
}


def turned(scene: dict[str, Any], *changes: tuple[str, Any]) -> dict[str, Any]:
    made = copy.deepcopy(scene)
    for path, value in changes:
        *parts, last = (int(part) if part.isdigit() else part for part in path.split("/"))
        place: Any = made
        for part in parts:
            place = place[part]
        place[last] = value
    return made


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ([("camera/position", [1, 0, 4])], "the view"),
        ([("environment/type", "sky")], "the environment"),
        ([("lights/0/type", "spot")], "Key"),
        ([("lights", [])], "the lights"),
        ([("materials/clay/albedo", 0.2)], "Clay"),
        ([("materials/clay/albedo", 0.2), ("materials/spare/albedo", 0.2)], "Clay"),  # nothing wears the other
        ([("materials/clay/albedo", 0.2), ("textures/wood", {"asset": "x"})], "Clay"),
        ([("shapes/0/material", "worn_brass")], "Worn brass"),
        ([("materials/new", {"type": "disney"}), ("shapes/0/material", "new")], "New"),
        ([("materials/clay/albedo", 0.2), ("materials/floor/albedo", 0.2)], "the change"),
        ([("shapes/0/radius", 2)], "Sphere"),
        ([("shapes/1/u", [2, 0, 0])], "Floor"),
        ([("shapes/0/radius", 2), ("shapes/1/u", [2, 0, 0])], "the change"),
        ([("shapes", [BALL])], "the change"),
        ([], "the change"),  # the settings, it may be
    ],
)
def test_what_differs_has_its_name(page: Page, changes: list[tuple[str, Any]], words: str) -> None:
    after = turned(SCENE, *changes)
    assert call(page, "document/changes.js", "changed", SCENE, after) == words
    assert isinstance(call(page, "document/changes.js", "changed", None, after), str), "where nothing was seen"
