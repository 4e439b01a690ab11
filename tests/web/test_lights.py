"""Lights as things: added where they light the selection, marked in the picture, and slid round it by hand."""

from __future__ import annotations

import io
from typing import Any

import httpx
import numpy as np
import pytest

from tests.serving import Server
from tests.web.editing import document
from tests.web.editor import Editor

SETTINGS = {"width": 48, "height": 48, "max_samples": 64, "max_bounces": 3, "seed": 1}


def add(editor: Editor, title: str) -> Any:
    """The scene after a light was added."""
    count = editor.page.locator("#outline-list [role=treeitem]").count()
    editor.outline(shown=True)
    editor.page.select_option("#add", label=title)
    editor.wait(title, lambda: editor.page.locator("#outline-list [role=treeitem]").count() == count + 1)
    return document(editor)


def radiance(server: Server, scene: Any) -> float:
    """The mean luminance of the ball in the middle of the picture."""
    body = {"scene": scene, "settings": SETTINGS}
    answer = httpx.post(f"{server.url}/v1/render?format=npy", json=body, timeout=180).raise_for_status()
    image = np.load(io.BytesIO(answer.content))[12:36, 12:36, :3]
    return float((image @ [0.2126, 0.7152, 0.0722]).mean())


def aim(quad: Any) -> tuple[np.ndarray, np.ndarray]:
    """The middle of a rectangle, and the direction to which it shines."""
    origin, u, v = (np.array(quad[name]) for name in ("origin", "u", "v"))
    normal = np.cross(u, v)
    return origin + (u + v) / 2, normal / np.linalg.norm(normal)


def test_area_lights_are_aimed_at_the_selection_and_slide_round_it(editor: Editor, server: Server) -> None:
    page = editor.page
    editor.settled()
    before = document(editor)
    first = add(editor, "Area light")
    ball = np.array([0, 1, 0])
    middle, normal = aim(first["shapes"][2])
    way = ball - middle
    assert normal @ way / np.linalg.norm(way) == pytest.approx(1, abs=1e-3), "it faces the ball"
    lamp = first["materials"]["Area light"]
    assert lamp["emission"] > 0 and editor.chosen("materials") == "Area light"
    gain = radiance(server, first) / radiance(server, before)
    assert 1.2 < gain < 1.7, f"half a stop over what is there, not {gain:.2f} times"

    second = add(editor, "Area light")
    other, normal = aim(second["shapes"][3])
    assert normal @ (ball - other) > 0.99 * np.linalg.norm(ball - other), "at the ball again, not at the first light"
    cosine = (middle - ball) @ (other - ball) / np.linalg.norm(middle - ball) / np.linalg.norm(other - ball)
    assert cosine < np.cos(np.radians(40)), "from another side"

    # The mark of a light outside the frame stands at its edge.
    mark = page.locator("#markers .mark.chosen")
    box = mark.bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    def slide(right: float, down: float) -> Any:
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x + right / 2, y + down / 2)
        page.mouse.move(x + right, y + down)
        page.mouse.up()
        return aim(document(editor)["shapes"][3])

    slid, normal = slide(-60, 0)
    distance = np.linalg.norm(other - ball)
    assert np.linalg.norm(slid - other) > 0.2 and np.linalg.norm(slid - ball) == pytest.approx(distance, rel=1e-3)
    assert normal @ (ball - slid) == pytest.approx(distance, rel=1e-3), "and it still faces the ball"
    page.keyboard.press("Control+z")
    assert aim(document(editor)["shapes"][3])[0] == pytest.approx(other), "one step of undo"

    mark.focus()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Shift+ArrowUp")
    stepped, normal = aim(document(editor)["shapes"][3])
    assert np.linalg.norm(stepped - ball) == pytest.approx(1.04 * distance, rel=1e-3), "Shift changes the distance"
    assert normal @ (ball - stepped) == pytest.approx(1.04 * distance, rel=1e-3)

    page.click("#outline-list [data-thing='/shapes/0']")
    assert page.is_hidden("#markers"), "nothing lies over the picture while materials are looked at"


def test_marks_and_strengths(editor: Editor) -> None:
    page = editor.page
    editor.settled()
    page.click("#outline-list [data-thing='/camera']")
    assert page.locator("#markers .mark").count() == 0, (
        "what the camera looks at has a mark only where it is asked for"
    )
    editor.tab("view")
    page.check("#show-target")
    page.keyboard.press("Escape")
    assert page.get_by_role("button", name="What the camera looks at").count() == 1

    scene = add(editor, "Sphere light")
    (lamp,) = [shape for shape in scene["shapes"] if shape["material"] == "Sphere light"]
    assert lamp["type"] == "sphere" and lamp["center"][1] > 1
    for _ in range(14):
        page.locator("#stage").press("-")
    outline = page.locator("#markers .lamp.chosen")
    editor.wait("its outline", lambda: outline.count() == 1)
    page.locator("#outline-list [data-thing='/camera']").click()
    page.locator("#markers .lamp").click(force=True)
    assert page.get_attribute("#outline-list [data-thing='/shapes/2']", "aria-selected") == "true"

    scene = add(editor, "Disk light")
    (disk,) = [shape for shape in scene["shapes"] if shape["type"] == "disk"]
    way = np.array([0, 1, 0]) - disk["center"]
    assert np.array(disk["normal"]) @ way / np.linalg.norm(way) == pytest.approx(1, abs=1e-3), "it faces the ball"
    page.locator("#markers .mark.chosen").focus()
    page.keyboard.press("ArrowRight")
    slid = document(editor)["shapes"][3]
    way = np.array([0, 1, 0]) - slid["center"]
    assert slid["center"] != disk["center"] and slid["radius"] == disk["radius"] and "transform" not in slid
    assert np.array(slid["normal"]) @ way / np.linalg.norm(way) == pytest.approx(1, abs=1e-3), "and still does"

    scene = add(editor, "Tube light")
    (tube,) = [shape for shape in scene["shapes"] if shape["type"] == "cylinder"]
    way = np.array([0, 1, 0]) - np.add(tube["base"], np.divide(tube["axis"], 2))
    assert abs(np.array(tube["axis"]) @ way) < 1e-3 * np.linalg.norm(way), "it lies across the way to the ball"
    page.locator("#markers .mark.chosen").focus()
    page.keyboard.press("ArrowRight")
    turned = document(editor)["shapes"][4]
    assert turned["base"] != tube["base"] and turned["radius"] == tube["radius"] and "transform" not in turned

    scene = add(editor, "Point light")
    strength = page.get_by_role("slider", name="Intensity, strength")
    assert "stops" in str(strength.get_attribute("aria-valuetext"))
    stops = page.get_by_label("Intensity, strength in stops")
    before = scene["lights"][0]["intensity"]
    shown = float(stops.input_value())
    assert 2**shown == pytest.approx(before, rel=0.01)
    stops.fill(str(shown + 9))
    stops.press("Enter")
    editor.wait("nine stops more", lambda: np.max(document(editor)["lights"][0]["intensity"]) > 400 * before)
    assert 0.5 < float(strength.input_value()) < 1, "the slider reaches as far as the value"

    page.click("#outline-list [data-thing='/environment']")
    page.get_by_role("slider", name="Environment rotation").fill("90")
    assert document(editor)["environment"]["rotation"] == 90


