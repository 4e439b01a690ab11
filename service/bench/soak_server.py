"""The server under test: its process, and its use of memory and descriptors."""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

PAGE = os.sysconf("SC_PAGE_SIZE")
PATIENCE_S = 60.0
WORKER = "service.worker"  # the module that a renderer runs


class Server:
    """`sunbox serve` on a free port."""

    def __init__(self, folder: Path, settings: Mapping[str, str] | None = None) -> None:
        """`settings` are further variables of its environment."""
        environment = {name: value for name, value in os.environ.items() if not name.startswith("SUNBOX_")}
        environment |= {"SUNBOX_DATA_DIR": str(folder), "SUNBOX_LOG_LEVEL": "error", **(settings or {})}
        self._is_in_cluster = "SUNBOX_RAY" in environment
        command = [sys.executable, "-m", "service.cli", "serve", "--port", "0"]
        with (folder / "server.log").open("wb") as log:
            self._process = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=log, text=True)
        assert self._process.stdout is not None
        said = self._process.stdout.readline()
        if "http://" not in said:
            raise RuntimeError((folder / "server.log").read_text()[-1000:])
        self.url = said[said.index("http://") :].strip().rstrip("/")

    @property
    def pid(self) -> int:
        return self._process.pid

    def ask(
        self, method: str, path: str, body: bytes | Any = None, headers: Mapping[str, str] | None = None
    ) -> tuple[int, bytes]:
        """The status and body of an answer; status 0 where there was none."""
        data = body if body is None or isinstance(body, bytes) else json.dumps(body).encode()
        request = urllib.request.Request(self.url + path, data, dict(headers or {}), method=method)
        request.add_header(
            "content-type", "application/octet-stream" if isinstance(body, bytes) else "application/json"
        )
        try:
            with urllib.request.urlopen(request, timeout=PATIENCE_S) as answer:
                return answer.status, answer.read()
        except urllib.error.HTTPError as error:
            return error.code, error.read()
        except OSError:
            return 0, b""

    def children(self) -> list[int]:
        found = subprocess.run(["ps", "-o", "pid=", "--ppid", str(self.pid)], capture_output=True, text=True)
        return [int(pid) for pid in found.stdout.split()]

    def renderers(self) -> list[int]:
        """The processes that render for this server: its children, or in a cluster on this machine Ray's actors and
        theirs."""
        commands = dict[int, list[str]]()
        for process in Path("/proc").glob("[0-9]*"):
            with suppress(OSError):
                commands[int(process.name)] = (process / "cmdline").read_text(errors="replace").split("\0")
        actors = {pid for pid, (program, *_) in commands.items() if program.startswith("ray::Renderer")}
        parents = {self.pid, *(actors if self._is_in_cluster else ())}
        workers = {pid for pid, command in commands.items() if WORKER in command and _parent(command) in parents}
        return [*(parents - {self.pid}), *workers]

    def family(self) -> list[int]:
        """The server's process and all processes below it."""
        return list(_family(self.pid))

    def kill(self, everything: bool) -> list[int]:
        """SIGKILL to the server, and with `everything` to all processes below it; those, which have to end."""
        below = self.family()[1:]
        for pid in (self.pid, *below) if everything else (self.pid,):
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        self._process.wait()
        return below

    def stop(self) -> tuple[int, int]:
        """The exit code after SIGTERM, and how many children were left."""
        children = self.children()
        self._process.terminate()
        try:
            code = self._process.wait(20)
        except subprocess.TimeoutExpired:
            self._process.kill()
            code = -9
        return code, still_there(children, 1.0)


def _parent(command: list[str]) -> int | None:
    """The process that a renderer says it belongs to."""
    _, _, parent = "\0".join(command).partition("--server\0")
    return int(parent.partition("\0")[0]) if parent else None


def add_renderers(parser: argparse.ArgumentParser) -> None:
    """The options that say which renderers the server has."""
    parser.add_argument("--devices", help="SUNBOX_DEVICES of the server, such as llvmpipe:2")
    parser.add_argument("--ray", type=int, help="so many renderers in a Ray cluster that is started for the server")


def renderer_settings(arguments: argparse.Namespace) -> dict[str, str]:
    """The variables that these options stand for."""
    if arguments.ray:
        return {"SUNBOX_RAY": "auto", "SUNBOX_RAY_RENDERERS": str(arguments.ray)}
    return {"SUNBOX_DEVICES": arguments.devices} if arguments.devices else {}


def largest(pids: list[int]) -> int:
    """The most memory that one of these processes has."""
    return max((resident(pid) for pid in pids), default=0)


def resident(pid: int) -> int:
    try:
        return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * PAGE
    except (OSError, IndexError):
        return 0


def descriptors(server: Server) -> int:
    """The server's descriptors, from its metrics, as only root could count them from outside; 0 without an answer."""
    lines = server.ask("GET", "/metrics")[1].decode().splitlines()
    return next((int(float(line.split()[1])) for line in lines if line.startswith("process_open_fds ")), 0)


def still_there(pids: list[int], within_s: float) -> int:
    """How many of these processes have not ended `within_s` seconds from now."""
    until = time.monotonic() + within_s
    while (left := sum(_lives(pid) for pid in pids)) and time.monotonic() < until:
        time.sleep(0.1)
    return left


def _lives(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"  # one that has ended and waits for its parent


def _family(pid: int) -> Iterator[int]:
    yield pid
    for task in Path(f"/proc/{pid}/task").glob("*/children"):
        with suppress(OSError):
            for child in task.read_text().split():
                yield from _family(int(child))
