"""The library on the shelf: it is found again as it was left, and says in words where nothing is."""

from __future__ import annotations

from tests.web.editor import Editor

KIND = "document.querySelector('#kinds [aria-selected=true]').dataset.kind"
SCROLLED = "document.querySelector('#library').scrollLeft"


def test_a_search_goes_through_all_kinds_and_says_where_nothing_is(editor: Editor) -> None:
    page = editor.page
    shown = page.locator("#library [role=option]")
    search = page.get_by_role("searchbox", name="Search library")
    page.click("#kinds [data-kind=saved]")
    assert editor.text("#no-hit") == "Nothing is saved yet."
    page.click("#kinds [data-kind=metal]")
    assert editor.text("#no-hit") == ""
    search.fill("velv")
    assert page.evaluate(KIND) == "all" and shown.count() == 2
    page.click("#kinds [data-kind=glass]")
    assert shown.count() == 0 and editor.text("#no-hit").startswith("Nothing here is called “velv”.")
    page.get_by_role("button", name="Show 2 materials of other kinds").click()
    assert page.evaluate(KIND) == "all" and shown.count() == 2
    search.fill("unobtainium")
    assert editor.text("#no-hit") == "Nothing is called “unobtainium”."
    search.fill("")
    assert page.evaluate(KIND) == "metal", "as it was before"


def test_the_library_is_found_again_as_it_was_left(editor: Editor) -> None:
    page = editor.page
    gold = page.locator("#library [data-value=gold]")
    gold.click()
    editor.wait("its mark", lambda: gold.get_attribute("aria-selected") == "true")
    place = page.evaluate(f"document.querySelector('#library').scrollLeft += 60, {SCROLLED}")
    page.wait_for_timeout(100)  # a scroll is told with the next frame
    for away, back in (
        ("#tab-render", "#tab-properties"),
        ("#tab-scenes", "#tab-materials"),
        ("#kinds [data-kind=metal]", "#kinds [data-kind=all]"),
        ("#outline-list [data-thing='/camera']", "#outline-list [data-thing='/shapes/0']"),
    ):
        page.click(away)
        page.click(back)
        assert gold.get_attribute("aria-selected") == "true", away
        assert page.evaluate(SCROLLED) == place, away
    page.fill("#search-library", "glass")
    page.fill("#search-library", "")
    assert page.evaluate(SCROLLED) == place


def test_delete_says_why_something_stays(editor: Editor) -> None:
    page = editor.page
    things = page.locator("#outline-list [data-thing^='/shapes/']")
    page.click("#outline-list [data-thing='/shapes/0']")
    page.keyboard.press("Delete")
    assert things.count() == 1
    for key in ("#outline-list", "#stage"):
        page.focus(key)
        page.keyboard.press("Delete")
        assert editor.text(".message.refusal strong") == "A scene keeps at least one thing.", key
        page.get_by_role("button", name="Close message").click()
    page.click("#outline-list [data-thing='/camera']")
    page.keyboard.press("Delete")
    assert editor.text(".message.refusal strong") == "A scene keeps its camera."
    assert things.count() == 1
