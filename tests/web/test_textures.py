"""How an image lies, and how a parameter reads it, from the controls beneath the parameter."""

from __future__ import annotations

import json

import numpy as np
import pytest

from tests.exr_files import written
from tests.web.editing import halves
from tests.web.editor import Editor

BENEATH = "#material-form [data-field=base_color] .beneath"


def test_a_texture_is_placed_read_and_taken_away(editor: Editor) -> None:
    page = editor.page
    plain = editor.settled()
    assert page.is_hidden(BENEATH)
    editor.drop("#material-form [data-field=base_color]", {"halves.png": halves()})
    editor.wait("the texture", lambda: page.is_visible(BENEATH))
    editor.wait_for_change(plain, 8)
    assert page.is_hidden("#drop"), "what the page would do with a file is said no more"
    before = editor.settled()
    page.click(f"{BENEATH} > summary")
    for name in ("channel", "factor", "color_space", "layer", "wrap", "scale", "rotation", "offset"):
        assert page.is_visible(f"{BENEATH} [data-field={name}]"), name

    offset = page.locator(f"{BENEATH} [data-field=offset] input").first
    offset.fill("0.5")
    offset.press("Enter")
    editor.wait_for_change(before, 8)
    page.keyboard.press("Control+z")
    editor.wait("the image's place", lambda: not editor.differs(before, 6))
    assert float(offset.input_value()) == 0

    page.select_option(f"{BENEATH} [data-field=channel] select", "b")
    editor.wait_for_change(before, 8)  # no blue in one half, little in the other
    page.click(f"{BENEATH} [data-field=channel] .reset")
    editor.wait("its colours", lambda: not editor.differs(before, 6))

    wraps = [page.locator(f"{BENEATH} [data-field=wrap] [aria-label='Wrap, {axis}']") for axis in "UV"]
    wraps[0].select_option("mirror")
    wraps[1].select_option("clamp")
    page.select_option(f"{BENEATH} [data-field=color_space] select", "linear")
    turn = page.locator(f"{BENEATH} [data-field=rotation] input.number")
    turn.fill("30")
    turn.press("Enter")
    across = page.locator(f"{BENEATH} [data-field=scale] input").first
    across.fill("3")
    across.press("Enter")
    power = page.locator(f"{BENEATH} [data-field=factor] input.entry:not(.number)")
    power.fill("0.5 0.5 0.5")
    power.press("Enter")
    editor.wait_for_change(before)
    editor.settled()
    assert editor.text("#messages") == ""
    document = json.loads(editor.shot("#download-scene"))
    assert document["materials"]["Red paint"]["base_color"] == {"texture": "halves", "factor": [0.5, 0.5, 0.5]}
    lies = {key: value for key, value in document["textures"]["halves"].items() if key != "asset"}
    assert lies == {"wrap": ["mirror", "clamp"], "color_space": "linear", "rotation": 30, "scale": [3, 1]}

    editor.tab("material")
    page.click("[data-field=base_color] .texture .forget")
    editor.wait("no texture", lambda: page.is_hidden(BENEATH) and page.is_hidden("[data-field=base_color] .texture"))
    page.keyboard.press("Control+z")
    editor.wait("the texture again", lambda: page.is_visible(f"{BENEATH} [data-field=wrap]"))
    assert [one.input_value() for one in wraps] == ["mirror", "clamp"]
    wraps[0].select_option("clamp")
    editor.settled()
    assert json.loads(editor.shot("#download-scene"))["textures"]["halves"]["wrap"] == "clamp"


@pytest.mark.slow
def test_another_image_is_read_and_lies_as_the_one_before(editor: Editor) -> None:
    page = editor.page
    for parameter in ("roughness", "base_color"):
        editor.drop(f"#material-form [data-field={parameter}]", {"halves.png": halves()})
        editor.wait("the texture", lambda name=parameter: page.is_visible(f"[data-field={name}] .beneath"))
    page.click(f"{BENEATH} > summary")
    shared = f"{BENEATH} > p"
    assert editor.text(shared) == "This changes all 2 parameters that use halves."
    turn = page.locator(f"{BENEATH} [data-field=rotation] input.number")
    turn.fill("30")
    turn.press("Enter")
    page.select_option(f"{BENEATH} [data-field=channel] select", "r")
    power = page.locator(f"{BENEATH} [data-field=factor] input.entry:not(.number)")
    power.fill("0.5 0.5 0.5")
    power.press("Enter")
    before = editor.settled()
    editor.drop("#material-form [data-field=base_color]", {"other.png": halves((220, 0, 0))})
    editor.wait("the other image", lambda: "other" in editor.text("[data-field=base_color] .texture"))
    editor.wait_for_change(before, 8)  # the first has no red
    assert page.is_hidden(shared), "nothing else shows the other image"
    assert float(turn.input_value()) == 30
    document = json.loads(editor.shot("#download-scene"))
    coat, textures = document["materials"]["Red paint"], document["textures"]
    assert coat["base_color"] == {"texture": "other", "channel": "r", "factor": [0.5, 0.5, 0.5]}
    assert coat["roughness"] == {"texture": "halves"}
    assert textures["other"]["rotation"] == textures["halves"]["rotation"] == 30


