"""A real server and the editor in a real browser."""

from __future__ import annotations

import base64
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
from service.storage.documents import KINDS
from tests.serving import Server

# The headless shell is the same engine without the window around it, and opens a page at half the cost.
CHROMIUM = shutil.which("chromium-headless-shell") or shutil.which("chromium")
MENUS = {"save": ("#scene-menu", "#page-save"), "view": ("#view", "#view-menu")}
ELSEWHERE = "/icon.svg"  # a page of the same origin, in which no editor runs
WINDOW: ViewportSize = {"width": 800, "height": 560}
COARSE = 0.5  # a pixel of the picture for four of the page: all waits for samples are a quarter as long
# Whether something comes to hold within some seconds: asked in the page, that costs next to nothing.
SOON = """async (holds) => {
    const find = (selector) => document.querySelector(selector);
    const samples = () => parseInt(find("#samples")?.innerText.split("/")[0].replace(/\\D/g, "") || "0");
    const tests = {
        opened: () => samples() >= 1 && performance.getEntriesByName("all parts").length > 0,
        settled: () => find("#stage[aria-busy=false]") && !find("#preview").checkVisibility()
            && (samples() >= 8 || find("#state").innerText === "Done"),
    };
    for (let i = 0; i < 200; i++) {
        if (tests[holds]()) return true;
        await new Promise((resolve) => setTimeout(resolve, 25));
    }
    return false;
}"""
OPENED, SETTLED = "opened", "settled"
PATIENCE_S = 180.0  # a bound against hanging: whoever uses the machine meanwhile may take most of it


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


