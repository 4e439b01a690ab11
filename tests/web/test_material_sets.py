"""A material carries its textures: saved, copied, downloaded, it comes whole into another scene, or not at all."""

from __future__ import annotations

import json
from typing import Any

import pytest
from playwright.sync_api import Page

from tests.serving import Server
from tests.web.editing import document, halves
from tests.web.editor import Editor
from tests.web.modules import call

SET = "document/material-set.js"
SHOWN = {"base_color": "worn-color", "roughness": "worn-rough", "normal_map": "worn-normal"}
BRASS = {
    "type": "principled",
    "base_color": {"texture": "color", "factor": 0.5},
    "roughness": {"texture": "grain"},
    "normal_map": {"texture": "color"},
}
COLOR, GRAIN = {"asset": "sha256:c"}, {"type": "checker", "a": 0.2, "b": 0.8}


def test_a_set_holds_what_its_material_shows(page: Page) -> None:
    scene = {"textures": {"color": COLOR, "grain": GRAIN, "other": {"asset": "sha256:o"}}}
    assert call(page, SET, "carried", "brass", {"type": "diffuse"}, scene) == {"type": "diffuse"}
    whole = call(page, SET, "carried", "brass", BRASS, scene)
    assert whole == {"materials": {"brass": BRASS}, "textures": {"color": COLOR, "grain": GRAIN}}
    assert call(page, SET, "unpacked", whole) == [{"name": "brass", "material": BRASS, "textures": whole["textures"]}]
    assert call(page, SET, "unpacked", BRASS) == [{"name": None, "material": BRASS, "textures": {}}]
    for other in (None, [], {}, {**whole, "shapes": []}, {"materials": 3}):
        assert call(page, SET, "unpacked", other) == [], other


def test_textures_come_under_names_that_are_free(page: Page) -> None:
    def received(own: dict[str, Any], **carried: Any) -> Any:
        return call(page, SET, "received", {"textures": own}, {"material": BRASS, "textures": carried})

    other = {"asset": "sha256:o"}
    made = received({"color": other, "color-2": other, "mine": GRAIN}, color=COLOR, grain=GRAIN)
    assert made["textures"] == {"color": other, "color-2": other, "mine": GRAIN, "color-3": COLOR}
    assert made["added"] == ["color-3"] and made["lost"] == []
    assert made["material"] == {
        "type": "principled",
        "base_color": {"texture": "color-3", "factor": 0.5},
        "roughness": {"texture": "mine"},
        "normal_map": {"texture": "color-3"},
    }
    # Names that change places are no chain.
    swapped = received({"color": GRAIN, "grain": COLOR}, color=COLOR, grain=GRAIN)
    assert swapped["added"] == [] and swapped["material"]["base_color"]["texture"] == "grain"
    assert swapped["material"]["roughness"]["texture"] == "color"
    # One of before came without: what the scene has of that name is shown, and the rest is left out.
    old = received({"color": other})
    assert old["lost"] == ["grain"] and set(old["material"]) == {"type", "base_color", "normal_map"}


def test_what_a_ramp_reads_comes_along(page: Page) -> None:
    noise, stops = {"type": "noise", "seed": 3}, [{"position": 0, "color": 0}, {"position": 1, "color": 1}]
    ramp = {"type": "ramp", "input": {"texture": "veins"}, "stops": stops}
    marble, scene = {"type": "diffuse", "albedo": {"texture": "color"}}, {"textures": {"veins": noise, "color": ramp}}
    whole = call(page, SET, "carried", "marble", marble, scene)
    assert whole["textures"] == scene["textures"]
    own = {"textures": {"veins": GRAIN, "color": GRAIN}}
    made = call(page, SET, "received", own, {"material": marble, **scene})
    assert made["added"] == ["veins-2", "color-2"] and made["textures"]["veins-2"] == noise
    assert made["textures"]["color-2"] == {**ramp, "input": {"texture": "veins-2"}}
    assert made["material"]["albedo"]["texture"] == "color-2"
    again = call(page, SET, "received", {"textures": made["textures"]}, {"material": marble, **scene})
    assert again["added"] == []


def shown(editor: Editor, material: str) -> dict[str, Any]:
    """The documents of the textures that a material shows, by parameter."""
    scene = document(editor)
    values = scene["materials"][material]
    return {name: scene["textures"][values[name]["texture"]] for name in SHOWN}


def textured(editor: Editor) -> dict[str, Any]:
    """The first scene's ball gets images of its own."""
    for i, (field, name) in enumerate(SHOWN.items()):
        editor.unfold()
        editor.drop(f"#material-form [data-field={field}]", {f"{name}.png": halves((0, 60 * i, 200))})
        chip = f"#material-form [data-field={field}] .texture"
        editor.wait("the texture", lambda chip=chip, name=name: name in editor.text(chip))
    return shown(editor, "Red paint")


