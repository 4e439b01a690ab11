"""Handles in the picture and the arrow keys: what is selected is moved, turned and scaled."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Page

from service.document.transform import Transform
from tests.web.editing import document
from tests.web.editor import Editor
from tests.web.modules import call

CAMERA: dict[str, Any] = {"position": [0.0, 0.0, 5.0], "target": [0.0, 0.0, 0.0], "up": [0.0, 1.0, 0.0], "vfov": 40}
VIEW = {"camera": CAMERA, "aspect": 1.5, "height": 400}


def drag(editor: Editor, handle: str, right: float, down: float, keep: bool = False) -> None:
    """Of the selection's handle, in CSS pixels; `keep` leaves it in the hand."""
    script = """(handle) => {
        const path = document.querySelector(`#handles [data-handle="${handle}"] .seen`);
        const { left, top } = path.ownerSVGElement.getBoundingClientRect();
        const isRing = path.parentNode.classList.contains("ring");
        const { x, y } = path.getPointAtLength(isRing ? 0.4 * path.getTotalLength() : 60);
        return [left + x, top + y];
    }"""
    x, y = editor.page.evaluate(script, handle)
    mouse = editor.page.mouse
    mouse.move(x, y)
    mouse.down()
    mouse.move(x + right / 2, y + down / 2)
    mouse.move(x + right, y + down)
    if not keep:
        mouse.up()


def tool(editor: Editor, name: str) -> None:
    tools = editor.page.get_by_role("toolbar", name="Picture tools")
    tools.get_by_role("button", name=name, exact=True).click()
    assert tools.get_by_role("button", name=name, exact=True).get_attribute("aria-pressed") == "true"


def subject(editor: Editor) -> Any:
    return document(editor)["shapes"][0]


def test_a_hand_moves_turns_and_scales_the_selection(editor: Editor) -> None:
    page, before = editor.page, editor.settled()
    tool(editor, "Move")
    first = subject(editor)
    drag(editor, "X", 60, 7)
    right = subject(editor)["center"]
    assert 0.2 < right[0] < 2 and right[1:] == first["center"][1:], "along the arrow alone"
    editor.wait_for_change(before)
    drag(editor, "Y", 0, -30)
    lifted = subject(editor)["center"]
    assert lifted[1] > 1.1
    drag(editor, "Y", 0, 26)
    assert subject(editor)["center"][1] == pytest.approx(1), "nearly on the ground is on the ground"
    drag(editor, "Y", 0, -25, keep=True)
    page.keyboard.press("Escape")
    page.mouse.up()
    assert subject(editor)["center"][1] == pytest.approx(1), "Escape gives it back"

    tool(editor, "Rotate")
    drag(editor, "Y", 40, 0)
    turned = subject(editor)["transform"]["rotate"]
    assert 5 < turned[1] < 90 and turned[0] == turned[2] == 0
    for _ in range(5):
        page.keyboard.press("Control+z")
    assert subject(editor) == first and page.is_disabled("#undo"), "a drag is one step of undo"

    tool(editor, "Scale")
    drag(editor, "view", 60, 0)
    assert subject(editor)["radius"] == pytest.approx(math.sqrt(2), rel=0.05)
    drag(editor, "X", 40, 0)
    assert subject(editor)["transform"]["scale"][0] > 1.2
    editor.wait("a picture", lambda: page.get_attribute("#stage", "aria-busy") == "false")
    assert page.locator(".message.refusal").count() == 0


def test_arrow_keys_change_the_selection_by_steps(editor: Editor) -> None:
    page = editor.page
    tool(editor, "Move")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Shift+ArrowUp")
    page.keyboard.press("PageUp")
    assert subject(editor)["center"] == pytest.approx([0.02, 1.02, -0.2]), "hundredths of its size, Shift ten"
    page.locator("#stage").focus()
    page.keyboard.press("End")
    assert subject(editor)["center"] == pytest.approx([0.02, 1, -0.2]), "down on the floor"
    tool(editor, "Rotate")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Shift+ArrowRight")
    assert subject(editor)["transform"]["rotate"] == pytest.approx([0, 11, 0])
    tool(editor, "Scale")
    page.keyboard.press("ArrowUp")
    assert subject(editor)["transform"]["scale"] == pytest.approx([1.01] * 3)
    editor.wait("its size in words", lambda: "Size" in editor.text("#announcer"))
    tool(editor, "Select")
    camera = document(editor)["camera"]
    page.locator("#stage").focus()
    page.keyboard.press("ArrowRight")
    assert document(editor)["camera"] != camera, "else the arrows go around the scene"

    page.click("#outline-list [data-thing='/environment']")
    tool(editor, "Rotate")
    page.keyboard.press("Shift+ArrowLeft")
    assert document(editor)["environment"]["rotation"] == -10
    assert page.locator("#handles [data-handle]").count() == 1, "about the vertical alone"


