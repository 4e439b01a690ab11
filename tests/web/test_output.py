"""Final pictures: their size and quality, and the renders that the server has of them."""

from __future__ import annotations

import io
import json
import re
from collections.abc import Callable
from typing import Any

import pytest
from PIL import Image
from playwright.sync_api import Download, Locator, Page, Route, WebSocketRoute

from service.formats.images import read_metadata
from tests.serving import Server
from tests.web.editor import Editor

SIDES = ("Width", "Height")


def write(editor: Editor, side: str, value: int) -> None:
    entry = editor.page.get_by_role("spinbutton", name=side)
    entry.fill(str(value))
    entry.press("Enter")


def size(editor: Editor) -> list[int]:
    return [int(editor.page.get_by_role("spinbutton", name=side).input_value()) for side in SIDES]


def renders(editor: Editor) -> Locator:
    """Those listed, the newest first."""
    return editor.page.get_by_role("list", name="Renders").get_by_role("listitem")


def order(editor: Editor, samples: int, width: int = 64, height: int = 48) -> Locator:
    """Have a picture rendered from the header: its item in the list."""
    editor.tab("render")
    entry = editor.page.locator("#settings-form [data-field=max_samples] input")
    entry.fill(str(samples))
    entry.press("Enter")
    write(editor, "Width", width)
    write(editor, "Height", height)
    before = editor.page.locator("#renders-sheet .render").count()
    editor.page.get_by_role("button", name=f"Render {width}×{height}").click()
    editor.wait("its item", lambda: renders(editor).count() > before)
    return renders(editor).first


def expose(editor: Editor, stops: float) -> None:
    editor.tab("film")
    entry = editor.page.locator("#view-form [data-field=exposure] input.number")
    entry.fill(str(stops))
    entry.press("Enter")


def is_done(item: Locator) -> Callable[[], bool]:
    return lambda: item.get_attribute("data-state") == "done"


def download(editor: Editor, item: Locator, button: str) -> tuple[str, bytes]:
    with editor.page.expect_download() as waiting:
        item.get_by_role("button", name=button).click()
    return waiting.value.suggested_filename, waiting.value.path().read_bytes()


def drawn(page: Page) -> float:
    """Width by height of the final frame's line over the picture."""
    frame = page.locator(".framing .final").bounding_box()
    assert frame is not None
    return frame["width"] / frame["height"]


def plain(text: str) -> str:
    return text.replace("\u202f", " ").replace("\u00a0", " ")


