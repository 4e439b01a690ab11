"""A parameter at several values side by side, of which one is taken."""

from __future__ import annotations

from typing import Any

import httpx
import pytest
from playwright.sync_api import Page

from tests.serving import Server
from tests.web.editing import document
from tests.web.editor import Editor

PICTURES = ".sweep [role=option]"
VALUES = (
    """() => [...document.querySelectorAll(".sweep [role=option]")].map(({ dataset }) => Number(dataset.value))"""
)
# The mean of each picture of the strip; none where one is not there yet.
MEANS = """() => {
    const all = [...document.querySelectorAll(".sweep img")];
    if (!all.length || !all.every((image) => image.complete && image.naturalWidth)) return null;
    return all.map((image) => {
        const canvas = new OffscreenCanvas(image.naturalWidth, image.naturalHeight);
        const context = canvas.getContext("2d");
        context.drawImage(image, 0, 0);
        const { data } = context.getImageData(0, 0, canvas.width, canvas.height);
        return data.reduce((sum, each) => sum + each, 0) / data.length;
    });
}"""


@pytest.fixture
def batches(editor: Editor) -> list[Any]:
    """What the server answered to each batch that the page started."""
    started: list[Any] = []

    def note(response: Any) -> None:
        if response.request.method == "POST" and response.url.endswith("/v1/batches"):
            started.append(response.json())

    editor.page.on("response", note)
    return started


def sweep(editor: Editor, name: str) -> None:
    """Open the strip of a parameter, which the hand has been at."""
    editor.tab("material")
    editor.unfold()
    editor.page.focus(editor.field(name, form="#material-form"))
    editor.act("sweep-material")
    editor.page.wait_for_selector(PICTURES)


def material(editor: Editor) -> Any:
    return document(editor)["materials"]["Red paint"]


def focused(page: Page) -> str:
    return str(page.evaluate("document.activeElement.dataset.value ?? document.activeElement.id"))


def test_a_click_takes_a_value(editor: Editor, batches: list[Any], server: Server) -> None:
    page = editor.page
    assert not [url for url in editor.requests if "sweep" in url], "nobody asked for it yet"
    before = material(editor)
    sweep(editor, "roughness")
    assert page.get_by_role("listbox", name="Sweep of Roughness").is_visible()
    values = page.evaluate(VALUES)
    assert values == sorted(values) and (values[0], values[-1], len(values)) == (0, 1, 7)
    now = page.locator(".sweep [aria-selected=true]")
    assert float(now.get_attribute("data-value") or "") == before["roughness"]
    assert now.get_by_role("img").count() == 1
    assert (now.get_attribute("aria-label") or "").endswith(", now")

    editor.wait("all pictures", lambda: page.evaluate(MEANS))
    means = page.evaluate(MEANS)
    assert len(set(means)) == len(means), "each is another picture"
    editor.wait("the end", lambda: "Choose a picture" in editor.text(".sweeping [role=status]"))
    page.click(f"{PICTURES} >> nth=-1")
    assert page.locator(".sweeping").count() == 0
    assert material(editor) == before | {"roughness": 1}
    page.click("#undo")
    assert material(editor) == before, "one step takes it back"
    editor.wait("that the batch is gone", lambda: status(server, batches[0]["id"]).status_code == 410)
    assert editor.complaints == [] and editor.text("#messages") == ""


def status(server: Server, id: str) -> httpx.Response:
    return server.http.get(f"/v1/batches/{id}")


