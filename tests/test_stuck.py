"""Connections that hold a place and give nothing are ended; others are left alone."""

from __future__ import annotations

import pytest

from service import app
from service.app import Stuck


class Transport:
    def __init__(self, closing: bool) -> None:
        self.closing, self.aborted = closing, False

    def is_closing(self) -> bool:
        return self.closing

    def abort(self) -> None:
        self.aborted = True


class Connection:
    def __init__(self, cycle: object, closing: bool = False) -> None:
        self.cycle, self.transport = cycle, Transport(closing)


class Stream:
    """A WebSocket's connection has no request under way."""

    def __init__(self) -> None:
        self.transport = Transport(False)


def test_only_those_that_stay_silent_or_never_close(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [0.0]
    monkeypatch.setattr(app.time, "monotonic", lambda: clock[0])
    silent, closing, served = Connection(None), Connection(1, True), Connection(1)
    stream, late = Stream(), Connection(None)
    all_of_them = [silent, closing, served, stream, late]
    stuck = Stuck()
    stuck.abort(all_of_them)
    clock[0] = 5.0
    late.cycle = object()  # its first request has come
    stuck.abort(all_of_them)
    assert not any(each.transport.aborted for each in all_of_them)
    clock[0] = app.STUCK_S
    stuck.abort(all_of_them)
    assert [each.transport.aborted for each in all_of_them] == [True, True, False, False, False]
