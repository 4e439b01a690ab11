"""Waits of a person at the editor, measured at the socket of a real server: start-up, and moves of a slider or the
camera.
"""

from __future__ import annotations

import cmath
import json
import os
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from pathlib import Path
from typing import Any
from urllib.request import urlopen

from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from service.bench import machine
from service.document import presets

SCENE = "sphere-on-floor"  # the editor's default
SIZE = 512
MOVES = 60
PAUSE_S = 0.15  # between slider moves: the pace of a hand; the picture goes on refining meanwhile
PATIENCE_S = 60.0


def measure() -> dict[str, float]:
    """Milliseconds: server start to first image with empty and with filled caches, and first frames after a move."""
    with tempfile.TemporaryDirectory(prefix="sunbox-bench-") as folder:
        with server(folder) as (port, began), open_stream(port) as stream:
            cold_ms = Editor(port, stream).start(began)
        with server(folder) as (port, began), open_stream(port) as stream:
            editor = Editor(port, stream)
            warm_ms = editor.start(began)
            moves = sorted(editor.move() for _ in range(MOVES))
    return {
        "server_start_cold_ms": cold_ms,
        "server_start_warm_ms": warm_ms,
        "slider_p50_ms": moves[len(moves) // 2],
        "slider_p95_ms": moves[int(0.95 * len(moves))],
        "slider_worst_ms": moves[-1],
    }


def rooms(progress: Callable[[str], None]) -> dict[str, dict[str, float]]:
    """The same, by built-in scene: `slider_p50_ms`, `slider_p95_ms`, and those of the `camera`."""
    out: dict[str, dict[str, float]] = {}
    with tempfile.TemporaryDirectory(prefix="sunbox-bench-") as folder, server(folder) as (port, _):
        for entry in presets.names("scenes"):
            progress(f"first frames of {entry['name']}")
            with open_stream(port) as stream:
                editor = Editor(port, stream, entry["name"])
                editor.start(0.0)
                out[entry["name"]] = {}
                for hand, move in (("slider", editor.move), ("camera", editor.turn)):
                    moves = sorted(move() for _ in range(MOVES))
                    out[entry["name"]][f"{hand}_p50_ms"] = moves[len(moves) // 2]
                    out[entry["name"]][f"{hand}_p95_ms"] = moves[int(0.95 * len(moves))]
    return out


@contextmanager
def server(folder: str, **variables: str) -> Iterator[tuple[int, float]]:
    """A server of our own with its caches in `folder` and these variables in its environment: its port, and when its
    process was started."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    environment = {name: value for name, value in os.environ.items() if not name.startswith("SUNBOX_")}
    environment |= {"SUNBOX_DATA_DIR": folder, **machine.shader_caches(folder), **variables}
    began = time.perf_counter()
    command = [sys.executable, "-m", "service.cli", "serve", "--port", str(port)]
    log_file = Path(folder, "server.log")
    with log_file.open("wb") as log:
        server = subprocess.Popen(command, env=environment, stdout=log, stderr=log)
    try:
        while not listens(port):
            if server.poll() is not None:
                raise RuntimeError(f"the server ended instead of starting: {log_file.read_text()[-500:]}")
            time.sleep(0.01)
        yield port, began
    finally:
        server.terminate()
        try:
            server.wait(20)
        except subprocess.TimeoutExpired:
            server.kill()


class Editor:
    """As the editor behaves: acknowledges every frame, moves a slider now and then."""

    def __init__(
        self, port: int, stream: ClientConnection, scene: str = SCENE, size: tuple[int, int] = (SIZE, SIZE)
    ) -> None:
        self._port, self._stream, self._size = port, stream, size
        self._generation = 0
        self.scale = 0.0  # of the last frame: 1 is full size
        self._load(scene)

    def _load(self, scene: str) -> None:
        with urlopen(f"http://127.0.0.1:{self._port}/v1/presets/scenes/{scene}", timeout=PATIENCE_S) as answer:
            self.scene = json.load(answer)
        self.subject = presets.subject(self.scene)

    def start(self, began: float) -> float:
        """Milliseconds from `began` to the first image."""
        settings = {"width": self._size[0], "height": self._size[1], "max_samples": 1 << 20}
        self._send("start", scene=self.scene, settings=settings)
        return 1e3 * (self._first_frame() - began)

    def show(self, scene: str) -> float:
        """Milliseconds from asking for another scene, while this one refines, to its first image."""
        self._load(scene)
        self._wait(PAUSE_S)
        return self.start(time.perf_counter())

    def move(self) -> float:
        """Milliseconds from sending a slider's new value to having the first frame that shows it."""
        value = 0.1 + 0.8 * (self._generation * 0.618 % 1)  # the golden ratio: no value comes twice
        model = self.scene["materials"][self.subject]["type"]
        slider = {"diffuse": "albedo", "openpbr": "specular_roughness"}.get(model, "roughness")
        return self.change({"materials": {self.subject: {slider: value}}})

    def turn(self) -> float:
        """The same of a camera that goes half a degree around what it looks at."""
        camera = self.scene["camera"]
        (x, y, z), (tx, _, tz) = camera["position"], camera["target"]
        turned = complex(x - tx, z - tz) * cmath.exp(0.0087j)
        camera["position"] = [tx + turned.real, y, tz + turned.imag]
        return self.change({"camera": {"position": camera["position"]}})

    def _wait(self, seconds: float) -> None:
        """Take frames meanwhile."""
        until = time.perf_counter() + seconds
        while (left := until - time.perf_counter()) > 0:
            with suppress(TimeoutError):
                self._receive(left)

    def change(self, scene: dict[str, Any]) -> float:
        """Milliseconds from sending a merge patch of the scene, after a pause, to having the first frame of it."""
        self._wait(PAUSE_S)
        sent = time.perf_counter()
        self._send("update", scene=scene)
        return 1e3 * (self._first_frame() - sent)

    def _send(self, kind: str, **message: Any) -> None:
        self._generation += 1
        self._stream.send(json.dumps({"type": kind, "generation": self._generation, **message}))

    def _first_frame(self) -> float:
        """The time at which the first frame of the present generation came."""
        until = time.perf_counter() + PATIENCE_S
        while self._receive(until - time.perf_counter()) != self._generation:
            pass
        return time.perf_counter()

    def _receive(self, timeout: float) -> int | None:
        """The generation of the next frame, acknowledged; None for other messages."""
        message = self._stream.recv(timeout)
        if isinstance(message, str):
            answer = json.loads(message)
            if answer["type"] == "error":
                raise RuntimeError(f"the server refused the benchmark's own message: {answer['problem']}")
            return None
        header = json.loads(message[4 : 4 + int.from_bytes(message[:4], "little")])
        self._stream.send(json.dumps({"type": "ack", "seq": header["seq"]}))
        self.scale = float(header["scale"])
        return int(header["generation"])


def open_stream(port: int) -> AbstractContextManager[ClientConnection]:
    protocol = [Subprotocol("sunbox.v1")]
    address = f"ws://127.0.0.1:{port}/v1/stream"
    return connect(address, subprotocols=protocol, max_size=None, open_timeout=PATIENCE_S)


def listens(port: int) -> bool:
    try:
        socket.create_connection(("127.0.0.1", port)).close()
    except ConnectionRefusedError:
        return False
    return True
