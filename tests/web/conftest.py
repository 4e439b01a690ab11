"""A real server and the editor in a real browser."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pytest
from playwright.sync_api import Browser, BrowserContext, Error, Page, ViewportSize, sync_playwright

from gpu import Renderer
from service.server.storage.documents import KINDS
from tests.serving import Server
from tests.web.editor import PATIENCE_S, Editor

# The headless shell is the same engine without the window around it, and opens a page at half the cost.
CHROMIUM = shutil.which("chromium-headless-shell") or shutil.which("chromium")
ELSEWHERE = "/icon.svg"  # a page of the same origin, in which no editor runs
WINDOW: ViewportSize = {"width": 800, "height": 560}
COARSE = 0.5  # a pixel of the picture for four of the page: all waits for samples are a quarter as long


@pytest.hookimpl(tryfirst=True)  # before markers choose
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if item.path.is_relative_to(Path(__file__).parent) and item.get_closest_marker("calm") is None:
            item.add_marker(pytest.mark.browser)


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class MortalServer:
    """`sunbox serve` on a port of its own, that can be stopped and started again."""

    def __init__(self, folder: Path) -> None:
        self.port = free_port()
        self.url = f"http://127.0.0.1:{self.port}"
        self.folder = folder
        self.process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        with (self.folder / "server.log").open("ab") as log:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "service.cli", "serve", "--port", str(self.port)],
                env=os.environ | {"SUNBOX_DATA_DIR": str(self.folder / "data")},
                stdout=log,
                stderr=log,
            )
        deadline = time.monotonic() + PATIENCE_S
        while not self.is_ready():
            if self.process.poll() is not None or time.monotonic() > deadline:
                pytest.fail("the server did not start:\n" + (self.folder / "server.log").read_text())
            time.sleep(0.05)

    def is_ready(self) -> bool:
        try:
            with urllib.request.urlopen(self.url + "/readyz", timeout=5) as answer:
                return bool(answer.status == 200)
        except OSError:  # refused, or not ready yet
            return False

    def stop(self) -> None:
        if self.process is None:
            return
        self.process.terminate()
        try:
            self.process.wait(20)
        finally:
            self.process.kill()
            self.process = None


@pytest.fixture
def mortal(gpu: Renderer, tmp_path: Path) -> Iterator[MortalServer]:
    served = MortalServer(tmp_path)
    served.start()
    yield served
    served.stop()


def _as_long_as_possible(*, fixture_name: str, config: pytest.Config) -> Any:
    """A scope. Playwright's event loop runs until the browser is closed, and tests outside of this folder that come
    after it could start none of their own."""
    return "session" if config.option.markexpr.startswith("browser") else "module"


@pytest.fixture(scope=_as_long_as_possible)
def browser() -> Iterator[Browser]:
    if CHROMIUM is None:
        if os.environ.get("CI"):
            pytest.fail("no chromium")
        pytest.skip("Debian's chromium-headless-shell is not installed")
    with sync_playwright() as playwright:
        launched = playwright.chromium.launch(
            executable_path=CHROMIUM, args=["--no-sandbox", "--disable-dev-shm-usage"]
        )
        yield launched
        launched.close()


@pytest.fixture(scope="session")
def server(gpu: Renderer, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """`sunbox serve`, ready, for all tests of the session that leave it as it was; a browser keeps its files."""
    served = Server(tmp_path_factory.mktemp("server"), python=(sys.executable, "-m", "tests.web.keeping"))
    served.wait()
    yield served
    served.stop()


@pytest.fixture(scope=_as_long_as_possible)
def page(browser: Browser, server: Server) -> Iterator[Page]:
    """A page in which functions of the modules are called by themselves."""
    opened = browser.new_page()
    opened.goto(server.url + ELSEWHERE)
    yield opened
    opened.close()


@pytest.fixture
def context(browser: Browser) -> Iterator[BrowserContext]:
    """A browser that was never here: it has kept nothing, and has to fetch each file."""
    opened = browser.new_context(viewport=WINDOW, device_scale_factor=COARSE)
    yield opened
    opened.close()


@pytest.fixture
def fresh_editor(server: Server, context: BrowserContext) -> Editor:
    """The editor on a first visit, for tests of what that is like."""
    opened = Editor(context.new_page())
    opened.open(server.url)
    return opened


class Room:
    """A browser whose page many tests use, one after the other. Each finds it as if nobody had been there before, but
    for the files of the editor, which the browser keeps."""

    def __init__(self, browser: Browser, url: str, options: dict[str, Any]) -> None:
        self.url = url
        self.context = browser.new_context(**options)
        self._heard: list[tuple[str, Any]] = []
        self.page = self._enter()

    def _enter(self) -> Page:
        page = self.context.new_page()
        page.goto(self.url + ELSEWHERE)
        on = page.on

        def listen(event: Any, hear: Any) -> None:
            on(event, hear)
            self._heard.append((event, hear))

        changed: Any = page
        changed.on = listen
        changed.add_init_script = changed.route_web_socket = _refuse  # no page gets rid of these
        return page

    def forget(self) -> None:
        """Leave the editor, and undo what a test did to the page and to what the browser keeps."""
        for other in self.context.pages:
            if other is not self.page:
                other.close()
        try:
            self._leave()
        except Error:  # it was closed, or has crashed
            self.page.close()
            self._heard.clear()
            self.page = self._enter()
            self._leave()

    def _leave(self) -> None:
        for event, hear in self._heard:
            self.page.remove_listener(event, hear)
        self._heard.clear()
        self.page.unroute_all(behavior="ignoreErrors")
        self.page.mouse.up()
        for key in ("Shift", "Control", "Alt"):
            self.page.keyboard.up(key)
        self.page.goto(self.url + ELSEWHERE)
        self.page.mouse.move(0, 0)  # as before a hand has touched it
        self.page.evaluate("sessionStorage.clear()")
        self.page.emulate_media(color_scheme="null", reduced_motion="null", forced_colors="null")
        self.context.clear_permissions()
        session = self.context.new_cdp_session(self.page)
        kinds = "cookies,local_storage,indexeddb,cache_storage"
        session.send("Storage.clearDataForOrigin", {"origin": self.url, "storageTypes": kinds})
        session.detach()


def _refuse(*_: object, **__: object) -> None:
    pytest.fail("the page outlives the test: take `blank` in the place of `editor`")


@pytest.fixture(scope=_as_long_as_possible)
def _rooms(browser: Browser, server: Server) -> Iterator[Callable[..., Room]]:
    """_rooms(**options): the room whose browser has these, made when it is asked for first."""
    made: dict[str, Room] = {}

    def room(**options: Any) -> Room:
        if (key := repr(sorted(options.items()))) not in made:
            made[key] = Room(browser, server.url, {"viewport": WINDOW} | options)
        return made[key]

    yield room
    for each in made.values():
        each.context.close()


@pytest.fixture
def enter(_rooms: Callable[..., Room], server: Server) -> Iterator[Callable[..., Room]]:
    """enter(scale, touch): a room until the end of the test, whose screen has so many pixels for one of the page, and
    fingers on it or none. Of what was saved on the server by name nothing is left after it."""
    used: dict[int, Room] = {}

    def room(scale: float = COARSE, touch: bool = False) -> Room:
        found = _rooms(device_scale_factor=scale, has_touch=touch, is_mobile=touch)
        used[id(found)] = found
        return found

    yield room
    for each in used.values():
        each.forget()
    for kind in KINDS if used else ():
        for saved in server.http.get(f"/v1/documents/{kind}").json():
            server.http.delete(f"/v1/documents/{kind}/{quote(saved['name'], safe='')}")


@pytest.fixture
def visit(enter: Callable[..., Room]) -> Callable[..., Editor]:
    """visit(size, scale, touch, **media): the editor in a window like that, on a page that tests share."""

    def opened(
        size: tuple[int, int] = (WINDOW["width"], WINDOW["height"]),
        scale: float = COARSE,
        touch: bool = False,
        **media: Any,
    ) -> Editor:
        room = enter(scale, touch)
        wanted: ViewportSize = {"width": size[0], "height": size[1]}
        if room.page.viewport_size != wanted:
            room.page.set_viewport_size(wanted)
        if media:
            room.page.emulate_media(**media)
        editor = Editor(room.page)
        editor.open(room.url)
        return editor

    return opened


@pytest.fixture
def editor(visit: Callable[..., Editor]) -> Editor:
    """The editor on a page that tests share, as on a first visit."""
    return visit()


@pytest.fixture
def blank(enter: Callable[..., Room]) -> Editor:
    """A page of the test's own in the browser that tests share, before the editor is opened: for what it has to begin
    with."""
    return Editor(enter().context.new_page())