def test_a_picture_is_rendered_in_any_size_and_saved(editor: Editor) -> None:
    page = editor.page
    editor.tab("render")
    assert size(editor) == [1920, 1080], "unless somebody says otherwise"
    ratio = "picture.width / picture.height"
    editor.wait("what will be in it", lambda: page.evaluate(ratio) == pytest.approx(16 / 9, 0.02))
    stage_ratio = page.evaluate("stage.clientWidth / stage.clientHeight")
    picker = page.get_by_label("Size", exact=True)
    picker.select_option("As the window")
    editor.wait("its size", lambda: size(editor) == page.evaluate("[picture.width, picture.height]"))
    assert page.evaluate(ratio) == pytest.approx(stage_ratio, 0.02) and drawn(page) == pytest.approx(
        stage_ratio, 0.02
    )
    picker.select_option("HD, 1920 × 1080".replace(" × ", "\u202f×\u202f"))
    assert page.get_by_role("button", name="Render 1920×1080", exact=True).is_visible()
    assert "1920 × 1080, Clean in about" in plain(str(page.get_attribute("#render", "title")))
    picker.select_option("Shape 2 : 3")
    write(editor, "Width", 64)
    assert size(editor) == [64, 96], "the shape stays"
    assert drawn(page) == pytest.approx(2 / 3, 0.02)
    editor.wait("a picture around it", lambda: page.evaluate(ratio) == pytest.approx(stage_ratio, 0.02))
    picker.select_option("Custom")
    item = order(editor, 1)
    editor.wait("the end", is_done(item))
    assert item.get_by_role("progressbar").get_attribute("value") == "1"
    assert item.get_attribute("aria-label") == "Sphere on a floor"
    editor.wait("its picture", lambda: item.locator("img.painted").count() == 1)
    assert re.search(r"Done\s*64 × 48 · 1 sample · .* s", plain(item.inner_text()))
    name, png = download(editor, item, "Download PNG")
    made = read_metadata(png)
    assert Image.open(io.BytesIO(png)).size == (64, 48) and made is not None and made["samples"] == 1
    assert name == "Sphere-on-a-floor-64x48-1.png"
    item.get_by_role("button", name="More for this render").click()
    with page.expect_download() as waiting:
        page.get_by_role("menuitem", name="WebP").click()
    assert Image.open(waiting.value.path()).format == "WEBP" and waiting.value.suggested_filename.endswith("-1.webp")
    item.get_by_role("button", name="More for this render").click()
    with page.expect_download() as waiting:
        page.get_by_role("menuitem", name="EXR with mattes").click()
    assert b"CryptoMaterial00" in waiting.value.path().read_bytes()
    page.get_by_role("tab", name="Renders").click()
    assert renders(editor).count() == page.locator("#renders-sheet .render").count(), "here now, and in one place"
    name, exr = download(editor, renders(editor).first, "Download EXR")
    assert name == "Sphere-on-a-floor-64x48-1.exr" and b"normal.X" in exr


def test_a_render_goes_on_without_the_page_and_is_stopped_and_deleted(editor: Editor, server: Server) -> None:
    page = editor.page
    item = order(editor, 100_000, width=96)
    share = item.get_by_role("progressbar")
    editor.wait("samples", lambda: "Rendering" in item.inner_text() and item.locator("img.painted").count())
    id = item.get_attribute("data-id")
    page.goto("about:blank")
    editor.open(server.url)
    page.get_by_role("tab", name="Renders").click()
    item = page.get_by_role("list", name="Renders").locator(f"[data-id='{id}']")
    editor.wait("the render that went on", lambda: item.count() and "Rendering" in item.inner_text())
    shown = [float(share.get_attribute("value") or 0)]
    before = item.inner_text()
    editor.wait("news", lambda: item.inner_text() != before)
    assert float(item.get_by_role("progressbar").get_attribute("value") or 0) >= shown[0]
    item.get_by_role("button", name="Stop").press("Enter")
    editor.wait("the end", lambda: "Stopped at" in item.inner_text())
    focused = "document.activeElement.getAttribute('aria-label')"
    assert page.evaluate(focused) == "Delete", "the focus does not get lost"
    page.keyboard.press("Enter")
    assert item.count() == 0
    page.get_by_role("button", name="Bring back").click()
    editor.wait("it again", lambda: item.count() == 1)
    item.get_by_role("button", name="Delete").click()
    editor.wait("that it is deleted", lambda: server.http.get(f"/v1/renders/{id}").status_code == 410)
    assert item.count() == 0


def test_a_render_that_is_refused_says_why_at_its_field(editor: Editor) -> None:
    editor.tab("render")
    write(editor, "Width", 10**8)
    editor.page.keyboard.press("Control+Enter")
    editor.wait("the refusal", lambda: editor.page.locator("#output .trouble:visible").count() > 0)
    assert editor.text("#messages") == "", "said once"
    assert editor.page.get_by_role("button", name="Render picture").is_enabled()


