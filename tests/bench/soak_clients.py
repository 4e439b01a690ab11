"""The clients of a soak, which drag, render, upload, cancel or vanish. Each counts the answers that it did not
get."""

from __future__ import annotations

import json
import random
import socket
import threading
import time
from contextlib import suppress
from typing import Any

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from tests.bench.soak_server import SoakServer
from tests.bench.soak_tally import Tally

PATIENCE_S = 60.0
SCENES = ("sphere-on-floor", "cornell-boxes", "roughness-row", "point-lights")
SIDE = 192
EQUALS = 8  # streams whose shares are compared at the end
SHARING_S = 15.0


class Stream:
    """A stream that acknowledges every frame, as the editor does, and resumes its session when the connection
    drops."""

    def __init__(self, server: SoakServer) -> None:
        self._url = server.url.replace("http://", "ws://") + "/v1/stream"
        self.session: str | None = None
        self.generation = 0
        self.socket = self._connect()

    def _connect(self) -> ClientConnection:
        url = self._url + (f"?session={self.session}" if self.session else "")
        opened = connect(url, subprotocols=[Subprotocol("sunbox.v1")], max_size=None, open_timeout=PATIENCE_S)
        made: ClientConnection = opened.__enter__()
        self.session = json.loads(made.recv(PATIENCE_S))["session"]
        return made

    def drop(self) -> None:
        """Close the connection, but not the session."""
        self.socket.socket.shutdown(socket.SHUT_RDWR)
        self.socket = self._connect()

    def say(self, kind: str, **message: Any) -> None:
        self.socket.send(json.dumps({"type": kind, **message}))

    def move(self, kind: str = "update", **message: Any) -> None:
        self.generation += 1
        self.say(kind, generation=self.generation, **message)

    def hear(self, timeout_s: float = PATIENCE_S) -> dict[str, Any]:
        """The next message, or the header of the next frame."""
        message = self.socket.recv(timeout_s)
        if isinstance(message, str):
            told: dict[str, Any] = json.loads(message)
            return told
        header: dict[str, Any] = json.loads(message[4 : 4 + int.from_bytes(message[:4], "little")])
        self.say("ack", seq=header["seq"])
        return header | {"type": "frame"}


def scene(server: SoakServer, name: str) -> Any:
    return json.loads(server.ask("GET", f"/v1/presets/scenes/{name}")[1])


def drag(server: SoakServer, tally: Tally, over: threading.Event, chance: random.Random) -> None:
    """Move the camera and drop the connection at random times, and wait for a frame of each move."""
    name = f"drag {threading.get_ident()}"
    stream = Stream(server)
    stream.move("start", scene=scene(server, chance.choice(SCENES)), settings={"width": SIDE, "height": SIDE})
    seq, samples, waiting = 0, -1, False
    while not over.is_set():
        try:
            if chance.random() < 0.05:
                stream.drop()
            moved_at = time.monotonic()
            stream.move(scene={"camera": {"vfov": chance.uniform(30, 60)}}, settings={"max_samples": 1 << 20})
            waiting = True
            rest_until = moved_at + chance.uniform(0.2, 2.5)
            while waiting or time.monotonic() < rest_until:
                told = stream.hear(PATIENCE_S if waiting else 5.0)
                if told["type"] == "error":
                    tally.lose(f"stream error {told['problem']['status']}")
                elif told["type"] == "frame":
                    if told["seq"] <= seq or told["generation"] > stream.generation:
                        tally.lose("frame out of order")
                    again = told["samples"] < samples
                    seq, samples = told["seq"], told["samples"]
                    tally.frame(name, again)
                    if waiting and told["generation"] == stream.generation:
                        tally.moved(name, time.monotonic() - moved_at)
                        waiting = False
        except TimeoutError:
            if waiting:
                tally.lose("frame that never came")
        except ConnectionClosed as closed:
            tally.lose(f"stream closed {closed.rcvd.code if closed.rcvd else 'without a word'}")
            return


