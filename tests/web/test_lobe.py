"""The panel of the lobe on the real server: what it draws, says and hands out."""

from __future__ import annotations

import csv
import io
import json
import math
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from OpenImageIO import ImageOutput, ImageSpec
from PIL import Image
from playwright.sync_api import Browser, Route

from tests.serving import Server
from tests.web.conftest import COARSE, WINDOW
from tests.web.editing import halves
from tests.web.editor import Editor

PASTE = "(text) => { navigator.clipboard.readText = async () => text; }"
ANGLE = "#lobe input[type=range]"
IS_DONE = "document.getElementById('lobe').getAttribute('aria-busy') === 'false'"


def paste(editor: Editor, material: dict[str, Any]) -> None:
    editor.page.evaluate(PASTE, json.dumps(material))
    editor.act("paste-material")
    editor.wait("the model", lambda: editor.page.input_value("#model") == material["type"])


def view(editor: Editor, name: str) -> None:
    """Chooses a view, and waits for its first curve."""
    editor.page.click(f"#lobe [data-value={name}]")
    plotted(editor)


def plotted(editor: Editor) -> None:
    editor.page.wait_for_timeout(50)
    editor.wait("the plot", lambda: editor.page.evaluate(IS_DONE))


def table(editor: Editor) -> list[dict[str, float]]:
    rows = csv.DictReader(io.StringIO(editor.shot("#lobe >> text=Save CSV").decode()))
    return [{name: float(value) for name, value in row.items()} for row in rows]


@pytest.fixture(scope="module")
def opened(browser: Browser, server: Server) -> Iterator[Editor]:
    """The editor with a pause in its picture and the panel open, for all tests of this file."""
    context = browser.new_context(viewport=WINDOW, device_scale_factor=COARSE)
    editor = Editor(context.new_page())
    editor.open(server.url)
    editor.page.click("#pause")
    editor.page.click("#show-lobe")
    plotted(editor)
    assert editor.page.input_value(ANGLE) == "45"
    yield editor
    context.close()


@pytest.fixture
def lobe(opened: Editor) -> Editor:
    """The panel with the polar view of a new material, lit from 45 degrees, whatever the test before did."""
    page = opened.page
    page.unroute_all(behavior="ignoreErrors")
    if page.is_visible("#comparison"):
        if page.is_hidden("#comparison >> text=Discard B"):
            page.click("#comparison .more-of-it")
        page.click("#comparison >> text=Discard B")
    paste(opened, {"type": "principled", "base_color": [0.8, 0.3, 0.2], "roughness": 0.3})
    page.click("#lobe [data-value=polar]")
    page.fill(ANGLE, "45")
    plotted(opened)
    opened.complaints.clear()
    return opened


def test_a_diffuse_lobe_is_a_half_circle_of_albedo_over_pi(lobe: Editor) -> None:
    paste(lobe, {"type": "diffuse", "albedo": [0.8, 0.4, 0.2]})
    plotted(lobe)
    rows = table(lobe)
    assert len(rows) > 90 and all(abs(row["theta_deg"]) < 90 for row in rows), "nothing goes through"
    for row in rows:
        assert [row[f"f_{c}"] for c in "rgb"] == pytest.approx([x / math.pi for x in (0.8, 0.4, 0.2)], rel=1e-5)
    assert "largest value 0.15 per steradian" in lobe.page.get_attribute("#lobe svg", "aria-label")  # type: ignore[operator]
    assert lobe.complaints == []


def test_the_curve_follows_the_slider(lobe: Editor) -> None:
    page = lobe.page
    paste(lobe, {"type": "principled", "roughness": 0.2})
    plotted(lobe)
    before = page.get_attribute("#lobe .curve", "d")
    page.fill(lobe.field("roughness", "number"), "0.6")
    page.press(lobe.field("roughness", "number"), "Enter")
    plotted(lobe)
    after = page.get_attribute("#lobe .curve", "d")
    assert after != before
    page.keyboard.press("Control+z")
    plotted(lobe)
    lobe.wait("the first curve again", lambda: page.get_attribute("#lobe .curve", "d") == before)


