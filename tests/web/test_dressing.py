"""One selection, one name: what a material of the library does to the thing that is chosen."""

from __future__ import annotations

from typing import Any

import pytest
from playwright.sync_api import Page

from tests.web.editing import document
from tests.web.editor import Editor
from tests.web.modules import call

DRESSING, MATERIALS = "document/dressing.js", "document/materials.js"
RED, GREY, GOLD = ({"type": "diffuse", "albedo": x} for x in (0.1, 0.5, 0.9))


def state(*worn: str, **compare: Any) -> dict[str, Any]:
    """A scene with the materials Red paint, Floor and Spare, and a ball for each that is worn."""
    return {
        "scene": {
            "materials": {"Red paint": RED, "Floor": GREY, "Spare": GREY},
            "shapes": [{"type": "sphere", "material": name} for name in worn],
        },
        "chosen": {"thing": "/shapes/0", "material": worn[0]},
        "compare": compare or None,
    }


def dressed(page: Page, before: dict[str, Any], things: list[str], *was: str) -> Any:
    return call(page, DRESSING, "dressed", before, things, {"document": GOLD, "wanted": "Gold"}, *was)


def worn(made: dict[str, Any]) -> list[str]:
    return [shape["material"] for shape in made["scene"]["shapes"]]


def test_a_material_of_its_own_gives_way_to_the_one_of_the_library(page: Page) -> None:
    made = dressed(page, state("Red paint", "Floor"), ["/shapes/0"])
    assert list(made["scene"]["materials"].items()) == [("Gold", GOLD), ("Floor", GREY), ("Spare", GREY)]
    assert worn(made) == ["Gold", "Floor"] and made["material"] == "Gold"


def test_of_several_things_only_those_that_are_chosen_change(page: Page) -> None:
    before = state("Red paint", "Red paint", "Red paint")
    made = dressed(page, before, ["/shapes/1"])
    assert worn(made) == ["Red paint", "Gold", "Red paint"]
    assert list(made["scene"]["materials"]) == ["Red paint", "Floor", "Spare", "Gold"]
    every = dressed(page, before, [f"/shapes/{i}" for i in range(3)])
    assert worn(every) == ["Gold"] * 3 and "Red paint" not in every["scene"]["materials"]


def test_a_name_is_taken_once_and_the_same_material_is_not_there_twice(page: Page) -> None:
    before = state("Red paint", "Gold")
    before["scene"]["materials"]["Gold"] = GOLD
    again = dressed(page, before, ["/shapes/0"])
    assert worn(again) == ["Gold", "Gold"] and list(again["scene"]["materials"]) == ["Floor", "Spare", "Gold"]
    before["scene"]["materials"]["Gold"] = GREY  # edited meanwhile
    other = dressed(page, before, ["/shapes/0"])
    assert worn(other) == ["Gold 2", "Gold"] and other["scene"]["materials"]["Gold 2"] == GOLD
    back = dressed(page, before, ["/shapes/1"])
    assert worn(back) == ["Red paint", "Gold"] and back["scene"]["materials"]["Gold"] == GOLD, "its own name is free"
    names = [call(page, MATERIALS, "fresh", wanted, {wanted: 1}) for wanted in ("copper", "wing-2", "Gold", "Gold 2")]
    assert names == ["copper-2", "wing-3", "Gold 2", "Gold 3"]


def test_what_refers_to_a_material_follows_its_name(page: Page) -> None:
    before = state("Red paint", material="Red paint", document=GREY, side="a")
    made = dressed(page, before, ["/shapes/0"])
    assert made["compare"]["material"] == "Gold" and made["compare"]["document"] == GREY
    before["chosen"]["thing"] = "/materials/Spare"
    before["chosen"]["material"] = "Spare"
    renamed = call(page, MATERIALS, "renamed", before, "Spare", "Chalk")
    assert renamed["chosen"] == {"thing": "/materials/Chalk", "material": "Chalk"}
    alone = dressed(page, before, [], "Spare")
    assert list(alone["scene"]["materials"]) == ["Red paint", "Floor", "Gold"] and alone["material"] == "Gold"


