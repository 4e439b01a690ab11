"""Two variants of a material: swipe, side by side, difference; and the models of the same object."""

from __future__ import annotations

import io
import math
import re

import numpy as np
import pytest
from PIL import Image

from tests.web.editing import finish, overlay, point
from tests.web.editor import Editor

WAY = "#comparison [aria-label=Comparison]"


def metric(editor: Editor) -> float:
    """In percent; not a number before there is one."""
    found = re.search(r"RMSE ([\d.]+) %", editor.text("#comparison"))
    return float(found[1]) if found else math.nan


def test_a_b(editor: Editor) -> None:
    editor.settled()
    editor.compare()
    editor.wait("equal variants", lambda: metric(editor) < 3)
    editor.page.select_option("#comparison select[aria-label^=Turn]", "blinn_phong")
    editor.wait("a difference", lambda: metric(editor) > 4)
    assert editor.text("#messages") == "", "the other model was taken"
    # Left of the divider there is A, right of it B.
    clip = editor.page.evaluate("getComputedStyle(document.getElementById('picture-b')).clipPath")
    assert clip == "inset(0px 0px 0px 50%)"
    editor.page.locator("#divider").focus()
    for _ in range(10):
        editor.page.keyboard.press("ArrowLeft")
    assert "40%" in editor.page.evaluate("getComputedStyle(document.getElementById('picture-b')).clipPath")

    editor.page.select_option(WAY, "difference")
    editor.wait("its picture", lambda: overlay(editor, "difference")[..., :3].max() > 60)
    drawn = overlay(editor, "difference")[..., :3]
    middle = drawn.shape[0] // 2, drawn.shape[1] // 2
    ball = drawn[middle[0] - 20 : middle[0] + 20, middle[1] - 20 : middle[1] + 20].mean()
    assert ball > 1.3 * drawn[:20, :20].mean(), "the ball differs most; the floor has its light"

    editor.page.click("#comparison [data-value=b]")
    assert editor.page.input_value("#model") == "blinn_phong"
    editor.page.select_option("#model", "disney")
    editor.page.click("#comparison [data-value=a]")
    assert editor.page.input_value("#model") == "principled", "A is as it was"

    editor.page.select_option(WAY, "beside")
    half = editor.page.locator("#picture-b").bounding_box()
    assert half is not None and half["x"] > point(editor, 0.49, 0)[0]
    editor.page.click("#comparison >> text=Done")
    assert editor.page.is_hidden("#comparison") and editor.page.is_hidden("#picture-b")
    editor.page.keyboard.press("Control+z")
    assert editor.page.is_visible("#comparison"), "comparing is undone like everything"


def test_b_stays_until_it_is_thrown_away(editor: Editor) -> None:
    page = editor.page
    editor.settled()
    editor.compare()
    page.select_option("#comparison select[aria-label^=Turn]", "diffuse")
    editor.wait("B", lambda: "Diffuse" in editor.text(".variant.b"))
    page.click("#comparison [data-value=b]")
    assert page.get_by_role("heading", name="Editing B").is_visible()
    assert page.input_value("#model") == "diffuse"
    page.click("#comparison >> text=Done")
    assert page.is_hidden("#editing") and page.input_value("#model") == "principled"
    editor.compare()
    assert "Diffuse" in editor.text(".variant.b"), "Done kept it"
    assert page.get_by_role("heading", name="Editing A").is_visible()
    page.click("#comparison >> text=Discard B")
    assert page.is_hidden("#comparison")
    editor.compare()
    assert "Principled" in editor.text(".variant.b"), "a copy of A"


def test_b_is_awaited_in_words_and_a_link_keeps_the_way_of_comparing(editor: Editor) -> None:
    """The second stream is held up: what is shown then is neither B nor a difference."""
    page = editor.page
    editor.settled()
    page.evaluate("() => { window.WebSocket = class { static OPEN = 1; static CLOSED = 3; send() {} close() {} }; }")
    editor.compare()
    page.select_option(WAY, "difference")
    page.select_option("#comparison [aria-label^='How much']", "16")
    awaited = "B · Principled · being prepared"
    assert page.locator(".variant").all_text_contents() == ["Difference ×16", awaited]
    assert page.is_hidden("#difference") and page.is_hidden("#picture-b"), "A is there, and stays"
    page.select_option(WAY, "swipe")
    assert page.locator(".variant.b").text_content() == awaited
    assert page.get_by_role("status", name="Verdict").inner_text() == "B is being prepared"
    page.select_option(WAY, "difference")

    page.click("#share")
    editor.wait("the link", lambda: "#v=" in page.input_value(".command"))
    page.goto(page.input_value(".command"))
    page.reload()  # another fragment alone loads nothing
    editor.wait("the difference", lambda: "Principled against" in editor.text(".variant.b"))
    assert page.input_value(WAY) == "difference"
    assert editor.text(".variant.a") == "Difference ×16"