def test_a_narrow_lobe_is_refined(lobe: Editor) -> None:
    paste(lobe, {"type": "metal_rough", "base_color": 0.8, "metallic": 1, "roughness": 0.08})
    plotted(lobe)
    first = len(table(lobe))
    lobe.wait("more of it", lambda: len(table(lobe)) > first + 10)


def test_hand_and_keys_turn_the_light(lobe: Editor) -> None:
    page = lobe.page
    box = page.locator(".lobe-plot").bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + box["width"] / 2 + 2, box["y"] + 8)
    page.mouse.down()
    assert float(page.input_value(ANGLE)) < 5, "the light comes from where the hand is"
    page.mouse.move(box["x"] + 20, box["y"] + 0.8 * box["height"], steps=3)
    page.mouse.up()
    assert float(page.input_value(ANGLE)) > 60
    at = float(page.input_value(ANGLE))
    page.focus(".lobe-plot")
    page.keyboard.press("ArrowLeft")
    assert float(page.input_value(ANGLE)) == at - 1
    page.fill(ANGLE, "30")
    plotted(lobe)
    assert "for light from 30 degrees" in (page.get_attribute("#lobe svg", "aria-label") or "")
    view(lobe, "solid")
    before = page.get_attribute("#lobe .mesh path", "d")
    page.focus(".lobe-plot")
    page.keyboard.press("ArrowUp")
    assert page.get_attribute("#lobe .mesh path", "d") != before, "the solid turns"


def test_the_mouse_reads_the_curve(lobe: Editor) -> None:
    page = lobe.page
    paste(lobe, {"type": "diffuse", "albedo": 0.5})
    plotted(lobe)
    box = page.locator(".lobe-plot").bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + 20)
    lobe.wait("the reading", lambda: lobe.text(".lobe-reading") == "0°: 0.159 1/sr")
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] - 40)
    lobe.wait("its end", lambda: page.is_hidden(".lobe-reading"))


def test_glass_is_seen_on_both_sides(lobe: Editor) -> None:
    page = lobe.page
    paste(lobe, {"type": "principled", "transmission": 1, "roughness": 0, "ior": 1.5, "base_color": 1})
    plotted(lobe)
    said = page.locator("#lobe text.delta").all_text_contents()
    shares = sorted(float(re.sub(r"[^\d.]", "", each)) for each in said)
    cosine = math.sqrt(1 - (math.sin(math.pi / 4) / 1.5) ** 2)
    s = (math.cos(math.pi / 4) - 1.5 * cosine) / (math.cos(math.pi / 4) + 1.5 * cosine)
    p = (1.5 * math.cos(math.pi / 4) - cosine) / (1.5 * math.cos(math.pi / 4) + cosine)
    reflected = 100 * (s * s + p * p) / 2
    assert shares == pytest.approx([reflected, 100 - reflected], rel=0.06), "Fresnel's, in two digits"
    assert page.get_attribute("#lobe input[type=range]", "max") == "180", "the light may come from inside"
    page.fill("#lobe input[type=range]", "90")
    assert page.input_value("#lobe input[type=range]") == "90.5", "no light comes along the surface"
    plotted(lobe)
    page.fill("#lobe input[type=range]", "120")
    plotted(lobe)
    shares = page.locator("#lobe text.delta").all_text_contents()
    assert len(shares) == 1 and shares[0].startswith("100"), "total reflection inside, beyond 41.8 degrees"
    page.fill("#lobe input[type=range]", "45")
    paste(lobe, {"type": "principled", "transmission": 1, "roughness": 0.3})
    plotted(lobe)
    assert any(abs(row["theta_deg"]) > 90 and row["f_g"] > 0 for row in table(lobe))


