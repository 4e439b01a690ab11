"""What a first visit costs on the wire."""

from __future__ import annotations

from playwright.sync_api import BrowserContext

from tests.serving import Server
from tests.web.conftest import Editor

# The browser's own account of each answer, compressed and with its headers.
WATCH = "performance.setResourceTimingBufferSize(2000)"
LOADED = """() => [...performance.getEntriesByType("navigation"), ...performance.getEntriesByType("resource")].map(
    ({ name, transferSize }) => ({ name, bytes: transferSize })
)"""
MOST = 300_000


def test_a_first_visit_is_light(context: BrowserContext, server: Server) -> None:
    editor = Editor(context.new_page())
    editor.page.add_init_script(WATCH)
    editor.open(server.url, "")
    editor.rest("the last answer", lambda: len(editor.requests))
    answers = editor.page.evaluate(LOADED)
    names = [answer["name"] for answer in answers]
    heaviest = sorted(((answer["bytes"], answer["name"]) for answer in answers), reverse=True)[:12]
    assert sum(answer["bytes"] for answer in answers) <= MOST, heaviest
    assert all(answer["bytes"] > 0 for answer in answers), "nothing came from a cache"
    assert len(names) == len(set(names)), "nothing is fetched twice"
    unasked = ("/openapi.json", "/lobe/panel.js")
    assert not [name for name in names if name.endswith(unasked)], "nobody asked for these"
    assert editor.complaints == []


def test_the_lobe_comes_when_a_hand_comes_near_its_button(editor: Editor) -> None:
    page = editor.page
    assert not [url for url in editor.requests if url.endswith("/lobe/panel.js")]
    page.hover("#show-lobe")
    editor.wait("the panel's code", lambda: any(url.endswith("/lobe/panel.js") for url in editor.requests))
    page.click("#show-lobe")
    editor.wait("the panel", lambda: page.is_visible("#lobe h2"))
    assert editor.complaints == []