def test_escape_leaves_everything_as_it_was(editor: Editor, batches: list[Any], server: Server) -> None:
    page = editor.page
    before = material(editor)
    # Renders that cannot be over when the key is pressed.
    endless = """(() => {
        const send = window.fetch;
        window.fetch = (url, init) => {
            if (!init?.body || !String(url).endsWith("/batches")) return send(url, init);
            const order = JSON.parse(init.body);
            order.settings.max_samples = 1 << 20;
            return send(url, { ...init, body: JSON.stringify(order) });
        };
    })()"""
    page.evaluate(endless)
    sweep(editor, "roughness")
    editor.wait("the batch", lambda: batches)
    page.keyboard.press("Escape")
    assert page.locator(".sweeping").count() == 0
    assert focused(page) == "material-more", "the keyboard goes on where it was"
    editor.wait("its end", lambda: status(server, batches[0]["id"]).json().get("state") == "cancelled")
    assert material(editor) == before and page.is_disabled("#undo")
    # Another parameter in the place of the first one: that one's batch is left, too.
    sweep(editor, "roughness")
    editor.wait("the second batch", lambda: len(batches) == 2)
    page.get_by_label("Parameter", exact=True).select_option("metallic")
    assert page.get_by_role("listbox", name="Sweep of Metallic").is_visible()
    editor.wait("its end", lambda: status(server, batches[1]["id"]).json().get("state") == "cancelled")
    page.click(".sweeping >> text=Close")
    editor.wait("the third batch", lambda: len(batches) == 3)
    editor.wait("its end", lambda: status(server, batches[2]["id"]).json().get("state") == "cancelled")
    assert editor.complaints == []


def test_the_keyboard_is_enough(editor: Editor) -> None:
    page = editor.page
    before = material(editor)
    editor.tab("material")
    page.focus(editor.field("metallic", form="#material-form"))
    page.focus("#material-more")
    page.keyboard.press("Enter")
    page.keyboard.press("End")
    for _ in range(10):
        if focused(page) == "sweep-material":
            break
        page.keyboard.press("ArrowUp")
    page.keyboard.press("Enter")
    page.wait_for_selector(PICTURES)
    for _ in range(4):
        if page.evaluate("document.activeElement.role") == "option":
            break
        page.keyboard.press("Tab")
    values = page.evaluate(VALUES)
    present = before.get("metallic", 0)
    assert float(focused(page)) == present, "the present value is where the keyboard begins"
    page.keyboard.press("End")
    page.keyboard.press("ArrowLeft")
    assert float(focused(page)) == values[-2] != present
    page.keyboard.press("Enter")
    assert page.locator(".sweeping").count() == 0
    assert material(editor) == before | {"metallic": values[-2]}
    assert editor.complaints == []


def test_a_refusal_is_put_in_words(editor: Editor) -> None:
    page = editor.page
    refusal = """{"type": "about:blank", "title": "Unprocessable", "status": 422, "errors": [{"pointer":
        "/over/0/values/3", "detail": "/scene/materials/Red paint/roughness: must be at most 0.5"}]}"""
    headers = {"content-type": "application/problem+json"}
    page.route("**/v1/batches", lambda route: route.fulfill(status=422, headers=headers, body=refusal))
    sweep(editor, "roughness")
    said = page.locator(".sweeping [role=alert]")
    said.wait_for()
    assert said.inner_text() == "Roughness of material Red paint must be at most 0.5."
    page.keyboard.press("Escape")
    assert page.locator(".sweeping").count() == 0


def test_values_go_along_the_range(page: Page) -> None:
    """From end to end, by equal steps or equal factors, with the present one among them."""
    script = """async ([field, material]) => {
        const { sweepValues } = await import("/document/sweep.js");
        return sweepValues([field], material, { open: {}, name: "x", ...field });
    }"""
    plain = {"name": "x", "soft": {"min": 0, "max": 1.2}, "step": 0.01, "initial": 0.5}

    def values(field: dict[str, Any], material: dict[str, Any] | None = None) -> Any:
        return page.evaluate(script, [plain | field, material or {}])

    assert values({"initial": None}) == [0, 0.2, 0.4, 0.6, 0.8, 1, 1.2]
    assert values({}) == [0, 0.2, 0.5, 0.6, 0.8, 1, 1.2], "the neighbour makes room"
    assert values({}, {"x": 0.01}) == [0, 0.01, 0.4, 0.6, 0.8, 1, 1.2], "the ends stay"
    assert values({}, {"x": 3}) == [0, 0.2, 0.4, 0.6, 0.8, 1, 1.2, 3], "beyond the slider's end"
    assert values({"soft": {"min": 1, "max": 3}, "step": 1, "initial": 2}) == [1, 2, 3], "whole numbers, each once"
    assert values({"open": {"min": 0}, "initial": None})[0] == 0.01, "a bound that does not belong to the range"
    far = {"ranges": {"field": "model", "bounds": {}}, "soft": {"min": 1, "max": 1e6}, "initial": None}
    assert values(far) == [1, 10, 100, 1000, 10000, 100000, 1000000]
