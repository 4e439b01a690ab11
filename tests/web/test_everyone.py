"""Everybody can work here: keys, names, contrast, small windows; and what a server may say instead of a picture."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, WebSocketRoute
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from gpu import Renderer
from tests.marks import seldom
from tests.serving import Server
from tests.web.editing import camera, keep_on
from tests.web.editor import Editor

SERIOUS = {"serious", "critical"}


def findings(editor: Editor, *parts: str) -> list[str]:
    """In these parts of the page, or in all of it."""
    context = {"include": [[part] for part in parts]} if parts else None
    response = Axe().run(editor.page, context=context).response
    return [
        f"{found['id']}: {node['html'][:120]}"
        for found in response["violations"]
        if found["impact"] in SERIOUS
        for node in found["nodes"]
    ]


@pytest.mark.parametrize("scheme", seldom(["dark", "light"], ["light"]))
def test_axe_finds_nothing_serious(visit: Callable[..., Editor], scheme: Any) -> None:
    """All of the page takes 2 s of a processor: at the begin, with most of what lies over the picture, and with the
    longest form; else what has just come."""
    editor = visit((1280, 800), scale=1, color_scheme=scheme)
    assert findings(editor) == []
    editor.page.click("#pause")  # what is drawn on meanwhile would be most of the work
    for tab, *parts in (
        ("scene", "#outliner", "#panel"),
        ("film", "#panel"),
        ("render", "#panel"),
        ("view", "#view-menu"),
        ("save", "#page-save"),
        ("material", "#panel"),
    ):
        editor.tab(tab)
        assert findings(editor, *parts) == [], tab
    for button, part in {
        "#export": "#export-menu",
        "#material-more": "#material-menu",
        "#readings-button": "#readings",
        "#tab-environments": "#shelf",
        "#tab-scenes": "#shelf",
        "#tab-renders": "#shelf",
    }.items():
        editor.page.click(button)
        assert findings(editor, part) == [], button
        editor.page.keyboard.press("Escape")
    editor.unfold()
    assert findings(editor) == [], "all that a material has"
    editor.act("sweep-material")
    editor.page.wait_for_selector(".sweep [role=option]")
    assert findings(editor, ".sweeping") == [], "a parameter at several values"
    editor.page.keyboard.press("Escape")
    editor.page.click("[data-field=roughness] .image")
    assert findings(editor, "dialog[open]") == [], "what is offered as an image"
    editor.page.keyboard.press("Escape")
    editor.page.evaluate("document.activeElement.blur()")
    editor.page.keyboard.press("c")
    editor.page.keyboard.press("7")
    editor.wait("both", lambda: editor.page.is_visible("#comparison") and editor.page.is_visible("#probe"))
    assert findings(editor) == []
    editor.page.keyboard.press("?")
    editor.page.wait_for_selector("#keys-dialog[open]")
    assert findings(editor, "#keys-dialog") == []


def test_nothing_is_cut_off(visit: Callable[..., Editor]) -> None:
    """Whatever the window becomes: among them a phone both ways, and a laptop at 200 %."""
    script = """() => [...document.querySelectorAll("button, input, select, [role=option]")]
        .filter((each) => each.checkVisibility() && !each.closest(".drawer, .outline, .unseen"))
        .filter((each) => {
            const box = each.getBoundingClientRect();
            return box.left < -1 || box.right > innerWidth + 1 || box.width < 8;
        }).map((each) => each.outerHTML.slice(0, 100))"""
    editor = visit((1920, 1080), scale=1)
    for size in ((1920, 1080), (1280, 800), (844, 390), (640, 400), (390, 844)):
        editor.page.set_viewport_size({"width": size[0], "height": size[1]})
        for tab in ("film", "scene", "render", "save", "material"):
            editor.tab(tab)
            assert editor.page.evaluate(script) == [], (size, tab)
            editor.page.evaluate("document.querySelector('.page:not([hidden]) > :last-child').scrollIntoView()")
            top = editor.page.evaluate("document.scrollingElement.scrollTop")
            assert top == 0, f"only the panel scrolls: {size}, {tab}"
        box = editor.page.locator("#stage").bounding_box()
        assert box is not None
        assert box["width"] * box["height"] > 0.2 * size[0] * size[1], f"the picture has room: {size}"
        assert editor.page.evaluate("document.documentElement.scrollWidth") <= size[0], size


SMALL = """() => {
    const rem = parseFloat(getComputedStyle(document.documentElement).fontSize);
    const said = [...document.querySelectorAll("body *")]
        .filter((each) => each.checkVisibility() && !each.closest(".unseen, svg"));
    const isCoarse = matchMedia("(pointer: coarse)").matches;
    const small = (each) => {
        const letters = parseFloat(getComputedStyle(each).fontSize);
        const isPointed = each.matches("[type=range], [type=checkbox], [type=color], [type=file]");
        const writes = each.matches("select, textarea, input") && !isPointed;
        const { width, height } = each.getBoundingClientRect();
        const isHit = each.matches("button, select, summary, [role=option], input:not(.divider, [type=file])");
        const hasText = [...each.childNodes].some((node) => node.nodeType === 3 && node.data.trim());
        if (hasText && letters < 11) return "letters";
        if (isCoarse && writes && letters < 16) return "iOS zooms into it";
        const least = each.closest(".tools") ? 38 : 39.5; // nine beside each other on a phone
        if (isCoarse && isHit && Math.min(width, height) < least) return `${width} x ${height}`;
        return each.matches(".page, .top") && each.scrollWidth > each.clientWidth + 1 ? "scrolls sideways" : null;
    };
    const found = said.map((each) => [small(each), each.outerHTML.slice(0, 90)]).filter(([what]) => what);
    return rem === 16 ? found : [["a rem", rem], ...found];
}"""


@pytest.mark.parametrize(
    ("touch", "sizes"), [(True, [(390, 844), (844, 390)]), (False, [(1024, 768), (720, 450)])], ids=["touch", "mouse"]
)
def test_letters_can_be_read_and_fingers_hit(
    visit: Callable[..., Editor], touch: bool, sizes: list[tuple[int, int]]
) -> None:
    """A phone both ways, a tablet's size, and a laptop at 200 %."""
    editor = visit(sizes[0], scale=1, touch=touch)
    page = editor.page
    page.click("#compare")
    for size in sizes:
        page.set_viewport_size({"width": size[0], "height": size[1]})
        for tab in ("film", "scene", "render", "view", "save", "material"):
            editor.tab(tab)
            assert page.evaluate(SMALL) == [], (size, tab)