@pytest.mark.slow
def test_both_variants_are_drawn_over_each_other(lobe: Editor) -> None:
    page = lobe.page
    paste(lobe, {"type": "principled", "roughness": 0.3})
    lobe.compare()
    page.select_option("#comparison select[aria-label^=Turn]", "disney")
    page.click("#comparison .more-of-it")  # which lies over the lobe's views
    plotted(lobe)
    assert page.is_hidden("#comparison .metric"), "it is about the picture, which is not seen"
    both = ["A, Principled", "B, Disney"]  # B begins as a copy of A
    lobe.wait("both", lambda: page.inner_text("#lobe .lobe-legend").split("\n") == both)
    lobe.wait("curves", lambda: page.locator("#lobe .curve").count() == 2)
    assert {"A_f_r", "B_f_b"} <= table(lobe)[0].keys()
    for name in ("solid", "terms", "albedo", "slice"):
        view(lobe, name)
        assert page.locator("#lobe :is(.curve.b, .mesh.b, .pixels:nth-of-type(1))").count() >= 1, name
    assert lobe.complaints == []


def test_the_albedo_says_its_furnace(lobe: Editor) -> None:
    page = lobe.page
    paste(lobe, {"type": "diffuse", "albedo": 0.6})
    view(lobe, "albedo")
    assert "White furnace 0.600 ± 0.001" in page.inner_text("#lobe")
    rows = table(lobe)
    assert all(row["albedo_g"] == pytest.approx(0.6, abs=1e-4) for row in rows)
    paste(lobe, {"type": "principled", "base_color": 1, "metallic": 1, "roughness": 0.7})
    plotted(lobe)
    lobe.wait("the number", lambda: re.search(r"White furnace (0\.99\d|1\.00[0-3])", page.inner_text("#lobe")))


def test_terms_are_of_models_that_have_them(lobe: Editor) -> None:
    page = lobe.page
    paste(lobe, {"type": "metal_rough", "base_color": 0.5, "roughness": 0.5, "metallic": 0})
    view(lobe, "terms")
    assert page.locator("#lobe .curve").count() == 3
    rows = table(lobe)
    assert rows[0]["D"] == pytest.approx(1 / (math.pi * 0.25**2), rel=1e-4), "GGX at its normal, alpha .25"
    assert rows[0]["F_g"] == pytest.approx(0.04, rel=1e-4)
    paste(lobe, {"type": "diffuse", "albedo": 0.6})
    lobe.wait("words", lambda: page.is_visible("#lobe .note[role=status]"))
    assert page.locator("#lobe .curve").count() == 0
    paste(lobe, {"type": "metal_rough", "base_color": 0.5, "metallic": 1, "roughness": 0.5})
    lobe.wait("curves again", lambda: page.locator("#lobe .curve").count() == 3)


def test_the_slice_is_an_image(lobe: Editor) -> None:
    paste(lobe, {"type": "diffuse", "albedo": 0.5})
    view(lobe, "slice")
    lobe.page.uncheck("#lobe >> label:has-text('Logarithmic') >> input")
    grey = lobe.page.evaluate("""() => {
        const { data } = document.querySelector("#lobe canvas").getContext("2d").getImageData(0, 0, 96, 96);
        return [Math.min(...data), Math.max(...data.filter((_, i) => i % 4 < 3))];
    }""")
    assert grey == [pytest.approx(255 * (1.055 * (0.5 / math.pi) ** (1 / 2.4) - 0.055), abs=1)] * 2


def test_a_plot_leaves_as_a_file_of_its_own(lobe: Editor) -> None:
    for name in ("polar", "solid", "terms", "albedo", "slice"):
        view(lobe, name)
        text = lobe.shot("#lobe >> text=Save SVG").decode()
        root = ElementTree.fromstring(text)
        assert "var(" not in text and "class=" not in text and "light-dark" not in text, "it needs no style sheet"
        kinds = {each.tag.rsplit("}", 1)[1] for each in root.iter()}
        assert ("image" if name == "slice" else "path") in kinds and "foreignObject" not in kinds
    rows = lobe.page.locator("#lobe table tbody tr")
    lobe.page.evaluate("document.querySelector('#lobe details').open = true")
    view(lobe, "albedo")
    assert rows.count() == 21 and lobe.page.locator("#lobe tbody th[scope=row]").count() == 21
    assert lobe.complaints == []


