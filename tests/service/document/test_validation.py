"""Mistakes are looked for as far as they are told: what a document costs does not grow with what is wrong with it."""

from __future__ import annotations

import json
import tracemalloc
from typing import Any

import pytest

from service.config import Config
from service.document import merge_patch, parse_scene
from service.document.base import MOST_MISTAKES
from service.document.document import Parsed
from service.document.shape import SphereShape
from service.problems import LONGEST_STEP, InvalidDocument
from service.server.streams import protocol

MANY = 100_000
BALL = {"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "grey"}


def scene(**parts: Any) -> dict[str, Any]:
    grey = {"grey": {"type": "diffuse", "albedo": 0.5}}
    camera = {"position": [0, 0, 4], "target": [0, 0, 0]}
    return {"version": 1, "camera": camera, "materials": grey, "shapes": [BALL], **parts}


def refused(document: Any, **options: Any) -> InvalidDocument:
    with pytest.raises(InvalidDocument) as caught:
        parse_scene(document, **options)
    return caught.value


@pytest.mark.parametrize(
    "document",
    [
        scene(shapes=[1] * MANY),
        scene(shapes=[{}] * MANY + [1] * MANY),
        scene(shapes=[BALL | {f"a{i}": 1 for i in range(MANY)}]),
        scene(materials={str(i): {} for i in range(MANY)}),
        scene(lights=[{"type": "point"}] * MANY),
        scene(**{f"a{i}": 1 for i in range(MANY)}),
    ],
    ids=["wrong", "mixed", "names", "materials", "lights", "top"],
)
def test_no_more_is_looked_for_than_is_told(document: Any) -> None:
    """Pydantic keeps about 1 KiB for each error: 100 MB here, and minutes where the time grew with the square."""
    tracemalloc.start()
    try:
        error = refused(document)
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert len(error.errors) == MOST_MISTAKES
    assert most < 40 << 20  # of which the dictionary without these names is the most


def test_a_message_of_unknown_names_is_refused_in_a_hundred_words() -> None:
    with pytest.raises(InvalidDocument) as caught:
        protocol.parse(json.dumps({"type": "ping"} | {f"a{i}": 1 for i in range(MANY)}))
    assert [error.pointer for error in caught.value.errors] == [f"/a{i}" for i in range(MOST_MISTAKES)]


def test_every_part_tells_its_mistakes_in_the_order_of_the_document() -> None:
    error = refused(scene(shapes=[2], zzz=1, materials={"a/b": 3}, lights=[BALL, 1], camera=4))
    pointers = [each.pointer for each in error.errors]
    assert pointers == ["/camera", "/lights/0/type", "/lights/1", "/materials/a~1b", "/shapes/0", "/zzz"]


def test_what_kind_of_thing_it_is_comes_first() -> None:
    error = refused(scene(shapes=[{"type": "torus", "material": 1}, BALL | {"radius": -1}]))
    assert [each.pointer for each in error.errors] == ["/shapes/0/type", "/shapes/1/radius"]


def test_long_names_do_not_fill_the_answer() -> None:
    name = "~" * (1 << 20)
    error = refused(scene(materials={name: {"type": "diffuse"} | {str(i): 1 for i in range(200)}}))
    assert len(error.errors) == MOST_MISTAKES
    assert all(len(each.pointer) < 3 * LONGEST_STEP for each in error.errors)


@pytest.mark.parametrize("part", ["shapes", "lights", "materials", "textures"])
def test_counts_are_checked_before_anything_is_looked_at(part: str) -> None:
    limits = Config(_env_file=None, **{f"max_{part}": 3})  # type: ignore[call-arg]
    entries: Any = [None] * 4 if part in ("shapes", "lights") else dict.fromkeys("abcd")
    error = refused(scene(**{part: entries}), limits=limits)
    assert [each.pointer for each in error.errors] == [f"/{part}"]
    assert f"SUNBOX_MAX_{part.upper()}" in error.errors[0].detail


def test_an_edit_validates_what_it_changes() -> None:
    """Entries that a merge patch leaves alone are the same objects in both scenes."""
    document = scene(materials={name: {"type": "diffuse", "albedo": 0.5} for name in ("grey", "other")})
    before = Parsed(document, parse_scene(document))
    changed = merge_patch(document, {"materials": {"other": {"albedo": 0.25}}})
    after = parse_scene(changed, before=before)
    assert after == parse_scene(changed)
    assert after.shapes is before.scene.shapes
    assert after.materials["grey"] is before.scene.materials["grey"]
    assert after.materials["other"] != before.scene.materials["other"]
    assert isinstance(after.shapes[0], SphereShape)
    error = refused(merge_patch(document, {"materials": {"other": {"albedo": 2}}}), before=before)
    assert [each.pointer for each in error.errors] == ["/materials/other/albedo"]
    gone = merge_patch(document, {"materials": {"grey": None}})
    assert [each.pointer for each in refused(gone, before=before).errors] == ["/shapes/0/material"]
