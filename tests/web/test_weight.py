"""What a first visit costs on the wire."""

from __future__ import annotations

import pytest
from playwright.sync_api import Browser

from tests.serving import Server
from tests.web.editor import Editor

# The browser's own account of each answer, compressed and with its headers.
WATCH = "performance.setResourceTimingBufferSize(2000)"
# What waits for the first picture does not wait for ever; here it does, as a busy machine may take as long.
PATIENT = """{
    const own = setTimeout;
    window.setTimeout = (act, wait_ms, ...given) => own(act, wait_ms === 3000 ? 60000 : wait_ms, ...given);
}"""
LOADED = """() => [...performance.getEntriesByType("navigation"), ...performance.getEntriesByType("resource")].map(
    ({ name, transferSize, startTime }) => ({ name, bytes: transferSize, at: startTime })
)"""
FIRST_PICTURE = """performance.getEntriesByName("first picture")[0].startTime"""
MOST_BEFORE_THE_PICTURE = 200_000
MOST = 300_000
# What a hand needs only once there is a picture, one file of each part.
LATER = ("final-pictures.js", "importer.js", "adding.js", "header.js", "tools.js", "tools.css", "renders.css")


@pytest.mark.usefixtures("editor")  # after that the server has its kernel: this visit waits for the network alone
def test_a_first_visit_is_light(browser: Browser, server: Server) -> None:
    context = browser.new_context(viewport={"width": 1440, "height": 900}, device_scale_factor=0.5)
    editor = Editor(context.new_page())
    editor.page.add_init_script(WATCH)
    editor.page.add_init_script(PATIENT)
    editor.open(server.url, "")
    editor.rest("the last answer", lambda: len(editor.requests))
    answers = editor.page.evaluate(LOADED)
    shown = editor.page.evaluate(FIRST_PICTURE)
    names = [answer["name"] for answer in answers]
    heaviest = sorted(((answer["bytes"], answer["name"]) for answer in answers), reverse=True)[:12]
    before = [answer for answer in answers if answer["at"] < shown]
    assert sum(answer["bytes"] for answer in before) <= MOST_BEFORE_THE_PICTURE, heaviest
    assert sum(answer["bytes"] for answer in answers) <= MOST, heaviest
    assert all(answer["bytes"] > 0 for answer in answers), "nothing came from a cache"
    assert len(names) == len(set(names)), "nothing is fetched twice"
    unasked = ("/openapi.json", "/lobe/panel.js", "/lobe.css", "/compare/comparison.js", "/compare.css")
    assert not [name for name in names if name.endswith(unasked)], "nobody asked for these"
    early = {answer["name"].rsplit("/", 1)[-1] for answer in before}
    late = {name.rsplit("/", 1)[-1] for name in names} - early
    assert late >= set(LATER), "what the first picture does not need comes after it, without being asked for"
    assert editor.complaints == []
    context.close()


PARTS = {
    "/lobe/panel.js": ("#show-lobe", "#lobe h2"),
    "/compare/comparison.js": ("#compare", "#comparison select"),
}


def test_a_part_comes_when_a_hand_comes_near_its_button(editor: Editor) -> None:
    page = editor.page
    for code, (button, shown) in PARTS.items():
        assert not [url for url in editor.requests if url.endswith(code)]
        page.hover(button)
        editor.wait("the part's code", lambda code=code: any(url.endswith(code) for url in editor.requests))
        page.click(button)
        editor.wait("the part", lambda shown=shown: page.locator(shown).first.is_visible())
    assert editor.complaints == []
