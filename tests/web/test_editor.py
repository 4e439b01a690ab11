"""The editor by what a user sees: each thing that a hand does changes the picture, or leaves it alone."""

from __future__ import annotations

import io
from collections.abc import Callable
from urllib.parse import urlsplit

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import BrowserContext

from tests.serving import Server
from tests.web.conftest import MortalServer
from tests.web.editing import keep_on, overlay
from tests.web.editor import Editor

STAGE = "#stage"


def middle(editor: Editor) -> tuple[float, float]:
    box = editor.page.locator(STAGE).bounding_box()
    assert box is not None
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def drag(editor: Editor, right: float, down: float, button: str = "left") -> None:
    x, y = middle(editor)
    mouse = editor.page.mouse
    mouse.move(x, y)
    mouse.down(button=button)  # type: ignore[arg-type]
    mouse.move(x + right, y + down, steps=5)
    mouse.up(button=button)  # type: ignore[arg-type]


def test_the_page_is_clean_and_stays_at_home(editor: Editor, server: Server) -> None:
    editor.settled()
    assert editor.complaints == []
    asked = [url for url in editor.requests if not url.startswith("blob:")]  # these are made here
    assert {urlsplit(url).netloc for url in asked} == {urlsplit(server.url).netloc}
    assert any(url.startswith("ws:") for url in editor.requests)
    assert np.std(editor.pixels()) > 2, "the canvas shows one flat colour"


def test_controls_come_from_the_schema(editor: Editor) -> None:
    schema = editor.page.request.get(editor.page.url + "v1/schema").json()
    disney = next(model for model in schema["scene"]["$defs"].values() if "clearcoat_gloss" in model["properties"])
    editor.page.select_option("#model", "disney")
    editor.page.wait_for_selector("#material-form [data-field=clearcoat_gloss]", state="attached")
    editor.page.wait_for_selector("#material-form [data-field=subsurface_radius]", state="detached")  # principled's
    editor.unfold()
    for name, field in disney["properties"].items():
        row = editor.page.locator(f"#material-form [data-field={name}]")
        assert row.count() == (name != "type"), name
        if name != "type":
            assert row.locator("label").inner_text().startswith(field["title"])
            assert row.locator("p.unseen").text_content() == field["description"]


def test_a_slider_changes_the_picture(editor: Editor) -> None:
    editor.page.select_option("#model", "disney")
    metallic = editor.page.locator(editor.field("metallic"))
    metallic.focus()
    metallic.press("Home")
    before = editor.settled()
    metallic.press("End")
    editor.wait_for_change(before)
    assert editor.page.input_value(editor.field("metallic", "number")) == "1"

    before = editor.settled()
    editor.page.click("#material-form [data-field=metallic] .reset")
    editor.wait_for_change(before)
    assert editor.page.input_value(editor.field("metallic", "number")) == "0"
    assert editor.page.is_hidden("#material-form [data-field=metallic] .reset")


def test_colours_pass_through_srgb(editor: Editor) -> None:
    before = editor.settled()
    text = editor.page.locator("#material-form [data-field] input[type=text]").first
    mode = editor.page.locator("#material-form .mode").first
    text.fill("#00ff80")
    text.press("Enter")
    editor.wait_for_change(before)
    mode.click()
    assert text.input_value() == "0 1 0.2159"  # ((128/255 + .055) / 1.055)^2.4
    text.fill("1 0 0.2158605")
    text.press("Enter")
    mode.click()
    assert text.input_value() == "#ff0080"


def test_what_follows_from_others_shows_no_value_of_its_own(editor: Editor) -> None:
    """Without an index of refraction `specular` sets it: 1.5 would be a lie, and could not be taken back."""
    page, before = editor.page, editor.settled()
    editor.unfold()
    index, reset = page.locator(editor.field("ior", "number")), page.locator("[data-field=ior] .reset")
    assert index.input_value() == "" and reset.is_hidden()
    assert page.locator(editor.field("sheen_color", "text")).input_value() == ""
    index.fill("2.5")
    index.press("Enter")
    editor.wait_for_change(before)
    reset.click()
    editor.wait("the first picture", lambda: not editor.differs(before, 6))
    assert index.input_value() == ""