class Editor:
    """The page, and what a test asks of it."""

    def __init__(self, page: Page) -> None:
        self.page = page
        page.set_default_timeout(PATIENCE_S * 1000)
        self.complaints: list[str] = []
        self.requests: list[str] = []
        page.on("console", lambda message: self._note(message.type, message.text))
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.on("request", lambda request: self.requests.append(request.url))
        page.on("websocket", lambda opened: self.requests.append(opened.url))
        # From here on, as it takes a moment: a file picker that nobody waits for yet would be cancelled.
        page.on("filechooser", lambda _: None)

    def _note(self, kind: str, text: str) -> None:
        if kind in ("error", "warning"):
            self.complaints.append(f"{kind}: {text}")

    def open(self, url: str, scene: str = "#scene=sphere-on-floor") -> None:
        """With a scene that is quicker than the first one; "" goes on with what was left."""
        self.page.goto(f"{url}/{scene}")
        self.wait("a picture and what comes after it", lambda: self.page.evaluate(SOON, OPENED))

    def wait(self, what: str, reached: Callable[[], object]) -> None:
        deadline, pause_ms = time.monotonic() + PATIENCE_S, 20.0
        while not reached():
            if time.monotonic() > deadline:
                pytest.fail(f"waited in vain for {what}; page says: {self.complaints}, {self.text('#messages')!r}")
            self.page.wait_for_timeout(pause_ms)
            pause_ms = min(1.2 * pause_ms, 100)  # a look takes 10 ms of a processor, which the picture waits for

    def rest(self, what: str, reading: Callable[[], object]) -> None:
        """Return when a reading has stayed the same for half a second: what was under way has come by then."""

        def stays() -> bool:
            before = reading()
            self.page.wait_for_timeout(500)
            return reading() == before

        self.wait(what, stays)

    def click_until(self, what: str, reached: Callable[[], object]) -> None:
        """Clicks into the middle of the picture, again where it was not yet ready to tell what stands there."""

        def clicked() -> bool:
            self.page.click("#stage")
            self.page.wait_for_timeout(500)
            return bool(reached())

        self.wait(what, clicked)

    def text(self, selector: str) -> str:
        return self.page.inner_text(selector)

    def samples(self) -> int:
        digits = "".join(filter(str.isdigit, self.text("#samples").split("/")[0]))
        return int(digits or 0)

    def pixels(self) -> list[float]:
        """The canvas in 8x8 averages of red, green and blue: too coarse for noise to count."""
        values: list[float] = self.page.evaluate("""() => {
            const small = new OffscreenCanvas(8, 8).getContext("2d");
            small.imageSmoothingQuality = "high";
            small.drawImage(document.querySelector("#picture"), 0, 0, 8, 8);
            return [...small.getImageData(0, 0, 8, 8).data].filter((_, i) => i % 4 < 3);
        }""")
        return values

    def settled(self) -> list[float]:
        """The pixels after enough samples at full size that neither noise nor a guess is a reason to differ."""
        self.wait("a settled picture", lambda: self.page.evaluate(SOON, SETTLED))
        return self.pixels()

    def differs(self, before: list[float], least: float = 4.0) -> bool:
        """Whether the tenth of the picture that changed most differs by so many of 255 steps."""
        apart = sorted((abs(a - b) for a, b in zip(before, self.pixels(), strict=True)), reverse=True)
        most = apart[: len(apart) // 10]
        return sum(most) / len(most) > least

    def wait_for_change(self, before: list[float], least: float = 4.0) -> None:
        self.wait("other pixels", lambda: self.differs(before, least))

    def tab(self, name: str) -> None:
        """Bring a part of the page to hand: the "material" in the inspector, the outline of the "scene", the camera's
        "film", the sheet "render", or what opens under a button: "save" under the scene's name, "view"."""
        page = self.page
        camera = "#outline-list [data-thing='/camera']"
        size = page.viewport_size or {"width": 0, "height": 0}
        if name not in MENUS and page.locator(":popover-open").count():
            page.keyboard.press("Escape")
        lies_over = size["width"] < size["height"] or size["width"] <= 896
        if name == "scene" or (name == "film" and page.is_hidden(camera)):
            self.outline(shown=True)
        elif lies_over:
            self.outline(shown=False)
        if name == "render":
            page.click("#tab-render")
        elif name in MENUS:
            button, menu = MENUS[name]
            if not page.is_visible(menu):
                page.click(button)
                page.wait_for_selector(menu, state="visible")  # its parts come on demand
        elif name == "film":
            page.click(camera)
            page.click("#tab-properties")
        elif name != "scene" or not lies_over:
            page.click("#tab-properties")
            if name == "material" and page.is_hidden("#material-part"):
                self.pick("materials", self.chosen("materials"))

    def outline(self, shown: bool) -> None:
        if (self.page.get_attribute("body", "data-outline") == "shown") != shown:
            self.page.click("#toggle-outline")

    def act(self, id: str) -> None:
        """Press an item of the menu for the material in hand."""
        if not self.page.is_visible(f"#{id}"):
            self.page.click("#material-more")
        self.page.click(f"#{id}")

    def unfold(self) -> None:
        """Open all parts of the material, those too that a change still on its way brings anew."""
        shut = "details.fold:not([open]) > summary"
        click = "all => { all.forEach((each) => each.click()); return all.length === 0; }"
        self.wait("the parts to open", lambda: self.page.locator(shut).evaluate_all(click))

    def pick(self, shelf: str, value: str) -> None:
        """Choose a picture on the shelf: of the scene's "materials", the "library", "environments" or "scenes"."""
        self.page.click(f"#tab-{'materials' if shelf == 'library' else shelf}")
        self.page.click(f"#{shelf} [data-value='{value}']")

    def chosen(self, shelf: str) -> str:
        """What is chosen there."""
        script = "(id) => document.querySelector(`#${id} [aria-selected=true]`)?.dataset.value ?? ''"
        return str(self.page.evaluate(script, shelf))

    def leafed(self, shelf: str) -> None:
        """Wait for every picture of a shelf, going to those that wait until somebody looks."""
        script = """(all) => {
            const missing = all.find((image) => !image.naturalWidth);
            missing?.scrollIntoView({ inline: "center", block: "nearest" });
            return all.length > 0 && !missing;
        }"""
        self.wait(f"pictures of {shelf}", lambda: self.page.locator(f"#{shelf} img").evaluate_all(script))

    def drop(self, selector: str, files: dict[str, bytes]) -> None:
        """As when files are let go over an element, in its middle."""
        contents = {name: base64.b64encode(data).decode() for name, data in files.items()}
        self.page.evaluate(
            """([selector, contents]) => {
                const target = document.querySelector(selector);
                const dataTransfer = new DataTransfer();
                for (const [name, text] of Object.entries(contents)) {
                    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
                    dataTransfer.items.add(new File([bytes], name));
                }
                const { left, top, width, height } = target.getBoundingClientRect();
                const at = { clientX: left + width / 2, clientY: top + height / 2 };
                const options = { dataTransfer, bubbles: true, cancelable: true, ...at };
                for (const kind of ["dragenter", "dragover", "drop"]) {
                    target.dispatchEvent(new DragEvent(kind, options));
                }
            }""",
            [selector, contents],
        )

    def shot(self, click: str) -> bytes:
        """The file that a click hands out, on an item of the menu Export or elsewhere."""
        if click.startswith("#download"):
            self.page.click("#export")
        with self.page.expect_download() as waiting:
            self.page.click(click)
            now = self.page.get_by_role("button", name="Save now")
            if now.is_visible():
                now.click()
        return waiting.value.path().read_bytes()

    def field(self, name: str, kind: str = "range", form: str = "#panel") -> str:
        """The control of a field: its `range`, the `number` beside it, or a colour's `text`."""
        inputs = {"number": "input.number", "text": "input.entry:not(.number)"}
        return f"{form} [data-field={name}] {inputs.get(kind, f'input[type={kind}]')}"


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