def test_a_layer_of_an_image_is_named(editor: Editor) -> None:
    """It goes with the image, its thumbnail shows it, and a name that is not there is told at its control."""
    page = editor.page
    thumbnail = "[data-field=base_color] .texture canvas"
    texels = np.zeros((4, 4, 6), np.float32)
    texels[..., 0], texels[..., 5] = 1, 1
    layers = written(texels, [f"{layer}.{channel}" for layer in ("AO", "beauty") for channel in "RGB"])
    editor.drop("#material-form [data-field=base_color]", {"layers.exr": layers})
    editor.wait("the texture", lambda: page.is_visible(BENEATH))
    before = editor.settled()
    editor.wait("its picture, a blue one", lambda: int(np.argmax(painted(editor, thumbnail)[:3])) == 2)
    page.click(f"{BENEATH} > summary")
    layer = page.locator(f"{BENEATH} [data-field=layer] input")
    layer.fill("depth")
    layer.press("Enter")
    trouble = f"{BENEATH} [data-field=layer] .trouble"
    editor.wait("the refusal", lambda: page.is_visible(trouble))
    assert "AO, beauty" in editor.text(trouble)
    layer.fill("AO")
    layer.press("Enter")
    editor.wait_for_change(before, 8)
    editor.wait("forgiveness", lambda: page.is_hidden(trouble))
    assert json.loads(editor.shot("#download-scene"))["textures"]["layers"]["layer"] == "AO"
    editor.wait("the layer's, a red one", lambda: painted(editor, thumbnail)[0] > painted(editor, thumbnail)[2])
    editor.drop("#material-form [data-field=base_color]", {"halves.png": halves()})
    editor.wait("the other image", lambda: "halves" in editor.text("[data-field=base_color] .texture"))
    assert "layer" not in json.loads(editor.shot("#download-scene"))["textures"]["halves"]


def test_what_is_wrong_with_a_texture_is_said_at_its_control(editor: Editor) -> None:
    page = editor.page
    editor.drop("#material-form [data-field=base_color]", {"halves.png": halves()})
    editor.wait("the texture", lambda: page.is_visible(BENEATH))
    page.click(f"{BENEATH} > summary")
    second = page.locator(f"{BENEATH} [data-field=uv] input")
    second.fill("7")
    second.press("Enter")
    editor.wait("the refusal", lambda: page.is_visible(f"{BENEATH} [data-field=uv] .trouble"))
    assert page.locator("#material-form [aria-invalid=true]").count() == 1
    second.fill("1")
    second.press("Enter")
    editor.wait("forgiveness", lambda: page.is_hidden(f"{BENEATH} [data-field=uv] .trouble"))


def painted(editor: Editor, canvas: str) -> list[int]:
    """The colours of a thumbnail a quarter and three quarters across, red, green, blue and alpha each."""
    script = """([canvas]) => {
        const context = document.querySelector(canvas).getContext("2d");
        return [16, 48].flatMap((x) => [...context.getImageData(x, 16, 1, 1).data]);
    }"""
    values: list[int] = editor.page.evaluate(script, [canvas])
    return values


def test_every_place_for_an_image_is_reached_by_keyboard(editor: Editor) -> None:
    page = editor.page
    schema = page.request.get(page.url + "v1/schema").json()["scene"]["$defs"]
    principled = next(m for m in schema.values() if "sheen_roughness" in m["properties"])["properties"]
    takes = {name for name, field in principled.items() if "Texture" in json.dumps(field)}
    editor.unfold()
    offered = page.eval_on_selector_all("#material-form .pictured", "all => all.map((row) => row.dataset.field)")
    assert set(offered) == takes and len(takes) > 20

    page.locator("[data-field=normal_map] .choose").focus()
    page.keyboard.press("Enter")
    page.wait_for_selector("dialog[open] .tile:focus")  # the sheet is fetched when it is asked for
    with page.expect_file_chooser() as asked:
        page.keyboard.press("Enter")  # the first of what is offered
    asked.value.set_files({"name": "halves.png", "mimeType": "image/png", "buffer": halves()})
    editor.wait("the normal map", lambda: page.is_visible("[data-field=normal_map] .texture"))
    focused = "document.activeElement.closest('[data-field]')?.dataset.field"
    editor.wait("the keyboard to go on there", lambda: page.evaluate(focused) == "normal_map")
    thumbnail = "[data-field=normal_map] .texture canvas"
    editor.wait("its picture", lambda: painted(editor, thumbnail) == [0, 220, 0, 255, 0, 0, 40, 255])


