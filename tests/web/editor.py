"""The editor's page, and what a test asks of it."""

from __future__ import annotations

import base64
import time
from collections.abc import Callable

import pytest
from playwright.sync_api import Page

from service.worker.view.prior import WORTH

GUESSED = WORTH[-1][0]  # samples of a picture until which the one before has a part in it
MENUS = {"save": ("#scene-menu", "#page-save"), "view": ("#view", "#view-menu")}
PATIENCE_S = 180.0  # a bound against hanging: whoever uses the machine meanwhile may take most of it
# Whether something comes to hold within some seconds: asked in the page, that costs next to nothing.
SOON = """async (holds) => {
    const find = (selector) => document.querySelector(selector);
    // The text as it stands: as it is seen, the page would be laid out for each look.
    const samples = () => parseInt(find("#samples")?.textContent.split("/")[0].replace(/\\D/g, "") || "0");
    const tests = {
        opened: () => samples() >= 1 && performance.getEntriesByName("all parts").length > 0,
        settled: () => find("#stage[aria-busy=false]") && !find("#preview").checkVisibility()
            && (samples() >= 8 || find("#state").textContent === "Done"),
    };
    for (let i = 0; i < 200; i++) {
        if (tests[holds]()) return true;
        await new Promise((resolve) => setTimeout(resolve, 25));
    }
    return false;
}"""
OPENED, SETTLED = "opened", "settled"


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

    def told(self) -> str:
        """What the message at the stage's foot says, with the lines that it has folded away."""
        return " ".join((self.page.text_content("#messages") or "").split())

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

    def settled_alone(self) -> list[float]:
        """The pixels once the picture before the edit has no part in them, to compare with a later one."""
        self.settled()
        self.wait("samples of its own", lambda: self.samples() >= GUESSED)
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
                if page.is_hidden(button):  # a small window has one button for the tools
                    page.click("#open-tools")
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

    def compare(self) -> None:
        """Begin to compare, with all of the bar open: where it is narrow, one button has the rest of it."""
        self.page.click("#compare")
        self.page.wait_for_selector("#comparison .close", state="visible")
        rest = self.page.locator("#comparison .more-of-it")
        if rest.is_visible() and rest.get_attribute("aria-expanded") == "false":
            rest.click()

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