@pytest.mark.parametrize(
    ("shelf", "choice"),
    [("scenes", "cornell"), ("library", None), pytest.param("environments", None, marks=pytest.mark.slow)],
)
def test_presets_change_the_picture(editor: Editor, shelf: str, choice: str | None) -> None:
    before = editor.settled()
    script = "all => all.map((each) => each.dataset.value)"
    values = editor.page.eval_on_selector_all(f"#{shelf} [role=option]", script)
    presets = [value for value in values if not value.startswith("saved ")]
    others = [value for value in presets if value not in (editor.chosen(shelf), "", "(none)")]
    assert len(others) > 1
    picked = next((value for value in others if choice and choice in value), others[0])
    editor.pick(shelf, picked)
    editor.wait("the mark", lambda: editor.chosen(shelf) == picked)
    editor.wait_for_change(before)
    assert editor.complaints == []


def test_the_camera_obeys_mouse_and_keys(editor: Editor) -> None:
    def press(key: str) -> None:
        for _ in range(4):
            editor.page.keyboard.press(key)

    moves: list[Callable[[], None]] = [
        lambda: drag(editor, 120, 40),  # orbit
        lambda: drag(editor, 60, 30, button="right"),  # pan
        lambda: editor.page.mouse.wheel(0, 400),  # zoom
        lambda: press("ArrowLeft"),
        lambda: press("Shift+ArrowUp"),
        lambda: press("+"),
    ]
    first = before = editor.settled()
    for move in moves:
        move()
        editor.wait_for_change(before)
        before = editor.settled()
    editor.page.keyboard.press("Home")
    editor.wait("the first view", lambda: not editor.differs(first))


def test_fingers_pinch_and_drag(visit: Callable[..., Editor]) -> None:
    editor = visit((390, 844), scale=1, touch=True)
    session = editor.page.context.new_cdp_session(editor.page)
    x, y = middle(editor)

    def touch(kind: str, *points: tuple[float, float]) -> None:
        touches = [{"x": px, "y": py, "id": i} for i, (px, py) in enumerate(points)]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": touches})

    before = editor.settled()
    touch("touchStart", (x, y))
    touch("touchMove", (x + 80, y + 10))
    touch("touchEnd")
    editor.wait_for_change(before)
    before = editor.settled()
    touch("touchStart", (x - 30, y), (x + 30, y))
    touch("touchMove", (x - 60, y), (x + 60, y))
    touch("touchEnd")
    editor.wait_for_change(before)


def test_exposure_keeps_the_samples_and_pause_stops_them(editor: Editor) -> None:
    before, samples = editor.settled(), editor.samples()
    editor.tab("film")
    entry = editor.page.locator(editor.field("exposure", "number"))
    entry.fill("-3")
    entry.press("Enter")
    editor.wait_for_change(before, 15)
    assert editor.samples() >= samples
    editor.page.select_option("#view-form select", "linear")
    keep_on(editor)
    editor.settled()
    editor.page.keyboard.press("Space")
    editor.wait("a pause", lambda: editor.text("#state") == "Paused")
    editor.rest("the last frame", editor.samples)
    samples = editor.samples()
    editor.page.click("#pause")
    editor.wait("more samples", lambda: editor.samples() > samples)
    assert editor.complaints == []