def test_the_keyboard_reaches_everything(editor: Editor) -> None:
    before = editor.settled()
    editor.page.keyboard.press("?")
    editor.page.wait_for_selector("#keys-dialog", state="visible")  # it is fetched for the first key
    assert editor.page.locator("#keys dt").count() > 20
    editor.page.keyboard.press("Escape")
    assert editor.page.is_hidden("#keys-dialog")
    editor.page.locator("#tab-properties").focus()
    editor.page.keyboard.press("ArrowRight")
    assert editor.page.is_visible("#page-render")
    editor.page.keyboard.press("ArrowRight")
    assert editor.page.is_visible("#page-properties")
    editor.page.locator("#outline-list").focus()
    editor.page.keyboard.press("Home")
    assert editor.text("#thing-title") == "Camera"
    editor.page.keyboard.press("ArrowDown")
    assert editor.text("#thing-title") == "Environment"
    # What has the focus shows it.
    editor.page.keyboard.press("Tab")
    outline = editor.page.evaluate("getComputedStyle(document.activeElement).outlineStyle")
    assert outline != "none"
    position = camera(editor)["position"]
    editor.page.locator("#stage").focus()
    editor.page.keyboard.press("ArrowLeft")
    editor.wait_for_change(before, 0.5)
    assert camera(editor)["position"] != position


def test_live_regions_do_not_chatter(editor: Editor) -> None:
    keep_on(editor)
    editor.settled()
    editor.page.evaluate("""() => {
        window.spoken = 0;
        const said = ":is([role=status], [role=alert], [aria-live]):not([aria-live=off])";
        for (const region of document.querySelectorAll(said)) {
            new MutationObserver(() => { window.spoken += 1; }).observe(region, { childList: true, subtree: true });
        }
    }""")
    samples = editor.samples()
    editor.wait("more samples", lambda: editor.samples() > samples + 4)
    assert editor.page.evaluate("window.spoken") == 0, "samples are not read out"
    assert editor.page.get_attribute("#announcer", "role") == "status"


def test_motion_and_theme(visit: Callable[..., Editor]) -> None:
    editor = visit(reduced_motion="reduce", color_scheme="dark")
    style = "getComputedStyle(document.getElementById('outline')).transitionDuration"
    assert editor.page.evaluate(style) == "0s"
    panel = "getComputedStyle(document.getElementById('panel')).backgroundColor"
    dark = editor.page.evaluate(panel)
    editor.page.click("#theme")
    light = editor.page.evaluate(panel)
    assert light != dark
    editor.page.reload()
    editor.wait("a picture", lambda: editor.samples() >= 1)
    assert editor.page.evaluate(panel) == light, "the choice is kept"


