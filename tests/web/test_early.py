"""Clicks and drops while the picture is still being prepared."""

from __future__ import annotations

import json

from playwright.sync_api import WebSocketRoute

from tests.serving import Server
from tests.web.editing import click, halves
from tests.web.editor import Editor


class Slow:
    """Frames of a server that takes its time: all pass, all as previews, or none."""

    def __init__(self, editor: Editor) -> None:
        self.passing = "all"
        editor.page.route_web_socket("**/v1/stream**", self._pass_on)

    def _pass_on(self, route: WebSocketRoute) -> None:
        server = route.connect_to_server()

        def hear(data: str | bytes) -> None:
            if isinstance(data, bytes) and self.passing != "all":
                end = 4 + int.from_bytes(data[:4], "little")
                header = json.loads(data[4:end])
                if self.passing == "none":
                    server.send(json.dumps({"type": "ack", "seq": header["seq"]}))
                    return
                told = json.dumps(header | {"scale": 0.5}).encode()  # a quick machine makes none of its own
                data = len(told).to_bytes(4, "little") + told + data[end:]
            route.send(data)

        server.on_message(hear)


def test_nothing_is_lost_before_there_is_a_picture(blank: Editor, server: Server) -> None:
    editor = blank
    slow = Slow(editor)
    editor.open(server.url)
    editor.settled()
    page = editor.page
    editor.tab("scene")
    page.click("#outline-list [data-thing='/shapes/1']")
    editor.tab("material")
    page.evaluate("document.activeElement.blur()")  # where arrows would go through the tabs

    slow.passing = "none"
    page.keyboard.press("ArrowLeft")  # another view, of which no picture comes
    page.keyboard.press("6")
    click(editor, 0.5, 0.5)
    editor.wait("what to do", lambda: "One moment: the picture is not ready." in editor.text("#messages"))
    page.keyboard.press("1")
    editor.drop("#stage", {"halves.png": halves()})
    editor.wait("the texture", lambda: page.is_visible("#material-form .texture"))
    assert editor.chosen("materials") == "Floor"
    assert "halves.png is on Floor." in editor.text("#messages")

    slow.passing = "previews"
    page.keyboard.press("ArrowLeft")
    editor.click_until("the ball, found in a preview", lambda: editor.chosen("materials") == "Red paint")


def test_an_image_that_comes_with_a_mesh_is_for_the_mesh(editor: Editor) -> None:
    page = editor.page
    triangle = b"v -1 0 0\nv 1 0 0\nv 0 2 0\nvt 0 0\nvt 1 0\nvt .5 1\nf 1/1 2/2 3/3\n"
    editor.drop("#stage", {"halves.png": halves(), "sail.obj": triangle})  # the ball is where they fall
    editor.wait("the texture", lambda: page.is_visible("#material-form .texture"))
    assert editor.chosen("materials") == "sail"
    assert "halves" not in editor.text("#messages")
