"""The editor turns a material into another model or distribution of facets, and slides over far ranges."""

from __future__ import annotations

import json
from itertools import pairwise

import pytest
from playwright.sync_api import Page, Request

from tests.web.editor import Editor
from tests.web.modules import call


@pytest.mark.parametrize(("low", "high"), [(0, 1e6), (0.001, 10), (1e-3, 1e6), (0.01, 2), (0.1, 10), (0, 1000)])
def test_far_ranges_are_slid_over_by_factors(page: Page, low: float, high: float) -> None:
    script = """async ([min, max]) => {
        const { span } = await import(new URL("lib/span.js", location));
        const scale = span({ min, max }, 0.01, true);
        const shares = Array.from({ length: 101 }, (_, i) => i / 100);
        const values = shares.map(scale.fromShare);
        return [scale.isLog, values, values.map(scale.toShare)];
    }"""
    is_log, values, shares = page.evaluate(script, [low, high])
    assert is_log and values[0] == low and values[-1] == high
    assert all(a < b for a, b in pairwise(values))
    assert shares == pytest.approx([i / 100 for i in range(101)], abs=2e-3)
    assert not call(page, "lib/span.js", "span", {"min": 0, "max": 2}, 0.01, True)["isLog"]
    assert not call(page, "lib/span.js", "span", {"min": 0, "max": 1000}, 1, False)["isLog"], (
        "other sliders stay as they are"
    )


@pytest.mark.slow
def test_the_sliders_of_microfacet_follow_the_distribution(editor: Editor) -> None:
    editor.settled()
    page = editor.page
    page.select_option("#model", "microfacet")
    editor.settled()
    alpha = editor.field("alpha")
    page.fill(editor.field("alpha", "number"), "0.1")
    page.press(editor.field("alpha", "number"), "Enter")
    assert float(page.input_value(alpha)) == pytest.approx(0.5, abs=0.01), "half of the way from 0.001 to 10"
    page.select_option("#panel [data-field=distribution] select", "phong")
    editor.settled()
    assert float(page.input_value(editor.field("alpha", "number"))) == pytest.approx(396, rel=0.01)
    page.fill(alpha, "1")
    editor.wait(
        "the largest exponent", lambda: page.input_value(editor.field("alpha", "number")) in ("1e+6", "1000000")
    )
    editor.settled()  # a mirror's highlight: few pixels change
    page.keyboard.press("Control+z")
    page.keyboard.press("Control+z")
    editor.wait("ggx", lambda: page.input_value("#panel [data-field=distribution] select") == "ggx")
    assert float(page.input_value(editor.field("alpha", "number"))) == 0.1
    editor.settled()
    assert editor.text("#messages") == "" and editor.complaints == []


def test_a_conductor_begins_with_numbers_of_its_own(editor: Editor) -> None:
    editor.settled()
    page = editor.page
    page.select_option("#model", "microfacet")
    before = editor.settled()
    index, k = ("#panel [data-field=conductor_eta]", "#panel [data-field=conductor_k]")
    f0 = page.locator("#panel [data-field=f0]")
    assert page.input_value(f"{index} input") == "", "no number is no zero"
    assert page.locator(f"{index}.unused").count() == 1 and "unused" not in (f0.get_attribute("class") or "")
    page.select_option("#panel [data-field=fresnel] select", "conductor")
    editor.wait_for_change(before)
    assert page.locator(f"{index}.unused").count() == 0 and "unused" in (f0.get_attribute("class") or "")
    shown = [[float(x.input_value()) for x in page.locator(f"{each} input").all()] for each in (index, k)]
    assert shown == [[0.2, 0.9, 1.1], [3.9, 2.4, 2.2]]
    page.click(f"{index} .reset")
    editor.wait("its mark", lambda: page.locator(f"{index} .trouble").is_visible())
    page.keyboard.press("Control+z")
    editor.settled()
    assert editor.text("#messages") == "" and editor.complaints == []


