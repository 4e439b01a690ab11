"""Section 17 of the contract: what a screen reader, and a check by role and name, finds in the editor.

What is done with these handles has tests of its own: the shelf and the first slider's Tab stop in test_studio, number
fields in test_fields, the tools' arrow keys in test_handles, renders in test_output, the sides compared in
test_compare_sides."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from playwright.sync_api import Locator

from tests.web.editing import document
from tests.web.editor import Editor

FOLDS = ("Base", "Specular", "Coat", "Sheen", "Transmission", "Subsurface", "Film", "Emission", "Geometry")
TOGGLES = ("Select", "Move", "Rotate", "Scale")
ACTS = ("New material", "Duplicate material", "Rename material", "Delete material")
FILES = ("PNG", "EXR", "glTF", "MaterialX", "JSON", "curl", "Python")
ON_A_RENDER = ("Open", "Download PNG", "Download EXR", "Delete")
MODES = ("Swipe", "Side by side", "Difference", "Heat", "Verdict")

# What is opened, by a press on something of that role and name, and what is there then.
HANDLES: list[tuple[tuple[str, str] | None, list[tuple[str, Sequence[str]]]]] = [
    (
        None,
        [
            ("listbox", ["Materials", "Library"]),
            ("button", [*ACTS, *TOGGLES, "Compare", "Share link", "Export"]),
            ("searchbox", ["Search library", "Filter parameters"]),
            ("group", FOLDS),
            ("toolbar", ["Picture tools"]),
            ("tab", ["Render"]),
            ("status", ["Picture state"]),
            ("combobox", ["Add to the scene"]),
        ],
    ),
    (("tab", "Environments"), [("listbox", ["Environments"]), ("slider", ["Environment rotation"])]),
    (("treeitem", "Environment"), [("slider", ["Environment rotation"])]),
    (("tab", "Scenes"), [("listbox", ["Scenes"])]),
    (
        ("tab", "Render"),
        [("spinbutton", ["Width", "Height"]), ("button", ["Render picture"]), ("list", ["Renders"])],
    ),
    (("button", "Export"), [("menuitem", FILES)]),
    (("button", "Compare"), [("combobox", ["Left", "Right", "Comparison"]), ("status", ["Verdict"])]),
]


def is_one(found: Locator) -> bool:
    return found.count() == 1 and found.is_visible()


def test_everything_has_the_role_and_the_name_that_the_contract_says(visit: Callable[..., Editor]) -> None:
    editor = visit((1280, 800))
    page = editor.page

    def by(role: Any, name: str) -> Locator:
        return page.get_by_role(role, name=name, exact=True)

    for opened, parts in HANDLES:
        if opened:
            by(*opened).click()
        for role, names in parts:
            for name in names:
                editor.wait(f"{role} {name!r}", partial(is_one, by(role, name)))
        if opened == ("button", "Export"):
            page.keyboard.press("Escape")

    options = by("combobox", "Comparison").locator("option").all_inner_texts()
    assert set(MODES) <= set(options), "how two are compared"
    by("button", "Done").click()
    state = by("status", "Picture state").inner_text().split("\n")
    assert state[0] in ("Preparing", "Preview", "Converging", "Done") and any("/" in each for each in state)
    for name in TOGGLES:
        assert by("toolbar", "Picture tools").get_by_role("button", name=name, exact=True).get_attribute(
            "aria-pressed"
        ) in ("true", "false")

    for name in ("Scenes", "Environments", "Materials", "Library"):
        if name != "Library":
            page.locator("#drawers").get_by_role("tab", name=name, exact=True).click()
        shown = by("listbox", name).get_by_role("option")
        assert shown.count() > 1 and shown.get_by_role("img").count() == shown.count(), name
    assert by("listbox", "Materials").get_by_role("option", selected=True).count() == 1
    for name in document(editor)["materials"]:
        assert by("listbox", "Materials").get_by_role("option", name=name, exact=True).count() == 1

    by("tab", "Render").click()
    for name, value in (("Width", 64), ("Height", 48), ("Samples", 1)):
        by("spinbutton", name).fill(str(value))
        by("spinbutton", name).press("Enter")
    items = by("list", "Renders").get_by_role("listitem")
    ids = "(all) => all.map((each) => each.dataset.id)"
    known = set(items.evaluate_all(ids))  # of those who were here before
    by("button", "Render picture").click()
    editor.wait("another render", lambda: set(items.evaluate_all(ids)) - known)
    (own,) = set(items.evaluate_all(ids)) - known
    item = items.and_(page.locator(f"[data-id='{own}']"))
    editor.wait("its state", lambda: item.get_attribute("data-state") == "done")

    def is_whole() -> bool:
        assert item.get_attribute("aria-label")
        assert item.get_by_role("progressbar").count() == 1 and item.locator(".state").inner_text().startswith("Done")
        return all(item.get_by_role("button", name=name, exact=True).is_visible() for name in ON_A_RENDER)

    assert is_whole()
    page.reload()
    by("tab", "Render").click()
    editor.wait("it again", lambda: item.count() == 1)
    assert is_whole()
    item.get_by_role("button", name="Delete", exact=True).click()

    by("tab", "Properties").click()
    page.set_viewport_size({"width": 390, "height": 844})
    assert by("combobox", "Add to the scene").is_visible(), "on a phone it is a plus without a word"
    assert editor.complaints == []


def test_no_image_is_shown_without_a_picture(enter: Callable[..., Any]) -> None:
    """Where none comes there is a grey ball, or nothing."""
    room = enter()
    page = room.page
    for place in ("**/thumbnails/**", "**/v1/render**", "**/v1/batches**"):
        page.route(place, lambda route: route.fallback() if route.request.url.endswith(".json") else route.abort())
    editor = Editor(page)
    editor.open(room.url)
    broken = """() => [...document.images].filter((each) => {
        if (!each.checkVisibility({ opacityProperty: true, visibilityProperty: true })) return false;
        if (each.hasAttribute("src")) return each.complete && !each.naturalWidth;
        return getComputedStyle(each).content === "normal";
    }).map((each) => `${each.className} ${each.alt}`)"""
    for drawer in ("materials", "environments", "scenes", "renders"):
        page.click(f"#tab-{drawer}")
        for image in page.locator(f"#drawer-{drawer} img").all()[-1:]:
            image.scroll_into_view_if_needed()
        editor.rest("what was asked for", lambda: len(editor.requests))
        assert page.evaluate(broken) == [], drawer
    page.click("#tab-materials")
    editor.act("sweep-material")
    page.wait_for_selector(".sweep [role=option]")
    assert page.evaluate(broken) == [], "a sweep whose pictures are on their way"