def test_images_are_replaced_and_that_is_said(lobe: Editor) -> None:
    page = lobe.page
    paste(lobe, {"type": "diffuse", "albedo": 1})
    lobe.drop("#material-form [data-field=albedo]", {"halves.png": halves()})
    lobe.wait("the words", lambda: "The plot uses the average of the images of albedo" in page.inner_text("#lobe"))
    green, blue = (((byte / 255 + 0.055) / 1.055) ** 2.4 / 2 for byte in (220, 40))  # each on one side
    largest = (0.7152 * green + 0.0722 * blue) / math.pi
    said = re.compile(r"largest value ([\d.]+) per steradian")

    def shown() -> float:
        found = said.search(page.get_attribute("#lobe svg", "aria-label") or "")
        return float(found[1]) if found else math.nan

    lobe.wait("its mean", lambda: shown() == pytest.approx(largest, rel=0.006))
    assert table(lobe)[0]["f_g"] * math.pi == pytest.approx(green, rel=1e-3)


@pytest.mark.slow
def test_means_are_of_the_values_and_not_of_a_small_picture(lobe: Editor, server: Server, tmp_path: Path) -> None:
    """Of bright values, of alpha, and of a pattern that a small picture in sRGB would make too dark."""
    script = """async ([asset, reads]) => {
        const { TextureThumbnails } = await import(new URL("forms/texture-thumbnails.js", location));
        return new TextureThumbnails({ type: "diffuse", albedo: 0 }).mean({ asset }, reads);
    }"""
    pixels = np.random.default_rng(1).random((37, 53, 4)).astype(np.float32) * [40, 4, 0.4, 1]
    path = tmp_path / "bright.exr"
    written = ImageOutput.create(str(path))
    written.open(str(path), ImageSpec(53, 37, 4, "float"))
    written.write_image(np.ascontiguousarray(pixels, np.float32))
    written.close()
    squares = io.BytesIO()
    Image.fromarray((np.indices((128, 128)).sum(0) % 2 * 255).astype(np.uint8)).save(squares, "PNG")
    expected = {"color": [*pixels.mean((0, 1))[:3], 1], "a": [1, 1, 1, pixels[..., 3].mean()]}
    for data, reads, mean in (
        (path.read_bytes(), "color", expected["color"]),
        (path.read_bytes(), "a", expected["a"]),
        (squares.getvalue(), "color", [0.5, 0.5, 0.5, 1]),
    ):
        headers = {"content-type": "application/octet-stream"}
        asset = server.http.post("/v1/assets", content=data, headers=headers).json()["id"]
        assert lobe.page.evaluate(script, [asset, reads]) == pytest.approx(mean, rel=2e-3)


def test_lobes_are_drawn_apart(lobe: Editor) -> None:
    page = lobe.page
    plastic = {"type": "principled", "roughness": 0.3, "clearcoat": 1, "clearcoat_roughness": 0.2}
    paste(lobe, plastic)
    plotted(lobe)
    page.check("#lobe >> label:has-text('By lobe') >> input")
    lobe.wait("the lobes", lambda: page.locator("#lobe .curve[class*=lobe-]").count() == 4)
    legend = page.inner_text("#lobe .lobe-legend").split("\n")
    assert legend == ["Principled", "diffuse", "specular", "multiscatter", "clearcoat"]
    rows = table(lobe)
    for row in rows:
        parts = sum(row[f"f_{name}_g"] for name in legend[1:])
        assert parts == pytest.approx(row["f_g"], rel=1e-4, abs=1e-7)
    lobe.compare()
    page.select_option("#comparison select[aria-label^=Turn]", "metal_rough")
    lobe.wait("those of both", lambda: page.locator("#lobe .curve.b[class*=lobe-]").count() == 2)
    assert {"A_f_clearcoat_r", "B_f_specular_r"} <= table(lobe)[0].keys()
    page.uncheck("#lobe >> label:has-text('By lobe') >> input")
    lobe.wait("the sums alone", lambda: page.locator("#lobe .curve").count() == 2)
    view(lobe, "solid")
    assert page.is_hidden("#lobe >> label:has-text('By lobe')")
    assert lobe.complaints == []