def render(server: SoakServer, tally: Tally, over: threading.Event, chance: random.Random) -> None:
    """Render a picture to its end; it must have all its samples."""
    document = scene(server, chance.choice(SCENES))
    while not over.is_set():
        wanted = chance.randint(20, 200)
        order = {"scene": document, "settings": {"width": SIDE, "height": SIDE, "max_samples": wanted}}
        status, body = server.ask("POST", "/v1/renders", order)
        if status != 202:
            tally.refuse(f"render {status}") if status in (429, 503) else tally.lose(f"render {status}")
            time.sleep(0.5)
            continue
        id = json.loads(body)["id"]
        told: dict[str, Any] = {"state": "queued"}
        samples = 0
        while told["state"] in ("queued", "running") and status:
            status, body = server.ask("GET", f"/v1/renders/{id}?wait=20")
            told = json.loads(body) if status == 200 else {"state": f"status {status}"}
            if told.get("samples", 0) > samples:
                samples = told["samples"]
                tally.advance()
        if told["state"] != "done" or told["samples"] != wanted:
            tally.lose(f"render {told['state']}")
        elif (status := server.ask("GET", f"/v1/renders/{id}/image?format=exr")[0]) != 200:
            tally.lose(f"image {status}")
        else:
            tally.count("renders")


def cancel(server: SoakServer, tally: Tally, over: threading.Event, chance: random.Random) -> None:
    document = scene(server, SCENES[0])
    while not over.wait(chance.uniform(0.5, 3.0)):
        order = {"scene": document, "settings": {"width": 512, "height": 512, "max_samples": 1 << 20}}
        status, body = server.ask("POST", "/v1/renders", order)
        if status != 202:
            tally.refuse(f"render {status}") if status in (429, 503) else tally.lose(f"render {status}")
            continue
        time.sleep(chance.uniform(0.0, 1.5))
        id = json.loads(body)["id"]
        if (status := server.ask("DELETE", f"/v1/renders/{id}")[0]) != 204:
            tally.lose(f"cancelling {status}")
        tally.count("cancelled")


def upload(server: SoakServer, tally: Tally, over: threading.Event, chance: random.Random) -> None:
    """Upload meshes, valid and broken ones."""
    while not over.wait(chance.uniform(0.2, 2.0)):
        points = [f"v {chance.random()} {chance.random()} {chance.random()}" for _ in range(300)]
        faces = [f"f {n} {n + 1} {n + 2}" for n in range(1, 298)]
        good = chance.random() < 0.8
        text = "\n".join([*points, *(faces if good else ["f 1 2 999"])]) + "\n"
        status, _ = server.ask("POST", "/v1/assets?filename=m.obj", text.encode())
        if status != (201 if good else 422):
            tally.lose(f"upload {status}")
        tally.count("uploads")


def vanish(server: SoakServer, tally: Tally, over: threading.Event, chance: random.Random) -> None:
    """Connect, start something, and stop reading or disconnect."""
    document = scene(server, SCENES[0])
    silent: list[Stream] = []
    while not over.wait(chance.uniform(1.0, 5.0)):
        with suppress(OSError, ConnectionClosed, TimeoutError):
            stream = Stream(server)
            stream.move("start", scene=document, settings={"width": 512, "height": 512, "max_samples": 1 << 20})
            if chance.random() < 0.5:
                stream.socket.socket.shutdown(socket.SHUT_RDWR)
            else:
                silent.append(stream)
        while len(silent) > 3:
            with suppress(OSError):  # the server has closed the connection
                silent.pop(0).socket.socket.shutdown(socket.SHUT_RDWR)
        tally.count("vanished")
    for stream in silent:
        with suppress(OSError):
            stream.socket.socket.shutdown(socket.SHUT_RDWR)


def share_alike(server: SoakServer, tally: Tally) -> float | None:
    """Jain's index of the samples that equal streams get, while no other client is there and no renderer is
    killed."""
    document = scene(server, SCENES[0])
    streams: list[Stream] = []
    counts: list[int] = [0] * EQUALS

    def look(number: int, stream: Stream, until: float) -> None:
        while time.monotonic() < until:
            with suppress(TimeoutError):
                counts[number] = max(counts[number], stream.hear(0.5).get("samples", 0))

    try:
        for _ in range(EQUALS):
            streams.append(Stream(server))
        for stream in streams:
            settings = {"width": SIDE, "height": SIDE, "max_samples": 1 << 20}
            stream.move("start", scene=document, settings=settings)
        until = time.monotonic() + SHARING_S
        threads = [threading.Thread(target=look, args=(n, s, until)) for n, s in enumerate(streams)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    except (ConnectionClosed, TimeoutError):
        tally.lose("stream closed while sharing")
        return None
    finally:
        for stream in streams:
            stream.socket.close()
    squares = sum(count**2 for count in counts)
    return sum(counts) ** 2 / (len(counts) * squares) if squares else None
