"""Threads step back for others, and no refusal of the system's ends anything."""

from __future__ import annotations

import logging
import os
import subprocess
import sys
import threading

import pytest

from service.system import priority
from service.system.priority import raise_thread_niceness

GIVES_WAY = """
import os, threading
from service.system.priority import raise_process_niceness

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
PACKS = """
import asyncio, os
from service.system.executors import packing

os.nice(10)
print(asyncio.run(packing(lambda: os.getpriority(os.PRIO_PROCESS, 0))))
"""


def printed(program: str) -> list[int]:
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=30)
    assert done.returncode == 0, done.stderr
    return [int(word) for word in done.stdout.split()]


def test_a_thread_that_gives_way_more_than_asked_stays_so() -> None:
    """As Mesa's do: they are at 19, and only CAP_SYS_NICE may bring them down."""
    assert printed(GIVES_WAY) == [19, min(os.getpriority(os.PRIO_PROCESS, 0) + 3, 19)]


def test_who_starts_the_server_with_nice_can_pack() -> None:
    assert printed(PACKS) == [min(os.getpriority(os.PRIO_PROCESS, 0) + 15, 19)]


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

    monkeypatch.setattr(os, "setpriority", refuse)
    priority._log_refusal.cache_clear()
    with caplog.at_level(logging.WARNING):
        raise_thread_niceness(19)
        raise_thread_niceness(19)
    assert len(caplog.records) == 1 and "Operation not permitted" in caplog.text