def test_a_file_in_the_making_says_so_and_blocks_nothing(editor: Editor) -> None:
    page = editor.page
    expose(editor, -2)
    with page.expect_response(re.compile(r"format=exr")) as made:  # before anybody asks for it
        item = order(editor, 2)
        editor.wait("the end", is_done(item))
    assert made.value.ok
    expose(editor, 1)
    editor.tab("render")
    recipe = read_metadata(download(editor, item, "Download PNG")[1])
    assert recipe is not None and recipe["view"]["exposure"] == -2, "as it was seen when it was asked for"
    held: list[Any] = []
    page.route(re.compile(r"format=exr"), lambda route: held.append(route))
    with page.expect_download() as waiting:
        item.get_by_role("button", name="Download EXR").click()
        editor.wait("the words", lambda: "layers of the EXR" in item.inner_text() and "so far" in item.inner_text())
        assert item.get_by_role("button", name="Download EXR").get_attribute("aria-busy") == "true"
        item.get_by_role("button", name="Download EXR").click()  # which is being made
        assert len(held) == 1
        held[0].continue_()
    assert waiting.value.suggested_filename.endswith(".exr")
    editor.wait("silence", lambda: "EXR," not in item.inner_text())


def test_a_render_is_opened_and_its_scene_again(editor: Editor) -> None:
    page = editor.page
    editor.pick("scenes", "point-lights")
    editor.wait("the scene", lambda: editor.text("#scene-title") == "Two point lights")
    item = order(editor, 2)
    editor.wait("the end", is_done(item))
    editor.pick("scenes", "sphere-on-floor")
    item.get_by_role("button", name="Open").press("Enter")
    window = page.get_by_role("dialog", name="Two point lights")
    image = window.get_by_role("img")
    editor.wait("its picture", lambda: image.is_visible() and image.evaluate("(image) => image.naturalWidth") == 64)
    page.keyboard.press("Escape")
    assert window.count() == 0 and page.evaluate("document.activeElement.getAttribute('aria-label')") == "Open"
    item.get_by_role("button", name="Open").click()
    window.get_by_role("button", name="Edit its scene").click()
    editor.wait("its scene", lambda: editor.text("#scene-title") == "Two point lights")
    assert size(editor) == [64, 48]


class Noise:
    """A stream whose pictures say that they are noisy while `is_on`, however far the renderer is."""

    def __init__(self, page: Page) -> None:
        self.is_on = True
        page.route_web_socket("**/v1/stream**", self._pass_on)

    def _pass_on(self, route: WebSocketRoute) -> None:
        def hear(message: str | bytes) -> None:
            if self.is_on and isinstance(message, bytes):
                end = 4 + int.from_bytes(message[:4], "little")
                header = json.dumps(json.loads(message[4:end]) | {"noise": 0.5}).encode()
                message = len(header).to_bytes(4, "little") + header + message[end:]
            route.send(message)

        route.connect_to_server().on_message(hear)


def samples_of(saved: Download) -> int:
    return int(saved.suggested_filename.split("-")[-1].removesuffix(".png"))


def test_a_noisy_picture_is_saved_now_or_when_it_is_clean(blank: Editor, server: Server) -> None:
    editor, page = blank, blank.page
    noise = Noise(page)
    editor.open(server.url)
    editor.tab("render")
    entry = page.locator("#settings-form [data-field=max_samples] input")
    asked = page.get_by_role("dialog", name="noise: save now or when clean?")

    def write_samples(count: int) -> None:
        entry.fill(str(count))
        entry.press("Enter")
        page.evaluate("document.activeElement.blur()")  # where letters would be typed

    write_samples(100_000)
    editor.wait("samples", lambda: editor.text("#state") == "Converging")
    page.keyboard.press("p")
    asked.get_by_role("button", name="When clean").click()
    waits = "The PNG is saved when the picture is clean."
    editor.wait("the words", lambda: waits in editor.text("#messages"))
    page.get_by_role("button", name="Cancel").click()
    editor.wait("silence", lambda: waits not in editor.text("#messages"))
    page.keyboard.press("p")
    asked.get_by_role("button", name="When clean").click()
    write_samples(2)
    editor.wait("the words", lambda: "has changed" in editor.text("#messages"))
    editor.wait("the end", lambda: editor.text("#state") == "Done")
    with page.expect_download() as waiting:
        page.keyboard.press("p")  # of what gets no cleaner nobody is asked
    assert re.fullmatch(r"Sphere-on-a-floor-\d+x\d+-\d+.png", waiting.value.suggested_filename)
    few = samples_of(waiting.value)  # two, or more where there were more by then
    write_samples(100_000)
    editor.wait("a picture that is not done", lambda: editor.samples() > few)
    page.keyboard.press("p")
    with page.expect_download() as waiting:
        asked.get_by_role("button", name="When clean").click()
        noise.is_on = False
    assert samples_of(waiting.value) > few


