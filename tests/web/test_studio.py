"""The layout: the picture in the middle, the shelf under it, the inspector on one side, the outline on the other."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from PIL import Image

from tests.web.editing import document
from tests.web.editor import Editor

FOCUSED = "(document.activeElement.getAttribute('role') ?? document.activeElement.type)"


@pytest.fixture
def at(visit: Callable[..., Editor], request: pytest.FixtureRequest) -> Editor:
    """The editor in a window of the size that a test names."""
    width, height, *more = request.param
    options: dict[str, Any] = more[0] if more else {}
    return visit((width, height), scale=1, **options)


def names(editor: Editor, listbox: str) -> list[str]:
    options = editor.page.get_by_role("listbox", name=listbox, exact=True).get_by_role("option")
    return list(options.evaluate_all("all => all.map((each) => each.getAttribute('aria-label'))"))


def test_materials_are_pictures_on_the_shelf(editor: Editor) -> None:
    page = editor.page
    assert names(editor, "Materials") == ["Red paint", "Floor"]
    own = page.get_by_role("listbox", name="Materials", exact=True)
    assert own.get_by_role("option").locator("img").count() == 2
    page.get_by_role("button", name="New material").click()
    page.get_by_role("button", name="Duplicate material").click()
    assert names(editor, "Materials") == ["Red paint", "Floor", "Material", "Material 2"]
    assert own.get_by_role("option", selected=True).get_attribute("aria-label") == "Material 2"
    own.get_by_role("option", name="Floor").dblclick()
    page.fill(".naming .entry", "ground")
    page.keyboard.press("Enter")
    editor.wait("the name", lambda: "ground" in names(editor, "Materials"))
    assert document(editor)["shapes"][1]["material"] == "ground"
    own.get_by_role("option", name="Material", exact=True).click()
    page.keyboard.press("Delete")
    editor.wait("its end, as nothing was made of it", lambda: "Material" not in names(editor, "Materials"))
    assert len(document(editor)["shapes"]) == 2, "the things stay"


def test_the_library_is_sifted_and_assigned_by_keys(editor: Editor) -> None:
    page = editor.page
    library = page.get_by_role("listbox", name="Library")
    everything = len(names(editor, "Library"))
    page.get_by_role("tab", name="Metal").click()
    metals = names(editor, "Library")
    assert "Gold" in metals and "Chalk" not in metals and len(metals) < everything
    page.get_by_role("tab", name="All").click()
    page.get_by_role("searchbox", name="Search library").fill("gold")
    assert names(editor, "Library") == ["Gold", "Gold (Physically Based)"]
    page.keyboard.press("Tab")
    page.keyboard.press("Enter")
    editor.wait("gold", lambda: document(editor)["materials"].get("Gold", {}).get("metallic") == 1)
    assert library.get_by_role("option", selected=True).get_attribute("aria-label") == "Gold"


def test_the_first_slider_is_near_the_shelf(editor: Editor) -> None:
    page = editor.page
    page.get_by_role("listbox", name="Materials", exact=True).get_by_role("option", selected=True).focus()
    for stops in range(1, 15):  # noqa: B007
        page.keyboard.press("Tab")
        if page.evaluate(FOCUSED) == "range":
            break
    assert stops <= 10
    stop = "all => all.filter((each) => each.checkVisibility() && each.tabIndex === 0).length"
    for shelf in ("#materials", "#library", "#kinds", "#material-acts", "#drawers"):
        assert page.eval_on_selector_all(f"{shelf} > *", stop) == 1, shelf


def test_parameters_are_in_folds(editor: Editor) -> None:
    page = editor.page

    def fold(name: str) -> Any:
        return page.get_by_role("group", name=name, exact=True)

    shown = page.eval_on_selector_all(".fold", "all => all.map((each) => each.getAttribute('aria-label'))")
    first = ["Base", "Specular", "Coat", "Sheen", "Transmission", "Subsurface", "Film", "Emission", "Geometry"]
    assert shown == first
    is_open = "(each) => each.open"
    assert fold("Base").get_by_role("slider", name="Roughness").is_visible()
    assert not fold("Sheen").evaluate(is_open), "untouched"
    assert fold("Coat").evaluate(is_open), "the first scene's ball has one"
    fold("Coat").locator("> summary").click()
    assert "clearcoat 0.3" in fold("Coat").inner_text(), "told while it is shut"

    find = page.get_by_role("searchbox", name="Filter parameters")
    find.fill("sheen rough")
    seen = page.locator("#material-form [data-field]:visible")
    assert [each.get_attribute("data-field") for each in seen.all()] == ["sheen_roughness"]
    find.fill("")
    assert not fold("Sheen").evaluate(is_open) and not fold("Coat").evaluate(is_open)
    # What is wrong is shown, also where its fold was shut meanwhile.
    page.evaluate("""() => {
        const entry = document.querySelector("[data-field=sheen] input.number");
        entry.value = "7";
        entry.dispatchEvent(new Event("change"));
        entry.closest("details").open = false;
    }""")
    editor.wait("the words", lambda: page.is_visible("[data-field=sheen] .trouble"))


def test_the_inspector_follows_the_selection(editor: Editor) -> None:
    page = editor.page
    parts = ("material", "thing", "film")

    def shown() -> list[str]:
        return [part for part in parts if page.is_visible(f"#{part}-part")]

    assert shown() == ["material", "thing"]
    page.click("#outline-list [data-thing='/camera']")
    assert shown() == ["thing", "film"]
    page.click("#outline-list [data-thing='/environment']")
    assert shown() == ["thing"]
    editor.pick("materials", "Floor")
    assert shown() == ["material", "thing"] and editor.text("#thing-title") == "Quad"
    page.get_by_role("button", name="Duplicate material").click()
    page.select_option("#thing-material", "Floor")
    editor.pick("materials", "Floor 2")
    assert editor.text("#material-users") == "On nothing yet" and editor.text("#thing-title") == "Quad"
    page.get_by_role("button", name="Put on Quad").click()
    assert document(editor)["shapes"][1]["material"] == "Floor 2" and page.is_hidden("#put-on")
    assert editor.text("#material-users") == "On Quad"
    page.keyboard.press("Control+z")
    page.click("#outline-list [data-thing='/camera']")
    editor.pick("materials", "Floor 2")
    assert shown() == ["material"], "nothing is made of it, and no thing is selected"


def test_scenes_and_environments_are_pictures(editor: Editor) -> None:
    page, before = editor.page, editor.settled()
    page.get_by_role("tab", name="Environments").click()
    environments = page.get_by_role("listbox", name="Environments")
    editor.leafed("environments")
    environments.get_by_role("option", name="Sunset").click()
    editor.wait_for_change(before)
    page.get_by_role("tab", name="Scenes").click()
    scenes = page.get_by_role("listbox", name="Scenes")
    editor.leafed("scenes")
    assert scenes.get_by_role("option").first.get_attribute("aria-label") == "Shader ball"
    tests = scenes.get_by_role("group", name="Tests")
    assert tests.get_by_role("option", name="Cornell box, empty").count() == 1
    assert tests.get_by_role("option").last.evaluate(
        "node => node === [...document.querySelectorAll('#scenes [role=option]')].at(-1)"
    )
    scenes.get_by_role("option", name="Two point lights").click()
    editor.wait("its name", lambda: editor.text("#scene-title") == "Two point lights")
    assert scenes.get_by_role("option", selected=True).get_attribute("aria-label") == "Two point lights"


def test_the_pill_says_how_far_the_picture_is(editor: Editor) -> None:
    page = editor.page
    state = page.get_by_role("status", name="Picture state")
    editor.wait("samples", lambda: "Converging" in state.inner_text() and "/ 256" in state.inner_text())
    page.get_by_role("button", name="Pause").click()
    editor.wait("a pause", lambda: "Paused" in state.inner_text())
    page.get_by_role("button", name="Resume").click()
    page.get_by_role("button", name="More about the picture").click()
    assert "Samples per second" in editor.text("#readings")


def test_what_the_header_opens(editor: Editor) -> None:
    page = editor.page
    page.get_by_role("button", name="Export").click()
    menu = page.get_by_role("menu", name="Export")
    items = [each.get_attribute("aria-label") for each in menu.get_by_role("menuitem").all()]
    files = ["glTF", "MaterialX", "JSON", "JSON, material"]
    assert items == ["PNG", "PNG, 16 bit", "EXR", "Share picture", *files, "curl", "Python"]
    page.keyboard.press("ArrowDown")
    assert page.evaluate("document.activeElement.getAttribute('aria-label')") == "PNG, 16 bit"
    page.keyboard.press("Escape")
    assert page.is_hidden("#export-menu")
    assert page.locator("header .primary").count() == 1
    page.get_by_role("tab", name="Render", exact=True).click()
    assert page.is_visible("#page-render") and page.get_by_role("button", name="Render picture").is_visible()


def test_the_inspector_is_as_wide_as_one_likes(editor: Editor) -> None:
    page = editor.page
    splitter = page.get_by_role("separator", name="Width of the inspector")
    splitter.focus()
    page.keyboard.press("ArrowLeft")
    width = page.locator("#panel").bounding_box()
    assert width and width["width"] == 376
    for _ in range(20):
        page.keyboard.press("ArrowLeft")
    editor.wait("its end", lambda: splitter.get_attribute("aria-valuenow") == "520")
    page.reload()
    editor.wait("the same", lambda: splitter.get_attribute("aria-valuenow") == "520")


@pytest.mark.parametrize("at", [(390, 844, {"touch": True})], indirect=True)
def test_a_phone_has_colour_and_roughness_on_its_first_screen(at: Editor) -> None:
    page = at.page
    tops = []
    for place in ("#stage", "#materials", "[data-field=base_color] input", "[data-field=roughness] input"):
        box = page.locator(place).first.bounding_box()
        assert box and box["y"] + box["height"] <= 844, place
        tops.append(box["y"])
    assert tops == sorted(tops)


PHONE = {"touch": True}


@pytest.mark.parametrize("at", [(390, 844, PHONE), (320, 640, PHONE)], indirect=True)
def test_a_phone_names_the_scene_adds_things_and_searches(at: Editor) -> None:
    page = at.page
    cut = "(id) => { const { scrollWidth: w, clientWidth: c, scrollHeight: h, clientHeight: d } = "
    cut += "document.getElementById(id); return w > c || h > d; }"
    assert at.text("#scene-title") == "Sphere on a floor"
    width = (page.viewport_size or {})["width"]
    assert not page.evaluate(cut, "scene-title") or width < 390, "on two lines at most"
    for id in ("tab-materials", "tab-environments", "tab-scenes", "tab-renders", "search-library", "add"):
        box = page.locator(f"#{id}").bounding_box()
        assert box and box["x"] >= 0 and box["x"] + box["width"] <= width, id
        middle = [box["x"] + box["width"] / 2, box["y"] + box["height"] / 2]
        assert page.evaluate("([x, y]) => document.elementFromPoint(x, y).id", middle) == id, "nothing lies over it"
    count = len(document(at)["shapes"])
    assert page.is_hidden("#outline-list")
    page.select_option("#add", label="Sphere")
    at.wait("the sphere", lambda: len(document(at)["shapes"]) == count + 1)
    page.tap("#search-library")
    page.keyboard.type("copper")
    assert "Copper" in names(at, "Library") and "Gold" not in names(at, "Library")
    page.tap("#scene-menu")
    page.get_by_role("button", name="Keys and gestures").tap()
    at.wait("what fingers do", lambda: "two fingers" in at.text("#keys-dialog"))


@pytest.mark.parametrize("at", [(1024, 768), (1440, 900), (2560, 1440)], indirect=True)
def test_wide_windows_use_their_width(at: Editor) -> None:
    page = at.page
    width = page.viewport_size["width"]  # type: ignore[index]
    assert page.is_visible("#outliner h2") == (width > 1024), "folded where it takes from the picture"
    material, thing = (page.locator(f"#{part}-part").bounding_box() for part in ("material", "thing"))
    assert material and thing
    assert thing["x"] == material["x"], "one column, as long as nobody draws it wide"
    page.click("#toggle-outline")
    assert page.is_visible("#outliner h2") == (width == 1024)


@pytest.mark.parametrize("at", [(360, 225)], indirect=True)
def test_at_400_percent_the_page_scrolls_under_its_picture(at: Editor) -> None:
    page = at.page
    page.locator("[data-field=roughness] input").first.scroll_into_view_if_needed()
    stage, slider = (page.locator(each).first.bounding_box() for each in ("#stage", "[data-field=roughness] input"))
    assert stage and slider and page.evaluate("scrollY") > 0
    assert stage["y"] == 0 and 0.3 * 225 < stage["height"] <= 0.4 * 225
    assert stage["height"] <= slider["y"] < 225
    assert page.evaluate("document.documentElement.scrollWidth") <= 360


@pytest.mark.parametrize("at", [(1280, 800, {"forced_colors": "active"})], indirect=True)
def test_forced_colours_show_sliders_and_choices(at: Editor) -> None:
    page = at.page

    def colors(place: str) -> np.ndarray:
        shot = Image.open(io.BytesIO(page.locator(place).first.screenshot())).convert("RGB")
        return np.asarray(shot).astype(int)

    track = colors("[data-field=roughness] input[type=range]")
    line = track[track.shape[0] // 2]
    canvas = track[0, 0]
    assert (np.abs(line - canvas).sum(axis=1) > 100).mean() > 0.8, "the track is seen from end to end"
    assert len({tuple(pixel) for pixel in line}) >= 3, "and where the thumb is"
    for chosen, other in (
        ("#materials [aria-selected=true]", "#materials [aria-selected=false]"),
        ("#tools [aria-pressed=true]", "#tools [aria-pressed=false]"),
        ("#tabs [aria-selected=true]", "#tabs [aria-selected=false]"),
    ):
        a, b = (colors(place)[4:8, 4:8].mean(axis=(0, 1)) for place in (chosen, other))
        assert np.abs(a - b).sum() > 100, chosen


def test_no_list_grows_with_what_is_looked_at(editor: Editor) -> None:
    """The options of materials that went with their scene are dropped."""
    for scene in ("cornell-boxes", "point-lights", "sphere-on-floor"):
        editor.pick("scenes", scene)
        editor.wait("the scene", lambda name=scene: editor.chosen("scenes") == name)
    editor.page.click("#tab-materials")
    assert names(editor, "Materials") == ["Red paint", "Floor"]
