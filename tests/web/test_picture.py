"""The picture under the hand: picking, framing, focus, flying, reading pixels, layers and overlays."""

from __future__ import annotations

import re

import numpy as np
import pytest

from tests.marks import seldom
from tests.web.editing import camera, click, overlay, point
from tests.web.editor import Editor


def to_the_horizon(editor: Editor) -> None:
    """Down to the floor, over which the sky is seen then."""
    before = editor.settled()
    editor.page.focus("#stage")
    for _ in range(3):
        editor.page.keyboard.press("ArrowUp")
    editor.wait_for_change(before)


def test_a_click_selects_the_thing_and_its_material(editor: Editor) -> None:
    editor.settled()
    samples = editor.samples()
    click(editor, 0.1, 0.9)
    editor.wait("the floor", lambda: editor.chosen("materials") == "Floor")
    editor.wait("its outline", lambda: overlay(editor, "outline")[..., 3].any())
    outline = "document.querySelector('#outline')"
    scale = editor.page.evaluate(f"{outline}.width / ({outline}.clientWidth * devicePixelRatio)")
    assert scale == pytest.approx(1, abs=0.02), "as fine as the screen, whatever the picture is"
    click(editor, 0.5, 0.5)
    editor.wait("the ball", lambda: editor.chosen("materials") == "Red paint")
    shown = "document.querySelector('#outline').classList.contains('shown')"
    editor.wait("its outline", lambda: editor.page.evaluate(shown))
    rows = np.flatnonzero(overlay(editor, "outline")[..., 3].any(axis=1))
    tall = editor.page.evaluate(f"{outline}.height")
    assert 0.02 * tall < rows.min() < rows.max() < 0.9 * tall, "the ball is a part of the picture"
    editor.page.wait_for_timeout(1500)
    assert editor.page.evaluate(shown), "the outline stays while the selection and the view do"
    editor.tab("scene")
    assert editor.page.get_attribute("#outline-list [data-thing='/shapes/0']", "aria-selected") == "true"
    assert editor.samples() >= samples, "picking costs no sample"
    to_the_horizon(editor)
    click(editor, 0.05, 0.04)
    editor.wait("the sky", lambda: editor.text("#thing-title") == "Environment")
    click(editor, 0.5, 0.5)
    editor.wait("its outline", lambda: editor.page.evaluate(shown))
    editor.page.select_option("#thing-material", "Floor")
    assert editor.page.evaluate(shown), "it stays while another material is prepared"


def test_frame_focus_and_fly(editor: Editor) -> None:
    first = editor.settled()
    editor.page.keyboard.press("6")
    click(editor, 0.5, 0.55)
    editor.wait("a focus", lambda: camera(editor)["aperture_radius"][0] > 0)
    distance = camera(editor)["focus_distance"][0]
    assert 4 < distance < 4.6, "the ball's front, 5.2 m away with a radius of 1"
    editor.page.keyboard.press("Escape")
    editor.page.click("#outline-list [data-thing='/shapes/0']")
    editor.page.click("#thing-acts button >> nth=0")  # Frame
    editor.wait("the ball in the middle", lambda: camera(editor)["target"] == [0, 1, 0])
    editor.wait_for_change(first)
    before = camera(editor)["position"]
    editor.page.evaluate("document.activeElement.blur()")
    editor.page.keyboard.down("w")
    editor.wait("a flight", lambda: camera(editor)["position"][2] < before[2] - 0.1)
    editor.page.keyboard.up("w")
    after = camera(editor)
    assert after["position"][2] < before[2] - 0.1 and after["target"][2] < -0.1, "eye and target went forward"
    editor.page.click("#undo")
    assert camera(editor)["position"] == before, "a flight is one step of undo"


def test_pixels_under_the_glass(editor: Editor) -> None:
    editor.settled()
    editor.page.keyboard.press("Space")
    editor.page.keyboard.press("7")
    editor.page.mouse.move(*point(editor, 0.503, 0.503))  # not where two pixels meet
    editor.wait("the linear value", lambda: "…" not in editor.text("#probe"))
    lines = dict(zip(*[iter(editor.text("#probe").split("\n"))] * 2, strict=True))
    shown = [int(x) for x in lines["Display"].split()[:3]]
    linear = [float(x) for x in lines["Radiance"].split()[:3]]
    x, y = (int(part) for part in lines["Pixel"].split(","))
    assert shown == overlay(editor, "picture")[y, x, :3].tolist()
    assert linear[0] > 2 * linear[2] > 0, "the ball is red"
    for _ in range(12):
        editor.page.mouse.wheel(0, -400)
    zoom = editor.page.evaluate("new DOMMatrix(getComputedStyle(sheet).transform).a")
    assert zoom > 16 and editor.page.evaluate("sheet.classList.contains('pixels')")
    editor.page.keyboard.press("ArrowRight")
    assert f"{x + 1}, {y}" in editor.text("#probe")
    editor.page.keyboard.press("Escape")
    assert editor.page.evaluate("new DOMMatrix(getComputedStyle(sheet).transform).a") == 1