def test_a_moving_hand_gets_a_curve_for_each_answer(lobe: Editor) -> None:
    """Slow answers are not given up for newer questions, and no two are under way at once."""
    page = lobe.page
    page.wait_for_timeout(1000)  # until the curve is fine
    seen, together = page.evaluate("""async () => {
        const real = window.fetch;
        const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
        let [now, together] = [0, 0];
        window.fetch = async (...asked) => {
            if (!String(asked[0]?.url ?? asked[0]).includes("/bsdf")) return real(...asked);
            together = Math.max(together, ++now);
            await sleep(60);
            try {
                return await real(...asked);
            } finally {
                now--;
            }
        };
        const slider = document.querySelector("[data-field=roughness] input[type=range]");
        const seen = new Set();
        for (let i = 0; i < 3000 && seen.size < 5; i++) {
            slider.value = (i % 61) / 60;
            slider.dispatchEvent(new Event("input"));
            await sleep(20);
            seen.add(document.querySelector("#lobe .curve").getAttribute("d"));
        }
        window.fetch = real;
        return [seen.size, together];
    }""")
    assert seen == 5 and together == 1
    plotted(lobe)


def test_nothing_is_asked_for_that_nobody_looks_at(editor: Editor) -> None:
    """Neither before the panel is opened, nor of other models and views: each has a kernel."""
    asked = list[tuple[str, str]]()
    editor.page.on("request", lambda request: "/v1/bsdf" in request.url and asked.append(
        (request.url.rpartition("/v1/")[2], request.post_data_json["material"]["type"])))  # fmt: skip
    editor.page.hover("#show-lobe")
    editor.page.wait_for_timeout(500)
    assert not asked
    editor.page.click("#show-lobe")
    plotted(editor)
    editor.page.wait_for_timeout(1500)
    assert len(set(asked)) == 1


def test_an_old_plot_is_dimmed_until_the_new_one_is_there(lobe: Editor) -> None:
    page = lobe.page
    held: list[Route] = []
    page.route("**/v1/bsdf", lambda route: held.append(route))
    page.fill(lobe.field("roughness", "number"), "0.9")
    page.press(lobe.field("roughness", "number"), "Enter")
    lobe.wait(
        "a dim plot", lambda: page.evaluate("getComputedStyle(document.querySelector('#lobe svg')).opacity") == "0.35"
    )
    for route in held:
        route.continue_()
    page.unroute("**/v1/bsdf")
    plotted(lobe)
    assert page.evaluate("getComputedStyle(document.querySelector('#lobe svg')).opacity") == "1"


def test_a_phone_shows_the_lobe_in_the_pictures_place(visit: Callable[..., Editor]) -> None:
    phone = visit((390, 844), scale=1, touch=True)
    page = phone.page
    page.tap("#show-lobe")
    plotted(phone)
    plot, panel = (page.locator(each).bounding_box() for each in (".lobe-plot", "#panel"))
    assert plot and panel
    assert plot["width"] > 350 and plot["height"] > 220 and plot["y"] + plot["height"] < panel["y"]
    assert page.evaluate("document.documentElement.scrollWidth") == 390
    assert page.evaluate("(p => p.scrollWidth - p.clientWidth)(document.getElementById('lobe'))") == 0
    assert page.evaluate("getComputedStyle(document.getElementById('picture')).visibility") == "hidden"
    page.tap("#lobe [aria-label='Close the lobe']")
    assert page.is_hidden("#lobe")
    assert page.evaluate("getComputedStyle(document.getElementById('picture')).visibility") == "visible"