def test_textures_are_used_again_and_checkers_made(editor: Editor) -> None:
    page = editor.page
    editor.drop("#material-form [data-field=base_color]", {"halves.png": halves()})
    editor.wait("the texture", lambda: page.is_visible("[data-field=base_color] .texture"))
    kept = "JSON.stringify([{ ...localStorage }, { ...sessionStorage }])"
    editor.wait("autosave", lambda: "halves" in page.evaluate(kept))
    page.reload()  # so that the picture has to come from the server
    editor.wait("the work", lambda: page.is_visible("[data-field=base_color] .texture"))
    page.click("[data-field=roughness] .image")
    tile = "dialog[open] .tile[value='texture:halves']"
    assert "used once" in editor.text(tile)
    editor.wait("its picture", lambda: painted(editor, f"{tile} canvas") == [0, 220, 0, 255, 0, 0, 40, 255])
    page.click(tile)
    page.click("[data-field=metallic] .image")
    page.click("dialog[open] .tile[value=checker]")
    summary = "[data-field=metallic] .beneath > summary"
    editor.wait("the checker", lambda: editor.text(summary).startswith("Checker"))
    # Another one in the place of the first is chosen from its picture.
    page.click("[data-field=roughness] .texture .open")
    page.click("dialog[open] .tile[value='texture:checker']")
    editor.wait("the server's picture of it", lambda: page.get_attribute("#stage", "aria-busy") == "false")
    assert page.locator(".message.refusal").count() == 0
    document = json.loads(editor.shot("#download-scene"))
    coat = document["materials"]["Red paint"]
    assert [coat[name]["texture"] for name in ("base_color", "roughness", "metallic")] == [
        "halves",
        "checker",
        "checker",
    ]
    assert document["textures"]["checker"] == {"type": "checker", "a": 0.8, "b": 0.2}


def test_a_materials_picture_shows_its_texture(editor: Editor) -> None:
    page = editor.page
    # How much green is over red where that is most, and how little: of a ball of one colour both are the same sign.
    greens = """(image) => {
        const context = new OffscreenCanvas(8, 8).getContext("2d");
        context.drawImage(image, 0, 0, 8, 8);
        const { data } = context.getImageData(2, 2, 4, 4);
        const over = [...data.keys()].filter((i) => i % 4 === 0).map((i) => data[i + 1] - data[i]);
        return [Math.max(...over), Math.min(...over)];
    }"""
    ball = page.locator("#materials [data-value='Red paint'] img")
    assert ball.evaluate(greens)[0] < 0, "it is red"
    editor.drop("#material-form [data-field=base_color]", {"halves.png": halves(left=(0, 220, 0))})
    editor.wait("the texture", lambda: page.is_visible(BENEATH))
    page.click("#pause")  # then there is time for small pictures
    editor.wait("green on the ball, and not on all of it", lambda: shows(ball.evaluate(greens)))


def shows(greens: list[float]) -> bool:
    most, least = greens
    return most > 40 and least < most / 2


def test_a_ramp_over_noise_is_made_by_hand(editor: Editor) -> None:
    page = editor.page
    page.click("[data-field=base_color] button.image")
    page.click(".tile[value=ramp]")
    editor.wait("the ramp", lambda: page.is_visible(BENEATH))
    page.click(f"{BENEATH} > summary")
    editor.wait("its stops", lambda: page.locator(f"{BENEATH} [role=group]").count() == 2)
    page.get_by_label("Input", exact=True).select_option("new noise")
    octaves = page.locator(f"{BENEATH} [data-field=octaves] input.number")
    octaves.fill("2")
    octaves.press("Enter")
    page.click(f"{BENEATH} button:has-text('Add a stop')")
    editor.wait("a third stop", lambda: page.locator(f"{BENEATH} [role=group]").count() == 3)
    page.get_by_role("button", name="Remove stop 1").click()
    editor.wait("one less", lambda: page.locator(f"{BENEATH} [role=group]").count() == 2)
    document = json.loads(editor.shot("#download-scene"))
    ramp, noise = document["textures"]["ramp"], document["textures"]["noise"]
    assert noise == {"type": "noise", "octaves": 2} and ramp["input"] == {"texture": "noise"}
    assert [stop["position"] for stop in ramp["stops"]] == [0.5, 1]
    assert editor.text("#messages") == ""
    for count in (3, 2):  # undone while the form stands open
        page.keyboard.press("Control+z")
        editor.wait("the stops of before", lambda n=count: page.locator(f"{BENEATH} [role=group]").count() == n)  # type: ignore[misc]
    page.keyboard.press("Control+Shift+z")
    editor.wait("the third stop again", lambda: page.locator(f"{BENEATH} [role=group]").count() == 3)
    assert editor.complaints == []