def test_what_is_measured_are_the_pixels(editor: Editor) -> None:
    finish(editor, 4)
    editor.compare()
    editor.page.select_option("#comparison select[aria-label^=Turn]", "diffuse")
    labels = editor.page.locator(".variant")
    both = ["A · Principled · 4 samples", "B · Diffuse · 4 samples"]
    editor.wait("both", lambda: labels.all_text_contents() == both)
    editor.wait("the end", lambda: editor.text("#state") == "Done" and metric(editor) > 0)
    saved = np.asarray(Image.open(io.BytesIO(editor.shot("#download"))).convert("RGB"), int)
    a, b = (overlay(editor, canvas)[..., :3].astype(int) for canvas in ("picture", "picture-b"))
    assert np.array_equal(a, saved), "no JPEG lies between"
    rmse = 100 * float(np.sqrt(((a - b) ** 2).mean())) / 255
    editor.wait("the measure", lambda: abs(metric(editor) - rmse) < 0.006)

    editor.page.select_option(WAY, "difference")
    editor.wait("its picture", lambda: overlay(editor, "difference")[..., :3].max() > 0)
    for gain in (4, 1, 16):
        editor.page.select_option("#comparison [aria-label^='How much']", str(gain))
        wanted = np.minimum(gain * np.abs(a - b), 255)
        editor.wait("the gain", lambda w=wanted: np.array_equal(overlay(editor, "difference")[..., :3], w))

    editor.page.select_option(WAY, "heat")  # gain 16: black, red, yellow, white by the largest channel
    heat = np.clip(3 * 16 * np.abs(a - b).max(-1)[..., None] - [0, 255, 510], 0, 255)
    editor.wait("the heat", lambda: np.array_equal(overlay(editor, "difference")[..., :3], heat))

    whole = a.shape[1] / a.shape[0]
    editor.page.select_option(WAY, "beside")
    aspect = "document.getElementById('picture').width / document.getElementById('picture').height"
    editor.wait("half the size", lambda: editor.page.evaluate("picture.width") < 0.9 * a.shape[1])
    assert editor.page.evaluate(aspect) == pytest.approx(whole, rel=0.02), "all of the view stays"


@pytest.mark.slow
def test_every_model_is_taken(editor: Editor) -> None:
    editor.settled()
    models = editor.page.eval_on_selector_all("#model option", "all => all.map((each) => each.value)")
    for model in set(models) - {"measured"}:  # which asks for its file first: test_measured
        editor.page.select_option("#model", "principled")
        editor.page.select_option("#model", model)
        editor.settled()
        assert editor.page.input_value("#model") == model
        assert editor.text("#messages") == "", model


def test_materials_are_copied_and_pasted(editor: Editor) -> None:
    before = editor.settled()
    editor.page.click("#library [data-value=gold]")
    editor.wait_for_change(before)
    gold = editor.settled()
    editor.act("copy-material")
    editor.page.keyboard.press("Control+z")
    editor.wait("the first material", lambda: editor.page.input_value(editor.field("metallic", "number")) == "0")
    editor.act("paste-material")
    editor.wait("gold again", lambda: editor.page.input_value(editor.field("metallic", "number")) == "1")
    editor.settled()
    assert not editor.differs(gold, 8)


def test_presets_are_pictures_taken_by_the_service(editor: Editor) -> None:
    editor.settled()
    # Of the library's own, that is; those of the database are taken when somebody looks at them.
    script = """() => [...document.querySelectorAll("#library img[src*='/thumbnails/']")].map((image) => {
        const small = new OffscreenCanvas(1, 1).getContext("2d");
        small.drawImage(image, 0, 0, 1, 1);
        return [image.naturalWidth, ...small.getImageData(0, 0, 1, 1).data];
    })"""
    editor.leafed("library")
    colors = np.asarray(editor.page.evaluate(script))[:, 1:4]
    assert len(colors) > 40 and len(np.unique(colors, axis=0)) > len(colors) / 2
