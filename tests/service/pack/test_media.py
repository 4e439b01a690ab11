"""Media of shapes as records, and warnings about those that are open or behind surfaces that let no light in."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from service.document import parse_scene
from service.pack import pack
from service.problems import InvalidDocument
from tests.documents import Shelf
from tests.extremes.scenes import ball, icosphere

CLEAR = {"type": "principled", "transmission": 1, "ior": 1, "roughness": 0}
FOG = {"absorption": 1, "scattering": [2, 0, 1], "g": 0.5}


def scene(*shapes: dict[str, Any], **more: Any) -> dict[str, Any]:
    materials = {"m": CLEAR, "dull": {"type": "diffuse", "albedo": 0.5}}
    camera = {"position": [0, 0, 4], "target": [0, 0, 0]}
    return {"version": 1, "camera": camera, "materials": materials, "shapes": list(shapes), **more}


def warnings(*shapes: dict[str, Any]) -> list[str]:
    return pack(parse_scene(scene(*shapes)), Shelf()).warnings


def test_records_follow_the_shapes_after_what_is_outside() -> None:
    around = {"type": "constant", "radiance": 0, "medium": {"albedo": 0.5, "radius": [0.5, 1, 2]}}
    document = scene(ball("m"), {**ball("m"), "medium": FOG, "priority": -3}, environment=around)
    bodies = pack(parse_scene(document), Shelf()).arrays.bodies
    np.testing.assert_array_equal(bodies["extinction"], [[2, 1, 0.5], [0, 0, 0], [3, 1, 2]])
    np.testing.assert_array_equal(bodies["scattering"][2], [2, 0, 1])
    np.testing.assert_allclose(bodies["scattering"][0] / bodies["extinction"][0], 0.938, atol=0.002)
    assert bodies["priority"].tolist() == [0, 0, -3] and bodies["g"].tolist() == [0, 0, 0.5]
    assert not len(pack(parse_scene(scene(ball("m"))), Shelf()).arrays.bodies)


def test_open_shapes_and_opaque_ones_are_warned_of() -> None:
    sphere = icosphere("m", 1)
    open_mesh = {**sphere, "faces": sphere["faces"][:-1]}
    tube = {"type": "cylinder", "base": [0, 0, 0], "axis": [0, 1, 0], "radius": 1, "material": "m", "medium": FOG}
    assert not warnings({**sphere, "medium": FOG}, tube, {**ball("dull"), "medium": {}}, open_mesh)
    for shape in ({**open_mesh, "medium": FOG}, {**tube, "caps": False}):
        (warning,) = warnings(ball("m"), shape)
        assert warning.startswith("/shapes/1: it is open and has a medium")
    (warning,) = warnings({**ball("dull"), "medium": FOG})
    assert "lets no light in" in warning


@pytest.mark.parametrize(
    ("medium", "pointer"),
    [
        ({"scattering": -1}, "/scattering"), ({"absorption": [1, 2]}, "/absorption"), ({"g": 1}, "/g"),
        ({"g": -1.5}, "/g"), ({"albedo": 0.5}, "/radius"), ({"radius": 1}, "/albedo"),
        ({"emission": -1}, "/emission"),
        ({"albedo": 0.5, "radius": 0}, "/radius"), ({"albedo": 0.5, "radius": 1, "absorption": 1}, "/absorption"),
        ({"density": 1}, "/density"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(medium: dict[str, Any], pointer: str) -> None:
    with pytest.raises(InvalidDocument) as refused:
        parse_scene(scene({**ball("m"), "medium": medium}))
    assert refused.value.errors[0].pointer == f"/shapes/0/medium{pointer}"


@pytest.mark.parametrize("priority", [101, -101, 0.5, "high"])
def test_priorities_are_whole_and_bounded(priority: Any) -> None:
    with pytest.raises(InvalidDocument) as refused:
        parse_scene(scene({**ball("m"), "priority": priority}))
    assert refused.value.errors[0].pointer == "/shapes/0/priority"


def test_endless_space_must_not_shine_endlessly() -> None:
    around = {"type": "constant", "radiance": 0, "medium": {"emission": [1, 0, 0], "absorption": [0, 1, 1]}}
    with pytest.raises(InvalidDocument) as refused:
        parse_scene(scene(environment=around))
    assert refused.value.errors[0].pointer == "/environment/medium/emission"
