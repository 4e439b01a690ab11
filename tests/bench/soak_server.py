"""The server of a soak: which of its processes render, its use of memory and descriptors, and its violent end."""

from __future__ import annotations

import argparse
import os
import signal
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path

from tests.bench.server import Server

PAGE = os.sysconf("SC_PAGE_SIZE")
WORKER = "service.worker"  # the module that a renderer runs


class SoakServer(Server):
    """The server under test, with the processes that it consists of."""

    def __init__(self, folder: Path, settings: Mapping[str, str] | None = None) -> None:
        super().__init__(folder, settings)
        self._is_in_cluster = "SUNBOX_RAY" in (settings or {})

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
        self.process.wait()
        return below


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


def descriptors(server: SoakServer) -> int:
    """The server's descriptors, from its metrics, as only root could count them from outside; 0 without an answer."""
    lines = server.ask("GET", "/metrics")[1].decode().splitlines()
    return next((int(float(line.split()[1])) for line in lines if line.startswith("process_open_fds ")), 0)


def _family(pid: int) -> Iterator[int]:
    yield pid
    for task in Path(f"/proc/{pid}/task").glob("*/children"):
        with suppress(OSError):
            for child in task.read_text().split():
                yield from _family(int(child))