def test_a_lamp_is_set_as_a_photographer_does(editor: Editor) -> None:
    """By temperature, stops, size and distance; what it is besides stands below, folded."""
    page = editor.page
    editor.settled()
    before = add(editor, "Area light")
    quad = before["shapes"][2]
    page.locator("#lamp-part [data-field=temperature]").wait_for()

    def value(name: str, label: str) -> Any:
        return page.locator(f"#lamp-part [data-field={name}]").get_by_label(label)

    def lamp() -> Any:
        return document(editor)["materials"]["Area light"]["emission"]

    assert page.is_hidden("#material-part") and page.is_hidden("#thing-form")
    warmth = value("temperature", "Colour temperature: a temperature or a colour")
    assert "2700K" in page.inner_text("#lamp-part"), "that it may be typed is seen"
    power = max(lamp() if isinstance(lamp(), list) else [lamp()])
    warmth.fill("2700K")
    warmth.press("Enter")
    red, green, blue = lamp()
    assert red > green > blue > 0 and np.dot(lamp(), [0.2126, 0.7152, 0.0722]) == pytest.approx(power, rel=1e-3)
    slider = page.get_by_role("slider", name="Colour temperature")
    assert slider.get_attribute("aria-valuetext") == "2\u202f700 K, Tungsten"
    page.get_by_label("Colour temperature, by name").select_option("10000")
    assert lamp()[2] > lamp()[0], "the sky is blue"
    warmth.fill("#00ff00")
    warmth.press("Enter")
    assert slider.get_attribute("aria-valuetext") == "own colour" and warmth.input_value() == ""

    stops = value("power", "Emission, strength in stops")
    stops.fill("3")
    stops.press("Enter")
    assert np.dot(lamp(), [0.2126, 0.7152, 0.0722]) == pytest.approx(8, rel=1e-3)
    width = value("width", "Width, number")
    width.fill("52 cm")
    width.press("Enter")
    after = document(editor)["shapes"][2]
    assert np.linalg.norm(after["u"]) == pytest.approx(0.52) and np.linalg.norm(after["v"]) == pytest.approx(
        np.linalg.norm(quad["v"])
    )
    share = np.linalg.norm(quad["u"]) / 0.52
    assert np.dot(lamp(), [0.2126, 0.7152, 0.0722]) == pytest.approx(8 * share, rel=1e-3), "as much light as before"
    page.keyboard.press("Escape")
    page.click("#undo")
    assert document(editor)["shapes"][2]["u"] == quad["u"], "size and light are one step of undo"
    distance = value("distance", "Distance, number")
    distance.fill("3 m")
    distance.press("Enter")
    assert np.linalg.norm(aim(document(editor)["shapes"][2])[0] - [0, 1, 0]) == pytest.approx(3, rel=1e-3)

    more = page.get_by_role("button", name="More", exact=True)
    assert more.get_attribute("aria-expanded") == "false"
    more.click()
    assert page.is_visible("#material-form [data-field=albedo]") and page.is_visible("#thing-form [data-field=u]")
    assert editor.complaints == []


def test_arrows_lead_to_lamps_outside_of_the_picture(editor: Editor) -> None:
    page = editor.page
    editor.settled()
    add(editor, "Area light")
    add(editor, "Spot light")
    marks = page.locator("#markers .mark.outside")
    assert marks.count() == 2
    bar = page.locator("#tools").bounding_box()
    assert bar
    for i in range(2):
        box = marks.nth(i).bounding_box()
        assert box
        beside = box["x"] > bar["x"] + bar["width"] or box["x"] + box["width"] < bar["x"]
        assert beside or box["y"] >= bar["y"] + bar["height"], "clear of the tools"
    page.locator("#markers .mark.outside:not(.chosen)").click()
    assert page.get_attribute("#outline-list [data-thing='/shapes/2']", "aria-selected") == "true"
    page.click("#outline-list [data-thing='/shapes/0']")
    assert page.is_hidden("#markers")
    page.click("[data-tool=highlight]")
    editor.wait("the marks", lambda: page.is_visible("#markers"))