def test_what_is_typed_never_vanishes(editor: Editor) -> None:
    """Commas are decimals, fractions and shares are taken; what is no number stays and is refused in words."""
    entry = editor.page.locator(editor.field("roughness", "number"))
    for text, shown in {"0,35": "0.35", "1/4": "0.25", "50%": "0.5"}.items():
        entry.fill("")
        entry.press_sequentially(text)
        assert entry.input_value() == text
        entry.press("Enter")
        assert entry.input_value() == shown and editor.page.input_value(editor.field("roughness")) == shown
    entry.fill("half")
    entry.press("Enter")
    assert entry.input_value() == "half" and entry.get_attribute("aria-invalid") == "true"
    assert "0,5" in editor.text("[data-field=roughness] .trouble")
    entry.press("Escape")
    assert entry.input_value() == "0.5" and editor.page.is_hidden("[data-field=roughness] .trouble")
    entry.press("ArrowUp")
    entry.press("Shift+ArrowDown")
    assert entry.input_value() == "0.41", "a step up, ten down"
    editor.page.keyboard.press("Control+z")
    editor.page.keyboard.press("Control+z")
    assert entry.input_value() == "0.5", "each is undone by itself"


def test_a_refused_value_is_shown_where_it_was_written(editor: Editor) -> None:
    editor.page.select_option("#model", "disney")
    editor.settled()
    entry = editor.page.locator(editor.field("roughness", "number"))
    entry.fill("7")
    entry.press("Enter")
    editor.wait("the words", lambda: editor.page.is_visible("[data-field=roughness] .trouble"))
    assert editor.text("[data-field=roughness] .trouble") == "Must be at most 1, not 7."
    assert entry.get_attribute("aria-invalid") == "true"
    assert editor.text("#messages") == "", "said once"
    editor.wait("the last valid scene", lambda: editor.samples() > 4)
    before = editor.settled()
    entry.fill("0.05")
    entry.press("Enter")
    editor.wait_for_change(before, 2)
    assert editor.text("#messages") == ""
    assert entry.get_attribute("aria-invalid") is None


def test_undo_and_redo(editor: Editor) -> None:
    first = editor.settled()
    drag(editor, 150, 0)
    editor.wait_for_change(first)
    moved = editor.settled_alone()
    editor.page.keyboard.press("Control+z")
    editor.wait("the first view", lambda: not editor.differs(first))
    editor.settled()
    editor.page.keyboard.press("Control+Shift+z")
    editor.wait("the other view", lambda: not editor.differs(moved))


def test_the_download_is_the_rendered_picture(editor: Editor) -> None:
    editor.settled()
    editor.page.click("#export")
    with editor.page.expect_download() as waiting:
        editor.page.click("#download")
        if (now := editor.page.get_by_role("button", name="Save now")).is_visible():
            now.click()
    path = waiting.value.path()
    picture = Image.open(io.BytesIO(path.read_bytes()))
    picture.load()
    size = editor.page.evaluate("[picture.width, picture.height]")
    assert (picture.format, list(picture.size)) == ("PNG", size)
    assert waiting.value.suggested_filename.endswith(".png")
    shown = Image.fromarray(overlay(editor, "picture")[..., :3])
    small, canvas = [each.convert("RGB").resize((8, 8), Image.Resampling.BOX) for each in (picture, shown)]
    assert np.abs(np.asarray(small, float) - np.asarray(canvas, float)).mean() < 2


def test_a_lost_server_is_told_and_found_again(context: BrowserContext, mortal: MortalServer) -> None:
    editor = Editor(context.new_page())
    editor.open(mortal.url)
    first = editor.settled()
    drag(editor, 150, 0)
    editor.wait_for_change(first)
    editor.wait("few traces of the guess", lambda: editor.samples() >= 64)
    before = editor.settled()
    mortal.stop()
    try:
        editor.wait("the message", lambda: "connection" in editor.text("#messages"))
        assert editor.text("#state") == "Offline"
        assert not editor.differs(before), "the last picture stays in sight"
    finally:
        mortal.start()
    editor.wait("the connection", lambda: editor.text("#messages") == "")
    editor.wait("a fresh picture", lambda: editor.samples() >= 64)
    editor.settled()
    assert not editor.differs(before), "the view that was lost comes back"
