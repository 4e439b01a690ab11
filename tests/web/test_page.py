"""The page that tests share is for each of them what a new browser shows."""

from __future__ import annotations

import re
from collections.abc import Callable
from difflib import unified_diff
from typing import Any

from tests.web.editing import halves
from tests.web.editor import Editor

# All that a page keeps, and all that it shows.
STATE = """async () => {
    const kept = (await indexedDB.databases()).map(({ name }) => name);
    return {
        shown: document.documentElement.outerHTML.split("<"),
        entries: [...document.querySelectorAll("input, select")].map(({ value, checked }) => [value, checked]),
        focused: document.activeElement?.outerHTML.slice(0, 80),
        above: document.querySelectorAll(":popover-open, dialog[open]").length,
        scrolled: [...document.querySelectorAll("body *")].filter((each) => each.scrollTop).length,
        size: [innerWidth, innerHeight, devicePixelRatio, matchMedia("(prefers-color-scheme: dark)").matches,
            matchMedia("(prefers-reduced-motion: reduce)").matches],
        kept, local: Object.keys(localStorage).map((key) => key.split(" ")[0]).sort(), visited: history.state,
        address: location.href,
    };
}"""


# How far a picture is, how long that took, and what a render would take by that.
TOLD = "preparing|preview|denoised|size|samples|noise|left|rate|elapsed|progress|announcer"
PROGRESS = re.compile(rf'[a-z]+ id="({TOLD})"|span class="price"')
CHANCE = re.compile(
    r'blob:[^"]+| (?:width|height)="\d+"| style="[^"]*px[^"]*"|'
    r'(?<=[a-z])-\d+(?=[-" ])|(?<=Clean) in about .*?(?=[.]"|[.]$)'
)
WAITED = "sunbox.preparing"  # what a page keeps of it where it was long
KEPT = """async () => [
    localStorage.length, sessionStorage.length, document.cookie, (await indexedDB.databases()).length,
]"""


def state(editor: Editor) -> Any:
    editor.page.evaluate("document.querySelector('#pause').click()")
    editor.wait("a pause", lambda: editor.text("#state") == "Paused")
    editor.rest("the last small picture", lambda: editor.page.evaluate("document.body.outerHTML.length"))
    found = editor.page.evaluate(STATE)
    found["local"] = [name for name in found["local"] if name != WAITED]
    # Addresses of small pictures are drawn by lot, controls are numbered as the parts of the page arrive, and a
    # preview stands for a picture that may be a pixel smaller.
    found["shown"] = [CHANCE.sub("", each) for each in found["shown"] if not PROGRESS.match(each)]
    found["focused"] = CHANCE.sub("", found["focused"])
    return found


def test_what_one_did_the_next_does_not_find(fresh_editor: Editor, visit: Callable[..., Editor], enter: Any) -> None:
    """After one that changes whatever a page has."""
    editor = visit()
    page = editor.page
    page.click("#compare")
    editor.pick("scenes", "cornell-empty")
    editor.drop("#stage", {"halves.png": halves()})
    page.click("#theme")
    editor.tab("render")
    page.keyboard.press("Control+z")
    page.click("#pause")
    page.click("#toggle-outline")
    page.set_viewport_size({"width": 1000, "height": 700})
    page.emulate_media(reduced_motion="reduce", color_scheme="light")
    page.route("**/*", lambda route: route.abort())
    page.on("request", lambda _: editor.requests.append("heard"))
    page.mouse.down()
    page.keyboard.down("Shift")
    page.context.new_page()
    enter().forget()
    assert len(page.context.pages) == 1
    assert page.evaluate(KEPT) == [0, 0, "", 0]
    editor.requests.clear()
    again = visit()
    assert editor.requests == [] and page.is_disabled("#undo") and page.is_disabled("#redo")
    one, other = state(again), state(fresh_editor)
    shown = list(unified_diff(other.pop("shown"), one.pop("shown"), "fresh", "again", n=1))
    assert not shown, "\n".join(shown)
    assert one == other