def drags(page: Page, kind: str, arguments: list[Any], places: list[list[float]]) -> list[Any]:
    """What a drag through these places gives at each of them."""
    script = """async ([kind, args, places]) => {
        const all = await import(new URL("picture/handle-drags.js", location));
        const [from, ...others] = places.map(([x, y]) => ({ x, y }));
        const follow = all[kind](...args, from);
        return others.map(follow);
    }"""
    found: list[Any] = page.evaluate(script, [kind, arguments, places])
    return found


def test_what_a_drag_means(page: Page) -> None:
    height = 2 * 5 * math.tan(math.radians(20))  # of the picture, at the pivot
    pivot = [0, 0, 0]
    (offset,) = drags(page, "moving", [VIEW, pivot, "X"], [[0.6, 0.5], [0.7, 0.5]])
    assert offset == pytest.approx([0.1 * 1.5 * height, 0, 0], abs=1e-9)
    (offset,) = drags(page, "moving", [VIEW, pivot, "view"], [[0.5, 0.5], [0.4, 0.3]])
    assert offset == pytest.approx([-0.15 * height, 0.2 * height, 0], abs=1e-9)
    above, back = VIEW | {"camera": CAMERA | {"position": [0, 1, 5]}}, [[0.5, 0.5], [0.5, 0.4], [0.5, -2]]
    near, beyond = drags(page, "moving", [above, pivot, "plane Y"], back)
    assert near[2] < -0.5 and abs(near[1]) < 1e-9
    assert beyond == near, "beyond the horizon it stays where it was"

    # Two whole turns counter-clockwise about the axis that comes out of the picture.
    circle = [[0.5 + 0.1 * math.cos(t / 2) / 1.5, 0.5 - 0.1 * math.sin(t / 2)] for t in range(26)]
    angles = drags(page, "rotating", [VIEW, pivot, [0, 0, 1]], circle)
    assert angles == pytest.approx([math.degrees(t / 2) for t in range(1, 26)])
    (edge_on,) = drags(page, "rotating", [VIEW, pivot, [0, 1, 0]], [[0.5, 0.5], [0.5 + 80 / 600, 0.5]])
    assert edge_on == pytest.approx(math.degrees(1)), "80 pixels, as far as the ring is wide, are one radian"

    (factor,) = drags(page, "scaling", [VIEW, pivot, [1, 0, 0]], [[0.6, 0.5], [0.7, 0.4]])
    assert factor == pytest.approx(2)
    (factor,) = drags(page, "scaling", [VIEW, pivot, None], [[0.5, 0.5], [0.5, 0.8]])
    assert factor == pytest.approx(0.5)


def points_of(shape: dict[str, Any]) -> np.ndarray:
    """Some points of the shape in the world."""
    if shape["type"] == "sphere":
        local = np.array(shape["center"]) + shape["radius"] * np.vstack([np.eye(3), -np.eye(3)])
    elif shape["type"] == "box":
        local = np.array([shape["min"], shape["max"]])
    else:
        origin, u, v = (np.array(shape[name]) for name in ("origin", "u", "v"))
        local = np.array([origin, origin + u, origin + v])
    matrix = Transform(**shape.get("transform", {})).matrix4()
    return np.asarray(local @ matrix[:3, :3].T + matrix[:3, 3])


TURNED = {"translate": (1, 2, 3), "rotate": (20, 130, -40), "scale": (2, 1, 0.5)}
SHAPES: list[dict[str, Any]] = [
    {"type": "sphere", "center": [1, 2, 3], "radius": 0.5},
    {"type": "sphere", "center": [1, 2, 3], "radius": 0.5, "transform": TURNED},
    {"type": "box", "min": [0, 0, 0], "max": [1, 2, 3]},
    {"type": "box", "min": [0, 0, 0], "max": [1, 2, 3], "transform": TURNED},
    {"type": "quad", "origin": [0, 1, 0], "u": [1, 0.5, 0], "v": [0, 0, -2]},
]


