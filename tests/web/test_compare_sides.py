"""What can be compared beside two variants: snapshots, final renders, a photograph; by pixels, and by hand."""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from axe_playwright_python.sync_playwright import Axe
from PIL import Image
from playwright.sync_api import Locator, Page

from tests.serving import Server
from tests.web.editing import finish, overlay
from tests.web.editor import Editor
from tests.web.modules import call

LABELS = ".variant"


def side(editor: Editor, name: str) -> Locator:
    return editor.page.get_by_role("combobox", name=name, exact=True)


def choose(editor: Editor, name: str, kind: str) -> None:
    """For a side the first choice whose value begins so."""
    option = side(editor, name).locator(f"option[value^='{kind}']").first
    option.wait_for(state="attached")
    side(editor, name).select_option(value=str(option.get_attribute("value")))


def way(editor: Editor, title: str) -> None:
    side(editor, "Comparison").select_option(title)


def half(editor: Editor, name: str) -> np.ndarray:
    """(height, width, 3) of the canvas at the left or at the right."""
    selector = f".sheet canvas[data-half={name}]"
    editor.page.evaluate("(selector) => (document.querySelector(selector).id ||= 'tested')", selector)
    return overlay(editor, str(editor.page.get_attribute(selector, "id")))[..., :3].astype(float)


def coarse(image: np.ndarray) -> np.ndarray:
    """In 6 x 6 averages: too coarse for noise, and for what scaling does, to count."""
    small = Image.fromarray(np.round(image).astype(np.uint8)).resize((6, 6), Image.Resampling.BOX)
    return np.asarray(small, float)


