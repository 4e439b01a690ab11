"""A user of the editor in a real browser during a soak, who orbits and moves sliders; and the page's memory."""

from __future__ import annotations

import random
import threading
import time
from importlib.util import find_spec
from typing import TYPE_CHECKING

from tests.bench.hand import FLAGS, chromium
from tests.bench.soak_server import SoakServer
from tests.bench.soak_tally import Tally

if TYPE_CHECKING:
    from playwright.sync_api import CDPSession, Locator, Page

PATIENCE_MS = 60_000  # long, as renderers are killed meanwhile
MOVES = (10, 60)  # of the mouse in one drag
WEIGH_S = 5.0
SETTLED_S = 20.0  # after which the heap is compared with what it is at the end
NEWEST = "#stage.live[aria-busy=false]"


def missing() -> str | None:
    """The thing that is missing for a drag session, or None."""
    if find_spec("playwright") is None:
        return "playwright (pip install playwright)"
    return None if chromium() else "Debian's chromium"


def drag(server: SoakServer, tally: Tally, over: threading.Event, chance: random.Random) -> None:
    """Drag over the picture and along a slider in turns, and wait for the frame of each drag."""
    from playwright.sync_api import Error, sync_playwright

    try:
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=chromium(), args=FLAGS)
            page = browser.new_page(viewport={"width": 800, "height": 560})
            page.on("pageerror", lambda error: tally.lose(f"page: {error}"))
            page.goto(server.url)
            page.wait_for_selector(NEWEST, timeout=PATIENCE_MS)
            _session(page, tally, over, chance)
            browser.close()
    except Error as error:  # the page hung or the browser fell
        tally.lose(f"browser: {error.message.splitlines()[0]}")


def _session(page: Page, tally: Tally, over: threading.Event, chance: random.Random) -> None:
    devtools = page.context.new_cdp_session(page)
    devtools.send("Performance.enable")
    picture = page.locator("#stage")
    slider = page.locator("#material-form [data-field=roughness] input[type=range]")
    began = weighed = time.monotonic()
    while not over.is_set():
        for place in (picture, slider):
            _one_drag(page, place, chance)
            page.wait_for_selector(NEWEST, timeout=PATIENCE_MS)
            tally.count("drags")
        now = time.monotonic()
        if now - weighed > WEIGH_S:
            tally.weighed(*_weigh(devtools), settled=now - began > SETTLED_S)
            weighed = now
    tally.weighed(*_weigh(devtools), settled=True)


def _one_drag(page: Page, place: Locator, chance: random.Random) -> None:
    place.scroll_into_view_if_needed()
    box = place.bounding_box()
    assert box is not None

    def somewhere() -> tuple[float, float]:
        return (
            box["x"] + chance.uniform(0.1, 0.9) * box["width"],
            box["y"] + chance.uniform(0.3, 0.7) * box["height"],
        )

    page.mouse.move(*somewhere())
    page.mouse.down()
    page.mouse.move(*somewhere(), steps=chance.randint(*MOVES))
    page.mouse.up()


def _weigh(devtools: CDPSession) -> tuple[int, int]:
    """Bytes of the page's heap after its garbage is gone, and how many nodes the document's tree keeps alive."""
    devtools.send("HeapProfiler.collectGarbage")
    told = {each["name"]: each["value"] for each in devtools.send("Performance.getMetrics")["metrics"]}
    return int(told["JSHeapUsedSize"]), int(told["Nodes"])
