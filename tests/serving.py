"""A real server in a process of its own, and a client of its stream."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import httpx
import numpy as np
from websockets.sync.client import connect
from websockets.typing import Origin, Subprotocol

from service.config import NICENESS
from tests import kernel_count

COLD_S = 150.0  # caches are empty: every kernel is compiled
AHEAD = "SUNBOX_AHEAD"  # the setting that tests turn off, but those of what is compiled ahead
KEYS = ("anna-key", "bert-key")  # of the strict server
SPARE_KEY = "cara-key"  # another one, of whose assets a single test counts the bytes
CALLBACK_SECRETS = ("whsec_" + "c3VuYm94" * 4, "whsec_" + "b3RoZXIh" * 4)  # of the mortal one
PATIENCE_S = 180.0  # a bound against hanging: whoever uses the machine meanwhile may take most of it

SCENE: dict[str, Any] = {
    "version": 1,
    "camera": {"position": [0, 0, 4], "target": [0, 0, 0]},
    "environment": {"type": "constant", "radiance": [0.5, 0.7, 1.0]},
    "lights": [{"type": "point", "position": [2, 3, 4], "intensity": 30}],
    "materials": {
        "ball": {"type": "disney", "base_color": [0.8, 0.3, 0.2], "roughness": 0.4},
        "floor": {"type": "diffuse", "albedo": 0.6},
    },
    "shapes": [
        {"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "ball"},
        {"type": "quad", "origin": [-5, -1, 5], "u": [10, 0, 0], "v": [0, 0, -10], "material": "floor"},
    ],
}
SMALL = {"width": 32, "height": 24, "max_samples": 8}
ENDLESS = {"width": 32, "height": 24, "max_samples": 1 << 24}
# The first line of a program that is to hear Ctrl-C: a shell's background job, and what it starts, ignores it.
LISTENS = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"


def wait_until(reached: Callable[[], object], pause_s: float = 0.02) -> None:
    """Return once `reached()` holds."""
    until = time.monotonic() + PATIENCE_S
    while not reached():
        assert time.monotonic() < until, "it has not come about"
        time.sleep(pause_s)


class Server:
    """`sunbox serve` on a free port, with its data in `folder`. `python` starts it, in the place of this one. What is
    compiled ahead is the session's (`AHEAD`), its processes are as nice as on a desktop, and all other settings are
    its own. Where it has one key, `http` and `client` show that."""

    def __init__(self, folder: Path, *, python: Sequence[str] = (), **variables: str) -> None:
        self.folder, self.log = folder, folder / "server.log"
        keys = variables.get("SUNBOX_API_KEY", "")
        self.key = None if keys == "" or "," in keys else keys
        own = {AHEAD: os.environ[AHEAD], "SUNBOX_NICE": str(NICENESS), "SUNBOX_DATA_DIR": str(folder / "data")}
        others = {name: value for name, value in os.environ.items() if not name.startswith("SUNBOX_")}
        self._environment = others | own | variables
        self._command = [*(python or [sys.executable]), "-m", "service.cli", "serve", "--port", "0"]
        self.start()

    def start(self) -> None:
        """Start it, with a log of its own; also once more after its end, where it has another address."""
        with self.log.open("wb") as log:
            self.process = subprocess.Popen(
                self._command, env=self._environment, stdout=subprocess.PIPE, stderr=log, text=True
            )
        assert self.process.stdout is not None
        said = self.process.stdout.readline()
        assert "http://" in said, self.log.read_text()
        self.url = said[said.index("http://") :].strip().rstrip("/")
        headers = {} if self.key is None else {"authorization": f"Bearer {self.key}"}
        self.http = httpx.Client(base_url=self.url, timeout=PATIENCE_S, headers=headers)

    @property
    def runs(self) -> bool:
        return self.process.poll() is None

    def wait(self, patience_s: float = PATIENCE_S) -> None:
        until = time.monotonic() + patience_s
        while self.http.get("/readyz").status_code != 200:
            assert time.monotonic() < until, self.log.read_text()
            time.sleep(0.05)

    def children(self) -> list[int]:
        found = subprocess.run(["ps", "-o", "pid=", "--ppid", str(self.process.pid)], capture_output=True, text=True)
        return [int(pid) for pid in found.stdout.split()]

    def renderers(self) -> list[int]:
        """Process ids of the renderers that there are just now."""
        found = []
        for pid in self.children():
            with suppress(OSError):  # it may be gone by now
                if b"service.worker\0" in Path(f"/proc/{pid}/cmdline").read_bytes():
                    found.append(pid)
        return found

    def renderer(self) -> int:
        """The process id of the renderer that there is, or comes."""
        while not (found := self.renderers()):
            assert self.runs, self.log.read_text()
            time.sleep(0.02)
        return found[0]

    def stop(self, number: int = signal.SIGTERM) -> int:
        """The exit code."""
        self.http.close()
        self.process.send_signal(number)
        try:
            return self.process.wait(PATIENCE_S)
        finally:
            self.process.kill()
            kernel_count.read_log(self.log)


@contextmanager
def served(folder: Path, **options: Any) -> Iterator[Server]:
    """A server that may have to compile every kernel, and ends well."""
    server = Server(folder, **options)
    try:
        server.http.timeout = COLD_S
        server.wait(COLD_S)
        yield server
    finally:
        assert server.stop() == 0


def kill(server: Server) -> None:
    """Kill the server and all of its processes at once."""
    for pid in [server.process.pid, *server.children()]:
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    server.process.wait()
    server.http.close()


def families(pid: int) -> Iterator[int]:
    """The process and all its descendants."""
    yield pid
    for task in Path(f"/proc/{pid}/task").glob("*/children"):
        with suppress(OSError):
            for child in task.read_text().split():
                yield from families(int(child))


@dataclass(frozen=True)
class Picture:
    """A frame as it came."""

    header: dict[str, Any]
    image: bytes
    at: float

    def __getattr__(self, name: str) -> Any:
        return self.header[name]

    def array(self) -> np.ndarray:
        """(height, width, 4) of an rgba32f frame."""
        return np.frombuffer(self.image, "<f4").reshape(self.header["height"], self.header["width"], 4)


class Client:
    """The other end of the stream, open until `close` or the end of `with`. Acknowledges what it receives unless
    `acknowledges` is set to False."""

    def __init__(
        self,
        url: str,
        origin: str | None = None,
        session: str | None = None,
        key: str | None = None,
    ) -> None:
        self.url = url
        given = {"session": session}
        query = urlencode({name: value for name, value in given.items() if value is not None})
        address = url.replace("http://", "ws://") + "/v1/stream" + (query and f"?{query}")
        offered = None if origin is None else Origin(origin)
        protocols = [Subprotocol("sunbox.v1"), *([] if key is None else [Subprotocol(f"sunbox.key.{key}")])]
        self._closing = ExitStack()
        self.socket = self._closing.enter_context(
            connect(address, subprotocols=protocols, max_size=None, origin=offered)
        )
        self.acknowledges = True

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *raised: object) -> None:
        self.close()

    def close(self) -> None:
        self._closing.close()

    def say(self, kind: str, **message: Any) -> None:
        self.socket.send(json.dumps({"type": kind, **message}))

    def start(self, generation: int = 1, scene: Any = SCENE, settings: Any = SMALL, **message: Any) -> None:
        self.say("start", generation=generation, scene=scene, settings=settings, **message)

    def hear(self, timeout: float = PATIENCE_S) -> Picture | dict[str, Any]:
        """Raises TimeoutError when nothing comes."""
        data = self.socket.recv(timeout)
        if isinstance(data, str):
            told: dict[str, Any] = json.loads(data)
            return told
        length = int.from_bytes(data[:4], "little")
        picture = Picture(json.loads(data[4 : 4 + length]), data[4 + length :], time.monotonic())
        if self.acknowledges:
            self.say("ack", seq=picture.seq)
        return picture

    def until(self, kind: str) -> tuple[dict[str, Any], list[Picture]]:
        """The next message of that type, and the frames before it."""
        frames: list[Picture] = []
        while True:
            heard = self.hear()
            if isinstance(heard, Picture):
                frames.append(heard)
            elif heard["type"] == kind:
                return heard, frames

    def frame(self, generation: int | None = None) -> Picture:
        """The next frame, of that generation; other messages are skipped."""
        while True:
            heard = self.hear()
            if isinstance(heard, Picture) and generation in (None, heard.generation):
                return heard

    def finished(self) -> tuple[dict[str, Any], Picture]:
        """The next `done`, and the frame of all its samples, which comes before or after."""
        last: Picture | None = None
        done: dict[str, Any] | None = None
        while done is None or last is None or last.samples < done["samples"] or last.generation != done["generation"]:
            heard = self.hear()
            if isinstance(heard, Picture):
                last = heard
            elif heard["type"] == "done":
                done = heard
        return done, last

    def silence(self, seconds: float = 0.4) -> list[Picture | dict[str, Any]]:
        """What came in that time."""
        until, heard = time.monotonic() + seconds, []
        while (left := until - time.monotonic()) > 0:
            try:
                heard.append(self.hear(left))
            except TimeoutError:
                break
        return heard


@contextmanager
def client(server: Server) -> Iterator[Client]:
    """A stream that has said hello."""
    opened = Client(server.url, key=server.key)
    with opened:
        assert opened.until("hello")
        yield opened