@pytest.mark.parametrize("shape", SHAPES)
def test_shapes_are_turned_and_stretched_about_a_pivot(page: Page, shape: dict[str, Any]) -> None:
    """The points of the changed shape are those of the old one, changed; no transform becomes a matrix that skews."""
    script = """async ([shape, pivot, angle]) => {
        const of = await import(new URL("document/manipulation.js", location));
        const own = of.ownAxes(shape);
        const turned = of.mapped(shape, of.turning([0, 1, 0], angle), pivot);
        return { own, turned, stretched: of.mapped(shape, of.stretching(own[0], 2), pivot),
            grown: of.mapped(shape, of.growing(3), pivot), moved: of.shifted(shape, pivot) };
    }"""
    pivot, angle = np.array([0.5, 1, -2]), 50.0
    made = page.evaluate(script, [shape, pivot.tolist(), angle])
    before = points_of(shape)
    turn = Transform(rotate=(0, angle, 0)).matrix4()[:3, :3]
    axis = np.array(made["own"][0])
    assert np.linalg.norm(axis) == pytest.approx(1)
    for name, matrix in {
        "turned": turn,
        "stretched": np.eye(3) + np.outer(axis, axis),
        "grown": 3 * np.eye(3),
    }.items():
        expected = pivot + (before - pivot) @ matrix.T
        after = points_of(made[name])
        # A ball's points lie elsewhere on it once it was turned; where the ball is, and how large, is the same.
        if shape["type"] == "sphere":
            expected, after = expected.mean(axis=0), after.mean(axis=0)
        assert np.abs(after - expected).max() < 1e-5, name
        assert "matrix" not in made[name].get("transform", {}), name
    assert np.abs(points_of(made["moved"]) - before - pivot).max() < 1e-5


def test_what_lies_under_a_thing_is_its_ground(page: Page) -> None:
    floor = {"low": [-5, 0, -5], "high": [5, 0, 5]}
    table = {"low": [1, 0, 1], "high": [3, 1, 3]}
    ball = {"low": [1.5, 1.25, 1.5], "high": [2.5, 2.25, 2.5]}

    def under(box: Any, *others: Any) -> Any:
        return call(page, "document/ground.js", "groundUnder", box, list(others))

    assert under(ball, floor, table) == 1, "on the table"
    beside = {"low": [-2, -0.5, -2], "high": [-1, 0.5, -1]}
    assert under(beside, floor, table) == 0, "sunk in by half it comes up again"
    assert under({"low": [8, 3, 8], "high": [9, 4, 9]}, floor, table) == 0, "beside everything: as low as the others"
    assert under(ball) is None


def test_several_are_moved_turned_and_scaled_together(editor: Editor) -> None:
    page = editor.page
    editor.pick("scenes", "point-lights")
    editor.wait("the scene", lambda: editor.text("#scene-title") == "Two point lights")
    editor.outline(True)
    before = document(editor)
    page.set_viewport_size({"width": 1200, "height": 560})  # where the outline stays beside the picture
    page.click("#outline-list [data-thing='/shapes/0'] .title")
    for thing in ("/shapes/1", "/lights/0"):
        page.locator(f"#outline-list [data-thing='{thing}'] .title").click(modifiers=["Control"])
    page.keyboard.press("2")
    page.locator("#stage").press("ArrowRight")
    moved = document(editor)
    step = moved["shapes"][0]["center"][0] - before["shapes"][0]["center"][0]
    assert step > 0
    was, now = before["shapes"][1].get("transform", {}), moved["shapes"][1]["transform"]
    gone = np.subtract(now["translate"], was.get("translate", [0, 0, 0]))
    assert gone == pytest.approx([step, 0, 0], abs=1e-5)
    gone = np.subtract(moved["lights"][0]["position"], before["lights"][0]["position"])
    assert gone == pytest.approx([step, 0, 0], abs=1e-5)
    assert moved["shapes"][2:] == before["shapes"][2:] and moved["lights"][1] == before["lights"][1]
    page.click("#undo")
    assert document(editor) == before, "one step of undo"

    page.keyboard.press("4")
    page.locator("#stage").press("Shift+ArrowUp")
    grown = document(editor)
    assert grown["shapes"][0]["radius"] == pytest.approx(1.1 * before["shapes"][0]["radius"])

    def apart(scene: Any) -> float:
        return math.dist(scene["shapes"][0]["center"], scene["lights"][0]["position"])

    assert apart(grown) == pytest.approx(1.1 * apart(before)), "about their common middle"
    page.click("#outline-list [data-thing='/shapes/0'] .title")
    page.keyboard.press("2")
    page.locator("#stage").press("ArrowRight")
    assert document(editor)["shapes"][1] == grown["shapes"][1], "and alone again"