def picture(colors: list[tuple[int, int, int]], size: tuple[int, int] = (90, 60)) -> bytes:
    """Upright stripes of these colours, as a PNG."""
    image = Image.new("RGB", size)
    for i, color in enumerate(colors):
        image.paste(color, (i * size[0] // len(colors), 0, size[0], size[1]))
    file = io.BytesIO()
    image.save(file, "PNG")
    return file.getvalue()


def encoded(linear: np.ndarray) -> np.ndarray:
    value = np.clip(linear, 0, 1)
    return 255 * np.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** (1 / 2.4) - 0.055)


def linear(values: np.ndarray) -> np.ndarray:
    value = values / 255
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def render(server: Server, width: int, height: int, label: str, samples: int = 16) -> str:
    """The id of a render of the scene that the tests open, once it is done."""
    scene = server.http.get("/v1/presets/scenes/sphere-on-floor").json()
    settings = {"width": width, "height": height, "max_samples": samples}
    order = {"scene": scene, "settings": settings, "label": label}
    id = str(server.http.post("/v1/renders", json=order).json()["id"])
    assert server.http.get(f"/v1/renders/{id}?wait=100").json()["state"] == "done"
    return id


def test_a_render_lies_on_the_picture_and_a_link_keeps_it(editor: Editor, server: Server) -> None:
    """It is wider than the picture on the page: what both show lies at the same place."""
    id = render(server, 240, 100, "The wide one")
    page = editor.page
    editor.settled()
    page.click("#tab-renders")
    page.click(f"#renders-drawer [data-id='{id}'] [aria-label='More for this render']")
    page.get_by_role("menuitem", name="Compare with the picture").click()
    labels = page.locator(LABELS)
    editor.wait("the render", lambda: "The wide one · 16 samples" in labels.all_text_contents())
    assert side(editor, "Left").input_value() == "a" and side(editor, "Right").input_value() == f"render {id}"
    assert page.is_hidden("#editing") and page.is_hidden("#comparison >> text=Discard B"), "B is not to be seen"
    editor.wait("its pixels", lambda: half(editor, "right").max() > 0)
    # Each half takes the size that it has beside the other as it is drawn.
    editor.wait("one size", lambda: half(editor, "left").shape == half(editor, "right").shape)
    editor.wait("both alike", lambda: np.abs(coarse(half(editor, "left")) - coarse(half(editor, "right"))).max() < 6)

    way(editor, "Difference")
    page.click("#share")
    editor.wait("the link", lambda: "#v=" in page.input_value(".command"))
    page.goto(page.input_value(".command"))
    page.reload()  # another fragment alone loads nothing
    editor.wait("the same", lambda: "against The wide one" in editor.text(".variant.b"))
    assert side(editor, "Right").input_value() == f"render {id}"

    server.http.delete(f"/v1/renders/{id}")
    page.reload()
    gone = "Render is not on the server any more"
    editor.wait("the words", lambda: page.get_by_role("status", name="Verdict").inner_text() == gone)
    assert not overlay(editor, "difference").any(), "nothing is shown for it"


def test_a_snapshot_is_compared_with_what_came_of_it(editor: Editor) -> None:
    page = editor.page
    finish(editor, 4)
    before = overlay(editor, "picture")[..., :3].astype(float)
    page.locator("#stage").press("n")
    editor.wait("it", lambda: "Snapshot taken" in (page.text_content("#announcer") or ""))
    page.click("#library [data-value=gold]")
    editor.compare()
    choose(editor, "Left", "snapshot")
    assert side(editor, "Right").input_value() == "b"
    choose(editor, "Right", "a")
    left = page.locator(".variant.a")
    editor.wait("its samples", lambda: "4 samples" in (left.text_content() or "") and editor.text("#state") == "Done")
    assert left.inner_text().startswith("Snapshot, ")
    assert np.array_equal(half(editor, "right"), overlay(editor, "picture")[..., :3])
    assert half(editor, "left").shape[1] > 0.8 * before.shape[1], "at the size of the page"
    was, became = coarse(half(editor, "left")), coarse(half(editor, "right"))
    assert 3 * np.abs(coarse(before) - was).mean() < np.abs(became - was).mean(), "as it was, and not of gold"

    way(editor, "Difference")
    page.select_option("#comparison [aria-label^='How much']", "2")
    side(editor, "Sign of the difference").select_option("Signed")
    step = 2 * (half(editor, "right") - half(editor, "left"))
    wanted, reverse = np.clip(128 + step, 0, 255), np.clip(128 - step, 0, 255)
    editor.wait("its picture", lambda: np.array_equal(overlay(editor, "difference")[..., :3], wanted))
    choose(editor, "Left", "a")  # which is at the right
    assert side(editor, "Right").input_value().startswith("snapshot"), "they changed places"
    editor.wait("the other sign", lambda: np.array_equal(overlay(editor, "difference")[..., :3], reverse))


def test_a_photograph_is_fitted_by_hand_in_linear_light(editor: Editor) -> None:
    page = editor.page
    editor.settled()
    editor.compare()
    side(editor, "Right").select_option("Photograph…")
    awaited = "Photograph is not chosen yet"
    editor.wait("a place for it", lambda: page.get_by_role("status", name="Verdict").inner_text() == awaited)
    stripes = [(200, 40, 40), (90, 90, 90), (20, 60, 180)]
    with page.expect_file_chooser() as waiting:
        page.get_by_role("button", name="Choose a photograph…").press("Enter")
    waiting.value.set_files({"name": "shot.png", "mimeType": "image/png", "buffer": picture(stripes)})
    editor.wait("the photograph", lambda: "shot.png" in editor.text(".variant.b"))

    def middles() -> np.ndarray:
        """Of the stripes, left to right; the photograph fills the frame."""
        image = half(editor, "right")
        height, width = image.shape[:2]
        return np.asarray([image[height // 2, width // 2 + offset] for offset in (-width // 3, 0, width // 3)])

    editor.wait("its pixels", lambda: np.abs(middles() - stripes).max() <= 1)
    slider = page.get_by_role("slider", name="Photograph: exposure")
    slider.fill("1")
    editor.wait("a stop more", lambda: np.abs(middles() - encoded(2 * linear(np.asarray(stripes)))).max() <= 1)
    slider.fill("0")
    page.get_by_role("slider", name="Photograph: temperature").press("End")
    page.get_by_role("slider", name="Photograph: tint").press("End")
    editor.wait("another balance", lambda: middles()[1][0] > middles()[1][2] + 20)
    warm = linear(middles()[1])
    assert warm @ [0.2126, 0.7152, 0.0722] == pytest.approx(linear(np.asarray(90.0)), rel=0.02), "as bright as before"
    assert np.log2(warm[0] / warm[2]) == pytest.approx(2, abs=0.1), "as many stops as it says"
    assert np.log2(np.sqrt(warm[0] * warm[2]) / warm[1]) == pytest.approx(1, abs=0.1)
    page.get_by_role("button", name="Neutral").click()
    editor.wait("as it is", lambda: np.abs(middles() - stripes).max() <= 1)
    for title in ("FLIP", "Verdict"):
        assert side(editor, "Comparison").locator("option", has_text=title).is_disabled()
    assert page.get_by_text("no verdict and no FLIP").is_visible(), "and why"

    editor.drop("#stage", {"other.png": picture([(0, 255, 0)])})
    editor.wait("the other", lambda: "other.png" in editor.text(".variant.b"))
    assert page.locator("#messages").inner_text() == "", "no texture came of it"
    editor.drop("#comparison", {"broken.png": b"no picture"})
    editor.wait("the refusal", lambda: "The file broken.png could not be read" in editor.text("#messages"))
    assert "other.png" in editor.text(".variant.b"), "what was there stays"

    page.click("#share")
    editor.wait("the link", lambda: "#v=" in page.input_value(".command"))
    link = page.input_value(".command")
    page.goto("about:blank")
    page.goto(link)
    editor.wait("both", lambda: editor.text(".variant.b").startswith("B · "))


@pytest.mark.parametrize(
    ("size", "more"),
    [
        pytest.param((1280, 800), {"color_scheme": "light"}, marks=pytest.mark.slow),
        ((390, 844), {"touch": True}),
        ((1024, 768), {"forced_colors": "active"}),
    ],
)
def test_everybody_can_compare(visit: Callable[..., Editor], size: tuple[int, int], more: dict[str, Any]) -> None:
    editor = visit(size, scale=1, **more)
    page = editor.page
    editor.settled()
    bar = page.locator("#comparison")
    page.locator("#compare").press("Enter")
    for sort, right in (("Difference", "b"), ("Swipe", "photo")):
        side(editor, "Comparison").focus()
        way(editor, sort)
        side(editor, "Right").select_option(right)
        controls = bar.locator("button:visible, select:visible, input:visible:enabled, [role=radio]:visible")
        # A group of choices is one stop of the Tab key.
        stops = controls.evaluate_all("all => all.filter((each) => each.tabIndex >= 0).length")
        side(editor, "Left").focus()
        for _ in range(stops - 1):
            page.keyboard.press("Tab")
        assert page.evaluate("document.activeElement.closest('#comparison') !== null"), "all are reached by Tab"
        page.keyboard.press("Tab")
        assert page.evaluate("document.activeElement.closest('#comparison') === null")
        response = Axe().run(page, context="#comparison").response
        assert [each["id"] for each in response["violations"]] == []
        box, stage = bar.bounding_box(), page.locator("#stage").bounding_box()
        assert box is not None and stage is not None and box["x"] + box["width"] <= size[0]
        assert stage["height"] > box["height"], "the picture has more room than the bar"
        assert page.get_by_role("button", name="Done").bounding_box()["x"] < size[0] - 30, "the way out is in sight"  # type: ignore[index]
    assert editor.complaints == []


def verdict(editor: Editor) -> str:
    return editor.page.get_by_role("status", name="Verdict").inner_text()


def test_the_server_says_whether_two_differ(editor: Editor, server: Server) -> None:
    page = editor.page
    finish(editor, 16)
    editor.compare()
    way(editor, "Verdict")
    editor.wait("the verdict on a copy", lambda: verdict(editor).startswith("They look the same"))
    assert not overlay(editor, "difference").any(), "the pictures are to be seen"
    page.select_option("#comparison select[aria-label^=Turn]", "diffuse")
    editor.wait("another B", lambda: verdict(editor).startswith("Changed"))
    editor.wait("the verdict, which nobody asked for", lambda: verdict(editor).startswith("They look different: "))
    said = page.get_by_role("status", name="Verdict")
    assert "p = " not in verdict(editor) and "p = " in (said.get_attribute("title") or "")
    assert said.get_attribute("aria-live") == "polite"
    assert said.locator(".scale").inner_text() == "almost certaincertain", "the colours are explained"
    page.get_by_role("button", name="Ask again").press("Enter")
    assert verdict(editor).startswith("Comparing") and said.get_by_role("progressbar").count() == 1
    editor.wait("the verdict again", lambda: verdict(editor).startswith("They look different: "))
    drawn = overlay(editor, "difference")
    height, width = drawn.shape[:2]
    ball = drawn[height // 3 : -height // 3, width // 3 : -width // 3, 3]
    assert (ball > 0).mean() > 0.2, "the ball is under a veil"
    assert drawn[..., 3].max() < 255, "through which it is seen"
    way(editor, "FLIP")
    editor.wait("the map", lambda: re.match(r"FLIP 0\.\d", verdict(editor)))
    assert overlay(editor, "difference")[..., :3].max() > 100
    assert [each for each in editor.complaints if "getImageData" not in each] == [], "but what this test reads"

    # A render is compared at its own size.
    id = render(server, 48, 32, "The small one")
    page.reload()
    asked: list[Any] = []
    page.on("request", lambda each: asked.append(each.post_data_json) if "/v1/compare?" in each.url else None)
    way(editor, "Verdict")
    choose(editor, "Right", f"render {id}")
    editor.wait("the verdict on it", lambda: asked and verdict(editor).startswith("They look"))
    assert asked[-1]["b"] == id
    assert (asked[-1]["a"]["settings"]["width"], asked[-1]["a"]["settings"]["height"]) == (48, 32)


def test_who_edits_or_leaves_ends_the_comparison(editor: Editor) -> None:
    page = editor.page
    editor.settled()
    editor.compare()
    held: list[Any] = []
    ended: list[str] = []
    page.route("**/v1/compare*", lambda route: held.append(route))
    page.on("requestfailed", lambda each: ended.append(each.url) if "/compare?" in each.url else None)
    way(editor, "Verdict")
    editor.wait("the question", lambda: len(held) == 1)
    assert verdict(editor).startswith("Comparing")
    page.select_option("#comparison select[aria-label^=Turn]", "diffuse")
    editor.wait("its end", lambda: len(ended) == 1)
    assert verdict(editor).startswith("Changed") and len(held) == 1, "the edit has to rest"
    editor.wait("the next, which nobody asked for", lambda: len(held) == 2)
    page.get_by_role("button", name="Stop").click()
    editor.wait("its end", lambda: len(ended) == 2 and verdict(editor) == "Stopped")
    way(editor, "FLIP")
    editor.wait("another question", lambda: len(held) == 3)
    page.click("#comparison >> text=Done")
    editor.wait("its end", lambda: len(ended) == 3)


def test_a_verdict_in_words(page: Page) -> None:
    def words(p_value: float, *boxes: tuple[int, int, int, int], difference: float = 0.042) -> Any:
        known = np.zeros((30, 60, 4), int)
        for x, y, width, height in boxes:
            known[y : y + height, x : x + width, :3] = 90
        differing = {"share": (known[..., 0] > 0).mean(), "difference": difference}
        answer = {"different": p_value < 1e-3, "p_value": p_value, "differing": differing}
        image = {"data": known.ravel().tolist(), "width": 60, "height": 30}
        place = call(page, "compare/verdict.js", "placeOf", image)
        return call(page, "compare/verdict.js", "verdictWords", answer, place)

    assert words(0.4) == "They look the same"
    certain = "They look different: certain."
    assert words(2e-8, (0, 0, 15, 6)) == f"{certain} Most at the upper left, 4 % there."
    assert words(2e-8, (4, 24, 40, 4)) == f"{certain} Most at the bottom, 4 % there."
    assert words(2e-8, (45, 1, 12, 27)) == f"{certain} Most at the right, 4 % there."
    assert words(2e-8, (22, 11, 15, 8), difference=0.002) == f"{certain} Most in the middle, less than 1 % there."
    assert words(2e-8, (0, 0, 12, 6), (48, 24, 12, 6)) == f"{certain} In several places, by 4 %."
    assert words(1e-300, (0, 0, 60, 28)) == f"{certain} Nearly everywhere, by 4 %."
    assert words(2e-5) == "They look different: almost certain.", "as a whole"
    said = call(page, "compare/verdict.js", "progressWords", {"samples": 64, "max_samples": 256}, 10)
    assert said == "64 of at most 256 samples, 30 s left at most"
