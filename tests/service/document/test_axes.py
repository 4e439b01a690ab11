"""What varies from one render of a batch to the next."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pydantic import TypeAdapter

from service.document.axes import Axis, Variations
from service.document.validation import validated
from service.problems import InvalidDocument

AXES: TypeAdapter[list[Any]] = TypeAdapter(list[Axis])
BASE = {
    "scene": {
        "camera": {"position": [3, 1, 4], "target": [1, 1, 1], "up": [0, 1, 0]},
        "materials": {"a": {"type": "diffuse", "albedo": 0.5}, "b/~": {"type": "diffuse", "albedo": 0.1}},
        "shapes": [{"radius": 1}, {"radius": 2}],
    },
    "settings": {"seed": 1},
}


def variations(*axes: Any) -> Variations:
    return Variations(BASE, validated(AXES, list(axes), "/over"))


def test_last_axis_runs_fastest() -> None:
    made = variations(
        {"path": "/materials/a/albedo", "values": [0.1, 0.2]}, {"path": "/shapes/1/radius", "values": [5, 6, 7]}
    )
    assert len(made) == 6 and [made.steps(k) for k in (0, 1, 3, 5)] == [(0, 0), (0, 1), (1, 0), (1, 2)]
    scene = made.document(5)["scene"]
    assert scene["materials"]["a"] == {"type": "diffuse", "albedo": 0.2} and scene["shapes"] == [
        {"radius": 1},
        {"radius": 7},
    ]
    assert made.name(5) == "albedo 0.2, radius 7"


def test_what_does_not_vary_is_shared() -> None:
    scene = variations({"path": "/materials/a/albedo", "values": [0.1]}).document(0)["scene"]
    assert (
        scene["shapes"] is BASE["scene"]["shapes"] and scene["materials"]["b/~"] is BASE["scene"]["materials"]["b/~"]
    )
    assert BASE["scene"]["materials"]["a"]["albedo"] == 0.5


def test_path_may_make_a_member_and_has_escapes() -> None:
    made = variations(
        {"path": "/materials/b~1~0/alpha", "values": [0.3]}, {"path": "/environment", "values": [{"type": "sky"}]}
    )
    scene = made.document(0)["scene"]
    assert scene["materials"]["b/~"]["alpha"] == 0.3 and scene["environment"] == {"type": "sky"}
    assert made.name(0) == "alpha 0.3, environment sky"


@pytest.mark.parametrize(
    ("path", "detail"),
    [
        ("/materials/c/albedo", "there is no 'c'"),
        ("/shapes/2/radius", "no index of 2 entries"),
        ("/shapes/-1/radius", "no index"),
        ("/shapes/x", "no index"),
        ("/materials/a/albedo/0", "has no place"),
    ],
)
def test_path_that_is_not_there(path: str, detail: str) -> None:
    with pytest.raises(InvalidDocument, match=detail) as error:
        variations({"path": "/shapes/0/radius", "values": [1]}, {"path": path, "values": [1]}).document(0)
    assert error.value.errors[0].pointer == "/1/path"


def test_patches_reach_the_settings() -> None:
    patches = [{"settings": {"seed": 7}}, {"scene": {"lights": None}}]
    made = variations({"patches": patches, "names": ["seven", "dark"]})
    assert made.document(0) == {"scene": BASE["scene"], "settings": {"seed": 7}}
    assert [made.name(k) for k in (0, 1)] == ["seven", "dark"]
    with pytest.raises(InvalidDocument) as error:
        variations({"patches": [{}, {"label": "x"}]}).document(1)
    assert error.value.errors[0].pointer == "/0/patches/1"


def test_turntable() -> None:
    made = variations({"turntable": 4})
    positions = [made.document(k)["scene"]["camera"]["position"] for k in range(4)]
    # R_y(90 degrees) takes z to x.
    assert np.allclose(positions, [[3, 1, 4], [4, 1, -1], [-1, 1, -2], [-2, 1, 3]])
    assert positions[0] == [3, 1, 4] and made.name(1) == "90 degrees"
    half = variations({"turntable": 2, "degrees": 180}).document(1)["scene"]["camera"]
    assert np.allclose(half["position"], [4, 1, -1]) and half["up"] == [0, 1, 0] and half["target"] == [1, 1, 1]


def test_steps_are_checked_one_by_one() -> None:
    made = variations(
        {"path": "/materials/a/albedo", "values": list(range(100))},
        {"path": "/shapes/0/radius", "values": list(range(100))},
        {"turntable": 100},
    )
    places = [place for place, _ in made.one_by_one()]
    assert len(made) == 10**6 and len(places) == 201 and places[0] == "/0/values/0" and places[-1] == "/2/turntable"


@pytest.mark.parametrize(
    "axis",
    [
        {},
        {"path": "roughness", "values": [1]},
        {"path": "/a", "values": []},
        {"turntable": 0},
        {"turntable": 3, "values": [1]},
        3,
    ],
)
def test_what_is_no_axis_is_refused(axis: Any) -> None:
    with pytest.raises(InvalidDocument) as error:
        variations(axis)
    assert error.value.errors[0].pointer.startswith("/over/0")