def test_going_back_to_a_model_brings_back_what_was_there(editor: Editor) -> None:
    """As long as nobody edits what it was turned into."""
    editor.settled()
    page = editor.page
    coat = editor.field("clearcoat", "number")
    page.fill(coat, "0.75")
    page.press(coat, "Enter")
    for model in ("diffuse", "blinn_phong", "principled"):
        page.select_option("#model", model)
        editor.settled()
    assert page.input_value(coat) == "0.75"
    page.select_option("#model", "blinn_phong")
    editor.settled()
    page.fill(editor.field("shininess", "number"), "77")
    page.press(editor.field("shininess", "number"), "Enter")
    page.select_option("#model", "principled")
    editor.settled()
    assert page.input_value(coat) == "0", "it was another material meanwhile"
    page.keyboard.press("Control+z")
    assert (
        page.input_value("#model") == "blinn_phong" and page.input_value(editor.field("shininess", "number")) == "77"
    )
    assert editor.text("#messages") == "" and editor.complaints == []


@pytest.mark.slow
def test_variant_b_becomes_openpbr_with_its_groups_and_lobes(editor: Editor) -> None:
    """Coat and sheen come along; each group of the schema is a fold, and each lobe has a curve."""
    editor.settled()
    page = editor.page
    material = {"type": "principled", "clearcoat": 0.8, "sheen": 0.5, "film_thickness": 400}
    page.evaluate("(text) => { navigator.clipboard.readText = async () => text; }", json.dumps(material))
    editor.act("paste-material")
    editor.settled()
    editor.compare()
    editor.wait("the bar", lambda: page.is_visible("#comparison"))
    turn = "#comparison select[aria-label^=Turn]"
    assert "OpenPBR" in page.inner_text(turn)
    page.select_option(turn, "openpbr")
    page.click("#comparison [data-value=b]")
    editor.wait("B", lambda: page.input_value("#model") == "openpbr")
    shown = {name: page.input_value(editor.field(name, "number")) for name in (
        "coat_weight", "fuzz_weight", "thin_film_weight", "thin_film_thickness", "coat_darkening",
    )}  # fmt: skip
    assert shown == {
        "coat_weight": "0.8", "fuzz_weight": "0.5", "thin_film_weight": "1", "thin_film_thickness": "0.4",
        "coat_darkening": "0",
    }  # fmt: skip
    folds = page.locator("#panel .fold h3").all_text_contents()
    found = [each for each in folds if each]
    assert found == [
        "Base",
        "Specular",
        "Coat",
        "Sheen",
        "Transmission",
        "Subsurface",
        "Film",
        "Emission",
        "Geometry",
    ]
    turned = set[str]()

    def note(request: Request) -> None:
        if request.url.endswith("/v1/materials/convert"):
            turned.add(request.post_data_json["to"])

    page.on("request", note)
    page.click("#show-lobe")
    page.wait_for_timeout(50)
    done = "document.getElementById('lobe').getAttribute('aria-busy') === 'false'"
    editor.wait("the plot", lambda: page.evaluate(done))
    page.check("#lobe >> label:has-text('By lobe') >> input")
    layers = {"sheen", "clearcoat", "fuzz", "coat"}
    wanted = {"A, Principled", "B, OpenPBR", "diffuse", "specular", "multiscatter", *layers}
    editor.wait("its lobes", lambda: set(page.inner_text("#lobe .lobe-legend").split("\n")) == wanted)
    assert not turned, "nobody asked for another model"
    assert editor.text("#messages") == "" and editor.complaints == []


def test_without_the_server_the_material_stays(editor: Editor) -> None:
    editor.settled()
    page = editor.page
    page.route("**/v1/materials/convert", lambda route: route.abort())
    page.select_option("#model", "disney")
    editor.wait("the message", lambda: "does not answer" in editor.text("#messages"))
    assert page.input_value("#model") == "principled"
    page.unroute("**/v1/materials/convert")
    page.select_option("#model", "disney")
    editor.settled()
    assert page.input_value("#model") == "disney" and editor.text("#messages") == ""