def test_a_saved_material_is_used_in_another_scene(editor: Editor, server: Server) -> None:
    page = editor.page
    made = textured(editor)
    editor.act("save-material")
    page.fill("dialog[open] .entry", "worn brass")
    page.keyboard.press("Enter")
    option = page.get_by_role("listbox", name="Library").get_by_role("option", name="worn brass", exact=True)
    editor.wait("its name", lambda: option.count() == 1)
    stored = server.http.get("/v1/documents/materials/worn%20brass").json()
    assert set(stored["textures"]) == set(SHOWN.values())

    # Another scene, whose own texture has one of the names.
    editor.pick("scenes", "point-lights")
    editor.wait("the scene", lambda: editor.chosen("scenes") == "point-lights")
    page.click("#tab-materials")
    editor.unfold()
    editor.drop("#material-form [data-field=base_color]", {"worn-color.png": halves((200, 0, 0))})
    editor.wait("its own", lambda: "worn-color" in editor.text("[data-field=base_color] .texture"))
    before = document(editor)
    option.click()
    editor.wait("the material", lambda: "worn-rough" in editor.text("[data-field=roughness] .texture"))
    editor.settled()
    said = editor.text("#messages")
    assert said == "" or (said.startswith("Two point lights is open.") and said.endswith("Undo\n×")), (
        "and nothing else"
    )
    assert editor.chosen("materials") == "worn brass" and shown(editor, "worn brass") == made, "whole"
    after = document(editor)
    assert after["textures"]["worn-color"] == before["textures"]["worn-color"] != made["base_color"]
    assert after["materials"]["worn brass"]["base_color"]["texture"] == "worn-color-2"
    page.keyboard.press("Control+z")
    assert document(editor) == before, "in one undo"

    # The same by the clipboard, and as a file.
    page.keyboard.press("Control+Shift+z")
    editor.act("copy-material")
    file = editor.shot("#download-material")
    assert set(json.loads(file)["textures"]) == {"worn-color-2", "worn-rough", "worn-normal"}
    editor.pick("scenes", "sphere-on-floor")
    editor.wait("the scene", lambda: editor.chosen("scenes") == "sphere-on-floor")
    page.click("#tab-materials")
    editor.act("paste-material")
    editor.wait("the copy", lambda: page.is_visible("[data-field=base_color] .texture"))
    assert shown(editor, "Red paint") == made
    page.keyboard.press("Control+z")
    editor.drop("#stage", {"worn.json": file})
    editor.wait("the file's", lambda: page.is_visible("[data-field=base_color] .texture"))
    assert shown(editor, "Red paint") == made
    server.http.delete("/v1/documents/materials/worn%20brass")


@pytest.mark.slow
def test_a_refused_material_changes_nothing(editor: Editor, server: Server) -> None:
    page = editor.page
    editor.settled()
    before = document(editor)
    gone = {"asset": "sha256:" + "0" * 64}
    for wrong in (
        {"materials": {"worn": {**BRASS, "metallic": 1}}, "textures": {"color": gone, "grain": GRAIN}},
        {"materials": {"worn": {**BRASS, "metallic": 7}}, "textures": {"color": GRAIN, "grain": GRAIN}},
        {"type": "principled", "metallic": 1, "sheen": 7},
    ):
        editor.drop("#stage", {"worn.json": json.dumps(wrong).encode()})
        editor.wait("the refusal", lambda: page.locator(".message.refusal").count() == 1)
        assert document(editor) == before
        assert page.locator("#material-form .trouble:visible").count() == 0, "no field is half of it"
        page.click("#outline-list [data-thing='/camera']")
        page.click("#outline-list [data-thing='/shapes/0']")
        page.locator("[data-field=metallic] input[type=range]").press(
            "ArrowRight"
        )  # what was said goes with a change
        editor.wait("the next change", lambda: page.locator(".message.refusal").count() == 0)
        page.keyboard.press("Control+z")
        editor.settled()

    # One that was saved before materials carried their textures.
    old = {"type": "principled", "metallic": 1, "base_color": {"texture": "lost"}}
    server.http.put("/v1/documents/materials/old", json=old)
    page.reload()
    editor.settled()
    page.get_by_role("listbox", name="Library").get_by_role("option", name="old", exact=True).click()
    editor.wait("what is missing", lambda: "“lost” could not be found" in editor.text("#messages"))
    assert document(editor)["materials"]["old"] == {"type": "principled", "metallic": 1}
    server.http.delete("/v1/documents/materials/old")