@pytest.fixture
def strict(gpu: Renderer, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server with a key and room for one."""
    served = Server(tmp_path_factory.mktemp("strict"), SUNBOX_API_KEY="sesame", SUNBOX_MAX_CLIENTS="1")
    served.wait()
    yield served
    served.stop()


def test_a_key_is_asked_for_and_a_full_server_waited_out(strict: Server, browser: Browser) -> None:
    def enter(editor: Editor, key: str) -> None:
        editor.wait("the question", lambda: editor.page.is_visible("#key-dialog"))
        editor.page.fill("#key-entry", key)
        editor.page.keyboard.press("Enter")

    first = Editor(browser.new_page())
    first.page.goto(strict.url + "/")
    enter(first, "wrong")
    first.wait("the answer", lambda: first.page.is_visible("#key-dialog .trouble"))
    enter(first, "sesame")
    first.wait("a picture", lambda: first.samples() >= 1)

    second = Editor(browser.new_page())
    second.page.goto(strict.url + "/")
    enter(second, "sesame")
    second.wait("the reason", lambda: "The server is full" in second.text("#messages"))
    first.page.close()
    second.page.click("text=Try now")
    second.wait("a picture", lambda: second.samples() >= 1)
    assert second.text("#messages") == ""
    second.page.close()


def test_a_cut_connection_takes_its_session_up_again(blank: Editor, server: Server) -> None:
    """Its picture goes on and does not begin anew."""
    editor, page = blank, blank.page
    page.add_init_script("""
        window.sockets = [];
        window.WebSocket = class extends WebSocket {
            said = [];
            constructor(...all) { super(...all); window.sockets.push(this); }
            send(text) { super.send(text); this.said.push(JSON.parse(text).type); }
        };
    """)
    editor.open(server.url)
    keep_on(editor)
    editor.wait("samples", lambda: editor.samples() >= 8)
    samples = editor.samples()
    page.evaluate("window.sockets.at(-1).close()")
    editor.wait("another connection", lambda: page.evaluate("window.sockets.length") > 1)
    editor.wait("the picture", lambda: editor.samples() > samples and editor.text("#messages") == "")
    assert "session=" in page.evaluate("window.sockets.at(-1).url")
    assert page.evaluate("window.sockets.length") == 2
    assert "start" in page.evaluate("window.sockets[0].said")
    assert not {"start", "update"} & set(page.evaluate("window.sockets[1].said")), "nothing is told again"


def test_a_session_that_another_tab_took_goes_on_when_asked(blank: Editor, server: Server) -> None:
    editor = blank
    greetings: list[str] = []

    def listen(data: str | bytes) -> None:
        if isinstance(data, str) and (said := json.loads(data))["type"] == "hello":
            greetings.append(said["session"])

    editor.page.on("websocket", lambda socket: socket.on("framereceived", listen))
    editor.open(server.url)
    url = f"{server.url.replace('http', 'ws')}/v1/stream?session={greetings[0]}"
    with connect(url, subprotocols=[Subprotocol("sunbox.v1")], max_size=None):
        editor.wait("what happened", lambda: "goes on in another tab" in editor.text("#messages"))
        assert editor.text("#state") == "Offline" and editor.page.is_visible("text=Try again")
        editor.page.wait_for_timeout(500)
        assert len(greetings) == 1, "two tabs must not take it from one another in turn"
        editor.page.click("text=Try again")
        editor.wait("a picture", lambda: len(greetings) == 2 and editor.text("#messages") == "")
    assert greetings[0] != greetings[1]
    editor.settled()


def test_a_lost_renderer_is_told_and_waited_for(blank: Editor, server: Server) -> None:
    editor = blank
    routes: list[WebSocketRoute] = []

    def pass_on(route: WebSocketRoute) -> None:
        route.connect_to_server()
        routes.append(route)

    editor.page.route_web_socket("**/v1/stream**", pass_on)
    editor.open(server.url)
    editor.page.evaluate("""() => {
        window.told = [];
        const root = document.querySelector("#messages");
        const watch = new MutationObserver(() => window.told.push(root.innerText));
        watch.observe(root, { childList: true, subtree: true });
    }""")
    routes[-1].close(code=4500, reason="The renderer fell three times.")
    editor.wait("the picture", lambda: len(routes) == 2 and editor.text("#messages") == "")
    told = " ".join(editor.page.evaluate("window.told"))
    assert "The renderer stopped. Your scene is safe here. Trying to reconnect" in told
    editor.settled()
