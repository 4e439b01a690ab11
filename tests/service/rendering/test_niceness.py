"""Threads step back for others, and no refusal of the system's ends anything."""

from __future__ import annotations

import json
import logging
import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from service import containers
from service.config import NICENESS, load_config
from service.renderers.pool.devices import renderer_specs
from service.system import cpu
from service.system.cpu import raise_thread_niceness
from tests.serving import SCENE, SMALL, Server, families

GIVES_WAY = """
import os, threading
from service.system.cpu import raise_process_niceness

def give_way():
    os.setpriority(os.PRIO_PROCESS, 0, 19)
    ready.set()
    done.wait()
    found.append(os.getpriority(os.PRIO_PROCESS, 0))

ready, done, found = threading.Event(), threading.Event(), []
thread = threading.Thread(target=give_way)
thread.start()
ready.wait()
raise_process_niceness(os.getpriority(os.PRIO_PROCESS, 0) + 3)
done.set()
thread.join()
print(*found, os.getpriority(os.PRIO_PROCESS, 0))
"""
SERVICE = Path(__file__).parents[3] / "service"
# In the commands of processes; the last one is there where a kernel was new.
WORKERS = (
    "service.worker\0",
    "service.server.requests.parser_child",
    "service.formats.sandbox.child",
    "--priority\0now",
)
PACKS = """
import asyncio, os, sys
from service.system.executors import packing
from service.system.cpu import set_steps

os.nice(10)
set_steps(int(sys.argv[1]))
print(asyncio.run(packing(lambda: os.getpriority(os.PRIO_PROCESS, 0))))
"""


def printed(program: str, *arguments: str) -> list[int]:
    done = subprocess.run([sys.executable, "-c", program, *arguments], capture_output=True, text=True, timeout=30)
    assert done.returncode == 0, done.stderr
    return [int(word) for word in done.stdout.split()]


def test_a_thread_that_gives_way_more_than_asked_stays_so() -> None:
    """As Mesa's do: they are at 19, and only CAP_SYS_NICE may bring them down."""
    assert printed(GIVES_WAY) == [19, min(os.getpriority(os.PRIO_PROCESS, 0) + 3, 19)]


@pytest.mark.parametrize("steps", [0, 2])
def test_who_starts_the_server_with_nice_can_pack(steps: int) -> None:
    assert printed(PACKS, str(steps)) == [min(os.getpriority(os.PRIO_PROCESS, 0) + 10 + steps, 19)]


def niceness(pid: int) -> int:
    """The least of a process's threads: drivers have some that give way further."""
    threads = Path(f"/proc/{pid}/task").iterdir()
    return min(os.getpriority(os.PRIO_PROCESS, int(thread.name)) for thread in threads)


def test_nothing_else_gives_way() -> None:
    """Whoever sets a niceness takes that of SUNBOX_NICE, or has a reason here to give way further."""
    calls = ("os.nice(", "raise_thread_niceness(", "raise_process_niceness(", "setpriority(", "sched_setscheduler(")
    found = {path.relative_to(SERVICE).as_posix() for path in SERVICE.glob("**/*.py") if any_of(calls, path)}
    assert found == {
        "system/cpu.py",
        "system/executors.py",
        "system/confined/child.py",
        "worker/__main__.py",
        "worker/helpers/compile_main.py",  # what is compiled ahead
        "worker/helpers/denoise_main.py",  # for which no first frame waits
    }


def any_of(words: tuple[str, ...], path: Path) -> bool:
    return any(word in path.read_text("utf-8") for word in words)


def test_what_works_for_somebody_gives_way_by_the_steps_that_are_set(server: Server) -> None:
    """Parsers, of files and of large bodies, the renderer, and what compiles for it."""
    body = json.dumps({"scene": SCENE, "settings": SMALL}) + " " * (1 << 17)
    server.http.post("/v1/render", content=body, headers={"content-type": "application/json"}).raise_for_status()
    found: dict[str, int] = {}
    for pid in families(server.process.pid):
        command = Path(f"/proc/{pid}/cmdline").read_bytes()
        found |= {name: niceness(pid) for name in WORKERS if name.encode() in command}
    expected = min(os.getpriority(os.PRIO_PROCESS, server.process.pid) + NICENESS, 19)
    assert len(found) >= len(WORKERS) - 1 and set(found.values()) == {expected}, found


@pytest.mark.parametrize(("marks", "steps"), [((), NICENESS), ((__file__,), 0)])
def test_a_container_s_processes_give_way_to_nobody(
    marks: tuple[str, ...], steps: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(containers, "MARKS", marks)
    for name in containers.VARIABLES:
        monkeypatch.delenv(name, raising=False)
    assert load_config().nice == steps
    assert [seat.options.nice for seat in renderer_specs(load_config(nice=7), 1000)] == [7]


def test_a_thread_that_has_ended_is_skipped(caplog: pytest.LogCaptureFixture) -> None:
    thread = threading.Thread(target=lambda: None)
    thread.start()
    thread.join()
    assert thread.native_id is not None
    raise_thread_niceness(19, thread.native_id)
    assert not caplog.records


def test_a_refusal_is_logged_once_and_ends_nothing(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A seccomp filter may refuse what the kernel would grant."""

    def refuse(*_: int) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "getpriority", lambda *_: 0)  # who starts the tests at 19 asks for nothing
    monkeypatch.setattr(os, "setpriority", refuse)
    cpu._log_refusal.cache_clear()
    with caplog.at_level(logging.WARNING):
        raise_thread_niceness(19)
        raise_thread_niceness(19)
    assert len(caplog.records) == 1 and "Operation not permitted" in caplog.text