@pytest.mark.parametrize("layer", seldom(["normal", "depth", "material_id"], ["normal"]))
def test_layers_have_a_legend(editor: Editor, layer: str) -> None:
    before, samples = editor.settled(), editor.samples()
    editor.tab("view")
    editor.page.select_option("#layer", layer)
    editor.wait_for_change(before, 15)
    assert editor.samples() >= samples, "a layer costs no sample"
    legend = editor.text("#legend")
    if layer == "depth":
        near, far = (float(word) for word in legend.split() if word.replace(".", "").isdigit())
        assert 3.5 < near < far
    if layer == "material_id":
        assert {"Red paint", "Floor"} <= set(legend.split("\n"))
        colors = np.unique(overlay(editor, "picture").reshape(-1, 4), axis=0)
        assert len(colors) == 2, "two materials"
    editor.tab("view")
    editor.page.select_option("#layer", "color")
    editor.wait("the picture", lambda: editor.page.is_hidden("#legend") and not editor.differs(before, 8))


def test_histogram_and_clipping_follow_the_exposure(editor: Editor) -> None:
    editor.settled()
    editor.page.keyboard.press("h")
    editor.page.keyboard.press("x")
    editor.wait("a histogram", lambda: overlay(editor, "histogram")[..., 3].any())
    editor.tab("film")
    entry = editor.page.locator(editor.field("exposure", "number"))
    entry.fill("8")
    entry.press("Enter")

    def share(color: list[int]) -> float:
        return float((overlay(editor, "clipping")[..., :3] == color).all(axis=2).mean())

    editor.wait("white pixels", lambda: share([255, 60, 60]) > 0.5)
    clipped = re.search(r"Clipped ([\d.]+)\s%", editor.text("#clipped"))
    assert clipped and float(clipped[1]) == pytest.approx(100 * share([255, 60, 60]), abs=3), "told beside it"
    entry.fill("-20")
    entry.press("Enter")
    editor.wait("black pixels", lambda: share([60, 110, 255]) > 0.9)


def test_quality_has_a_price(editor: Editor) -> None:
    editor.settled()
    editor.tab("render")
    quality = editor.page.get_by_role("radiogroup", name="Quality")

    editor.wait("a forecast", lambda: "as measured on this scene" in editor.text("#output"))
    assert quality.get_by_role("radio").all_inner_texts()[0].startswith("Fast")
    # All at once: they change with each frame.
    prices = re.findall(r"(\w+)\n≈ ([\d.]+) (s|min|h)\n([\d.]+)", quality.inner_text())
    seconds = {name: float(about) * {"s": 1, "min": 60, "h": 3600}[unit] for name, about, unit, _ in prices}
    noise = {name: float(percent) for name, *_, percent in prices}
    assert seconds["Reference"] > 10 * seconds["Clean"] > 30 * seconds["Fast"] > 0
    assert noise["Reference"] < noise["Clean"] < noise["Fast"]
    assert quality.get_by_role("radio", name="Clean").is_checked(), "what holds where nothing is chosen"
    quality.get_by_role("radio", name="Fast").click()
    editor.wait("the end", lambda: editor.text("#state") == "Done" and editor.samples() == 64)
    entry = editor.page.locator("#settings-form [data-field=time_limit] input")
    entry.fill("1000")
    entry.press("Enter")
    editor.wait("more than the preset's samples", lambda: editor.samples() > 64)
    assert "/" not in editor.text("#samples")
    assert quality.get_by_role("radio", checked=True).count() == 0, "it is the time that ends it"
    assert "in at most 17 min" in editor.text("#output")
    quality.get_by_role("radio", name="Fast").click()
    assert entry.input_value() == "", "a word brings its samples"


def test_a_checker_stands_behind_transparency(editor: Editor) -> None:
    to_the_horizon(editor)
    editor.tab("scene")
    editor.page.click("#outline-list [data-thing='/environment']")
    editor.page.click("#thing-form [data-field=background] input")
    editor.wait("alpha", lambda: (overlay(editor, "picture")[..., 3] == 0).mean() > 0.02)
    assert "checker" in (editor.page.get_attribute("#stage", "class") or "")
    editor.page.keyboard.press("k")
    editor.wait("no alpha", lambda: (overlay(editor, "picture")[..., 3] == 255).all())


def test_alt_and_a_drag_turn_the_environment(editor: Editor) -> None:
    before = editor.settled()
    editor.page.keyboard.down("Alt")
    x, y = point(editor, 0.5, 0.5)
    editor.page.mouse.move(x, y)
    editor.page.mouse.down()
    editor.page.mouse.move(x + 200, y, steps=4)
    editor.page.mouse.up()
    editor.page.keyboard.up("Alt")
    editor.wait_for_change(before)
    editor.tab("scene")
    editor.page.click("#outline-list [data-thing='/environment']")
    assert abs(float(editor.page.input_value(editor.field("rotation", "number")))) > 20
