"""What a process had of the time that passed: a renderer that waits for a processor is not one that hangs."""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from types import SimpleNamespace

import pytest

from service.renderers.local.process import Options, Process
from service.system import cpu
from service.system.cpu import LEAST, RunnableTime, elapsed_s, ran

SECOND = 10**9


@pytest.mark.parametrize(
    ("run", "waited", "had"),
    [
        (0, 0, 10.0),  # asleep, stopped, or in a driver that does not come back
        (10 * SECOND, 0, 10.0),  # running, and nobody disturbs it
        (5 * SECOND, 5 * SECOND, 5.0),
        (SECOND // 5, 49 * SECOND // 5, 10 * LEAST),  # starved: a fiftieth
        (0, SECOND, 9.0),  # asleep, but for a thread that wakes now and then and waits a little
        (20 * SECOND, 140 * SECOND, 1.25),  # sixteen threads on two processors
    ],
)
def test_waiting_does_not_count(run: int, waited: int, had: float) -> None:
    before = {1: (7 * SECOND, SECOND), 2: (9 * SECOND, 90 * SECOND)}  # the second one has ended meanwhile
    after = {1: (7 * SECOND + run, SECOND + waited), 3: (SECOND, SECOND)}
    assert elapsed_s(10.0, before, after) == pytest.approx(had)


def test_where_the_system_says_nothing_all_time_counts() -> None:
    assert elapsed_s(3.0, {}, {}) == 3.0
    assert ran(2**22 + 1) == {}


@pytest.fixture
def spinning() -> Iterator[subprocess.Popen[bytes]]:
    process = subprocess.Popen([sys.executable, "-c", "while True: pass"])
    yield process
    process.kill()
    process.wait()


def test_it_is_what_the_system_counts(spinning: subprocess.Popen[bytes]) -> None:
    before, until = ran(spinning.pid), time.monotonic() + 30
    while sum(on for on, _ in ran(spinning.pid).values()) < sum(on for on, _ in before.values()) + SECOND // 20:
        assert time.monotonic() < until
        time.sleep(0.01)
    spinning.send_signal(signal.SIGSTOP)
    os.waitpid(spinning.pid, os.WUNTRACED)
    began = time.monotonic()
    stopped = RunnableTime(spinning.pid)
    time.sleep(0.2)
    assert 0.2 <= stopped.elapsed_s <= time.monotonic() - began


def test_a_starved_renderer_is_not_said_to_hang(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [1000.0]
    # Its own clock alone: with that of the loop `end` would wait for ever for a process that has not died yet.
    monkeypatch.setattr(cpu, "time", SimpleNamespace(monotonic=lambda: clock[0]))

    async def test() -> None:
        process = Process(Options(patience_s=10.0), lambda message: None, lambda: None)
        try:
            process.ready = True
            os.kill(process.id, signal.SIGSTOP)  # it takes nothing
            os.waitpid(process.id, os.WUNTRACED)
            process.link.send("something")
            counted = {process.id: (0, 0)}
            monkeypatch.setattr(cpu, "ran", lambda pid: dict(counted))
            process.watch()
            clock[0], counted[process.id] = 1100.0, (5 * SECOND, 95 * SECOND)
            process.watch()
            assert process._condemned is None
            clock[0] = 1106.0
            process.watch()
            assert process._condemned == "stopped"
        finally:
            await process.end(0.0)

    asyncio.run(test())
