"""A click says where a highlight lies: there the chosen light, or the environment, is mirrored."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from typing import Any

import httpx
import numpy as np
import pytest

from tests.serving import Server
from tests.web.editing import document, point
from tests.web.editor import Editor

BALL: dict[str, Any] = {
    "version": 1,
    "camera": {"position": [0, 1, 6], "target": [0, 1, 0], "vfov": 30},
    "materials": {
        "mirror": {"type": "principled", "base_color": 0.9, "metallic": 1, "roughness": 0.1},
        "lamp": {"type": "diffuse", "albedo": 0, "emission": 40},
    },
    "shapes": [
        {"type": "sphere", "center": [0, 1, 0], "radius": 1, "material": "mirror"},
        {"type": "quad", "origin": [-2.65, 4.35, -0.5], "u": [0, 0, 1], "v": [-0.7, -0.7, 0], "material": "lamp"},
    ],
}
SETTINGS = {"width": 96, "height": 96, "max_samples": 16, "max_bounces": 2, "seed": 1}


def brightest(server: Server, scene: Any) -> np.ndarray:
    """Where a square picture is brightest, from its middle: x to the right and y up, in its heights."""
    body = {"scene": scene, "settings": SETTINGS}
    answer = httpx.post(f"{server.url}/v1/render?format=npy", json=body, timeout=180).raise_for_status()
    light = np.load(io.BytesIO(answer.content))[..., :3] @ [0.2126, 0.7152, 0.0722]
    rows, columns = np.nonzero(light > 0.5 * light.max())
    return np.array([columns.mean() + 0.5, 96 - rows.mean() - 0.5]) / 96 - 0.5


def paste(editor: Editor, scene: Any) -> None:
    editor.page.evaluate("(text) => { navigator.clipboard.readText = async () => text; }", json.dumps(scene))
    editor.act("paste-material")
    count = len(scene["shapes"])
    editor.outline(shown=True)
    places = editor.page.locator("#outline-list [data-thing^='/shapes/']")
    editor.wait("the scene", lambda: places.count() == count)
    editor.settled()


def at(editor: Editor, right: float, up: float) -> tuple[float, float]:
    """On the page: a place of the picture, from its middle, in its heights."""
    x, y = point(editor, 0.5, 0.5)
    box = editor.page.locator(".framing").bounding_box()
    assert box is not None
    return x + right * box["height"], y - up * box["height"]


def click_until(editor: Editor, right: float, up: float, reached: Callable[[], object], *keys: str) -> None:
    """Click there with these keys held, again whenever the page says that its picture was not ready for that."""
    early = editor.page.locator("#messages button", has_text="×")

    def answered() -> bool:
        return bool(reached()) or "Click again" in editor.text("#messages")

    def clicked() -> bool:
        for key in keys:
            editor.page.keyboard.down(key)
        editor.page.mouse.click(*at(editor, right, up))
        for key in keys:
            editor.page.keyboard.up(key)
        editor.wait("an answer", answered)
        if not reached():
            early.first.click()
        return bool(reached())

    editor.wait("a highlight", clicked)


def test_a_click_puts_the_chosen_lamp_where_it_is_mirrored(editor: Editor, server: Server) -> None:
    page = editor.page
    paste(editor, BALL)
    page.keyboard.press("8")
    page.mouse.click(*at(editor, 0.15, 0.1))
    editor.wait("a word", lambda: "Select a light" in editor.text("#messages"))
    assert document(editor)["shapes"] == BALL["shapes"]

    page.click("#outline-list [data-thing='/shapes/1']")
    page.click("#tools [data-tool=highlight]")
    click_until(editor, 0.15, 0.1, lambda: document(editor)["shapes"] != BALL["shapes"])
    moved = document(editor)
    assert brightest(server, BALL) != pytest.approx([0.15, 0.1], abs=0.1)
    assert brightest(server, moved) == pytest.approx([0.15, 0.1], abs=0.02)
    before, after = (
        np.array(scene["shapes"][1]["origin"]) + (np.array(scene["shapes"][1]["u"]) + scene["shapes"][1]["v"]) / 2
        for scene in (BALL, moved)
    )
    ball = np.array([0, 1, 0])
    assert np.linalg.norm(after - ball) == pytest.approx(np.linalg.norm(before - ball), rel=1e-4), "on its sphere"
    page.keyboard.press("Control+z")
    assert document(editor)["shapes"] == BALL["shapes"], "one step of undo"


@pytest.mark.slow
def test_alt_click_turns_the_environment_to_its_highlight(editor: Editor, server: Server) -> None:
    page = editor.page
    sky = {"type": "sky", "sun_elevation": 20, "sun_azimuth": 100, "turbidity": 6}
    scene = {**BALL, "shapes": BALL["shapes"][:1], "environment": {**sky, "rotation": 10, "background": False}}
    paste(editor, scene)
    page.click("#outline-list [data-thing='/environment']")
    click_until(editor, -0.2, 0.05, lambda: document(editor)["environment"]["rotation"] != 10, "Alt")
    turned = document(editor)
    assert brightest(server, scene)[0] != pytest.approx(-0.2, abs=0.1)
    assert brightest(server, turned)[0] == pytest.approx(-0.2, abs=0.03)
    page.keyboard.press("Control+z")
    assert document(editor)["environment"]["rotation"] == 10


def test_the_environment_is_a_ball_in_a_ring_that_turns_it(editor: Editor) -> None:
    page = editor.page
    editor.outline(shown=True)
    page.click("#outline-list [data-thing='/environment']")
    script = """() => {
        const canvas = document.querySelector("#environment-ball canvas");
        return [...canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data].join();
    }"""
    editor.wait("a ball", lambda: page.evaluate("document.querySelector('#environment-ball canvas')?.width") == 96)
    before = page.evaluate(script)
    ring = page.get_by_role("slider", name="Turn of the ball")
    box = ring.bounding_box()
    assert box is not None
    x, y, radius = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2, box["width"] / 2
    page.mouse.move(x, y - radius + 3)
    page.mouse.down()
    page.mouse.move(x - radius + 3, y - 10)
    page.mouse.move(x - radius + 3, y)
    page.mouse.up()
    assert document(editor)["environment"]["rotation"] == 90
    editor.wait("another ball", lambda: page.evaluate(script) != before)
    ring.press("PageUp")
    assert document(editor)["environment"]["rotation"] == 105
    page.keyboard.press("Control+z")
    page.keyboard.press("Control+z")
    assert document(editor)["environment"].get("rotation", 0) == 0, "one step of undo for each"

    stops = page.get_by_label("Brightness, strength in stops")
    assert stops.input_value() == "0"
    stops.fill("-1.5")
    stops.press("Enter")
    assert document(editor)["environment"]["scale"] == pytest.approx(2**-1.5, rel=1e-4)