def test_a_table_of_colours_is_dropped_saved_and_removed(editor: Editor) -> None:
    page = editor.page
    before = editor.settled()
    inverted = "LUT_1D_SIZE 2\n1 1 1\n0 0 0\n"
    editor.drop("#stage", {"Inverted.cube": inverted.encode()})
    editor.wait_for_change(before, 40.0)
    editor.tab("film")
    chip = page.get_by_role("button", name="Another colour table")
    assert chip.inner_text() == "Inverted.cube"
    made = read_metadata(editor.shot("#download"))
    assert made is not None and made["view"]["lut"].startswith("sha256:")
    page.get_by_role("button", name="Remove the colour table").click()
    editor.wait("the picture of before", lambda: not editor.differs(before, 20.0))
    assert page.evaluate("document.activeElement.ariaLabel") == "Choose a colour table"
    page.keyboard.press("Control+z")
    editor.wait("the table again", chip.is_visible)
    editor.drop("#stage", {"Broken.cube": b"LUT_1D_SIZE 2\n1 1\n"})
    editor.wait("a word about it", lambda: "Broken.cube could not be used" in page.inner_text("#messages"))
    assert chip.inner_text() == "Inverted.cube", "the last good one stays"


def test_the_first_press_shows_the_frame_and_the_second_one_renders(editor: Editor) -> None:
    """And what is seen of the scene stays as it is; a double click is the first press alone."""
    page = editor.page
    editor.settled()
    size = page.evaluate("[picture.width, picture.height]")
    samples, sent = editor.samples(), list[Route]()
    page.route(
        "**/v1/renders", lambda route: sent.append(route) if route.request.method == "POST" else route.continue_()
    )
    head = page.locator("#render")
    bright = """() => [...document.querySelectorAll(".button.primary")].filter((each) => each.checkVisibility()
        && getComputedStyle(each).backgroundColor === "rgb(255, 182, 39)").map((each) => each.textContent)"""
    assert [text.split()[0] for text in page.evaluate(bright)] == ["Render"]
    head.dblclick()
    sheet = page.get_by_role("button", name="Render picture")
    editor.wait("the hand on its button", lambda: sheet.evaluate("(each) => each === document.activeElement"))
    assert page.evaluate(bright) == ["Render picture"], "one at a time"
    assert sheet.get_attribute("aria-describedby") and page.is_visible("#output .quality .price")
    editor.wait("samples", lambda: editor.samples() > samples)  # of the same picture: nothing has begun anew
    assert page.evaluate("[picture.width, picture.height]") == size and not sent
    page.keyboard.press("Enter")
    editor.wait("the render", lambda: len(sent) == 1)


def test_a_button_that_is_pressed_twice_renders_once(editor: Editor) -> None:
    """Both times before the server has answered."""
    editor.wait("the end", is_done(order(editor, 1)))
    before, sent = renders(editor).count(), list[Route]()
    editor.page.route("**/v1/renders", lambda request: sent.append(request))
    button = editor.page.get_by_role("button", name="Render 64×48")
    button.click()
    editor.wait("the request", lambda: sent)
    button.evaluate("(button) => button.click()")
    editor.page.locator("#output").get_by_role("button", name="Render picture").evaluate("(button) => button.click()")
    editor.rest("what follows", lambda: len(sent))
    for request in sent:
        request.continue_()
    editor.wait("its item", lambda: renders(editor).count() > before and button.is_enabled())
    assert len(sent) == 1
