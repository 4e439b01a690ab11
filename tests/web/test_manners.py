"""How the page behaves at the stream, seen on the wire."""

from __future__ import annotations

import json
from typing import Any

import pytest
from playwright.sync_api import WebSocket

from tests.serving import Server
from tests.web.editing import keep_on
from tests.web.editor import Editor

HIDE = """(hidden) => {
    Object.defineProperty(document, "hidden", { value: hidden, configurable: true });
    document.dispatchEvent(new Event("visibilitychange"));
}"""


# The last frame comes once more, as one of the generation before: it was on its way while an update went out.
LATE = """() => {
    const { socket, frame } = window.heard;
    const length = new DataView(frame).getUint32(0, true);
    const header = JSON.parse(new TextDecoder().decode(new Uint8Array(frame, 4, length)));
    const text = new TextEncoder().encode(JSON.stringify({ ...header, generation: header.generation - 1 }));
    const late = new Uint8Array(4 + text.length + frame.byteLength - 4 - length);
    new DataView(late.buffer).setUint32(0, text.length, true);
    late.set(text, 4);
    late.set(new Uint8Array(frame, 4 + length), 4 + text.length);
    socket.dispatchEvent(new MessageEvent("message", { data: late.buffer }));
    return header.seq;
}"""
LISTEN = """window.WebSocket = class extends WebSocket {
    constructor(...given) {
        super(...given);
        this.addEventListener("message", ({ data }) => {
            if (data instanceof ArrayBuffer) window.heard = { socket: this, frame: data };
        });
    }
};"""


class Wire:
    def __init__(self, editor: Editor) -> None:
        self.said: list[dict[str, Any]] = []
        self.frames: list[dict[str, Any]] = []
        editor.page.on("websocket", self._listen)

    def _listen(self, socket: WebSocket) -> None:
        socket.on("framesent", lambda text: self.said.append(json.loads(text)))
        socket.on("framereceived", self._receive)

    def _receive(self, data: str | bytes) -> None:
        if isinstance(data, bytes):
            length = int.from_bytes(data[:4], "little")
            self.frames.append(json.loads(data[4 : 4 + length]))

    def kinds(self) -> list[str]:
        return [message["type"] for message in self.said]


@pytest.fixture
def wire(server: Server, blank: Editor) -> tuple[Editor, Wire]:
    wire = Wire(blank)
    blank.page.add_init_script(LISTEN)
    blank.open(server.url)
    return blank, wire


def test_a_drag_is_one_small_update_at_a_time(wire: tuple[Editor, Wire]) -> None:
    editor, heard = wire
    editor.settled()
    editor.page.evaluate("""async () => {
        const slider = document.querySelector("[data-field=roughness] input[type=range]");
        for (let i = 0; i <= 60; i++) {
            slider.value = i / 60;
            slider.dispatchEvent(new Event("input"));
            await new Promise(requestAnimationFrame);
        }
    }""")
    editor.wait("the end of the drag", lambda: '"roughness": 1}' in json.dumps(heard.said))
    updates = [message for message in heard.said if message["type"] == "update"]
    assert 1 < len(updates) <= 61
    (name,) = updates[-1]["scene"]["materials"]
    assert updates[-1] == {
        "type": "update",
        "generation": updates[-1]["generation"],
        "scene": {"materials": {name: {"roughness": 1}}},
    }
    generations = [message["generation"] for message in heard.said if "generation" in message]
    assert generations == sorted(set(generations))
    seen = {frame["generation"] for frame in heard.frames}
    assert len(seen) >= len(updates) / 2, "most of what the hand did was seen"


def test_every_frame_is_acknowledged(wire: tuple[Editor, Wire]) -> None:
    editor, heard = wire
    editor.settled()
    editor.page.keyboard.press("ArrowLeft")
    editor.page.keyboard.press("Space")
    editor.wait("quiet", lambda: editor.text("#state") == "Paused")
    editor.rest("the last acknowledgement", lambda: (len(heard.frames), len(heard.said)))
    acknowledged = [message["seq"] for message in heard.said if message["type"] == "ack"]
    assert sorted(acknowledged) == [frame["seq"] for frame in heard.frames]
    late = editor.page.evaluate(LATE)
    editor.wait("its acknowledgement", lambda: [m["seq"] for m in heard.said if m["type"] == "ack"].count(late) == 2)
    assert editor.text("#state") == "Paused"


def test_a_hidden_page_pauses(wire: tuple[Editor, Wire]) -> None:
    editor, heard = wire
    keep_on(editor)
    editor.page.evaluate(HIDE, True)
    editor.wait("a pause", lambda: "pause" in heard.kinds())
    editor.rest("the last frame", lambda: len(heard.frames))
    frames = len(heard.frames)
    editor.page.evaluate(HIDE, False)
    editor.wait("more frames", lambda: len(heard.frames) > frames + 1)
    assert heard.kinds().count("resume") == 1