@pytest.mark.parametrize("shared", [False, True])
def test_a_refused_material_leaves_all_as_it_was(page: Page, shared: bool) -> None:
    before = state(*["Red paint"] * (2 if shared else 1), material="Red paint", document=GREY, side="a")
    if shared:
        before["compare"] = None
    made = dressed(page, before, ["/shapes/0"])
    after = {**before, **{key: made[key] for key in ("scene", "compare")}}
    after["chosen"] = {"thing": "/shapes/0", "material": "Gold"}
    assert call(page, "document/material-set.js", "withdrawn", after, made["arrival"]) == before


def test_the_selection_follows_a_material(page: Page) -> None:
    def selected(thing: str, material: str) -> Any:
        chosen = {"thing": thing, "material": material}
        return call(
            page, MATERIALS, "selectedWith", {**state("Red paint", "Floor", "Floor"), "chosen": chosen}, material
        )

    assert selected("/shapes/0", "Floor") == "/shapes/1", "the first that is made of it"
    assert selected("/shapes/2", "Floor") == "/shapes/2"
    assert selected("/shapes/0", "Spare") == "/shapes/0", "it can be put on that"
    assert selected("/camera", "Spare") == "/materials/Spare"
    gone = call(page, "document/outline.js", "without", state("Red paint", "Floor"), ["/shapes/0"])
    assert gone["chosen"]["material"] == "Floor", "the inspector goes on with what is selected then"
    removed = call(page, MATERIALS, "removed", state("Red paint", "Floor"), "Red paint", "Spare")
    assert removed["chosen"] == {"thing": "/shapes/0", "material": "Spare"}


def test_a_set_goes_to_the_selection_where_the_picture_cannot_answer(page: Page) -> None:
    script = """async (answer) => {
        const { thingFor } = await import(new URL("texture-set.js", location));
        const shapeAt = async () => {
            if (answer === "fails") throw new Error("no picture yet");
            return answer;
        };
        const state = { chosen: { thing: "/shapes/3" } };
        return thingFor({ x: 1, y: 1 }, { controller: { shapeAt }, state });
    }"""
    assert page.evaluate(script, "fails") == "/shapes/3"
    assert page.evaluate(script, None) is None, "the background: it goes onto the shelf"
    assert page.evaluate(script, 1) == "/shapes/1"


def test_a_click_dresses_what_is_chosen(editor: Editor) -> None:
    page = editor.page

    def shown() -> tuple[str, str]:
        return editor.text("#material-name"), editor.text("#material-users")

    first = document(editor)
    editor.pick("materials", "Floor")
    page.click("#duplicate-material")
    editor.pick("materials", "Floor")
    assert shown() == ("Floor", "On nothing yet") and editor.text("#put-on") == "Put on Quad"
    editor.pick("library", "gold")
    editor.wait("gold on the floor", lambda: shown() == ("Gold", "On Quad"))
    assert list(document(editor)["materials"]) == ["Red paint", "Floor", "Gold"]
    assert page.get_attribute("#library [data-value=gold]", "aria-selected") == "true"
    page.click("#tab-render")
    page.click("#tab-properties")
    assert page.get_attribute("#library [data-value=gold]", "aria-selected") == "true", "it is not forgotten"
    page.click("#outline-list [data-thing='/shapes/0']")
    editor.pick("library", "gold")
    editor.wait("gold on both", lambda: shown() == ("Gold", "On Sphere and Quad"))
    editor.pick("library", "chalk")
    editor.wait("chalk on the ball", lambda: shown() == ("Chalk", "On Sphere"))
    assert [shape["material"] for shape in document(editor)["shapes"]] == ["Chalk", "Gold"]
    for _ in range(4):
        page.keyboard.press("Control+z")
    assert document(editor) == first and page.is_disabled("#undo"), "each was one step"
    page.keyboard.press("Delete")
    editor.wait("the other thing", lambda: shown() == ("Red paint", "On Sphere"))
    page.keyboard.press("Delete")
    assert "keeps at least one thing" in editor.text("#messages")
    assert editor.complaints == []
