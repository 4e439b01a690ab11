"""Where a render stands, and where its picture is: the one owner of both facts."""

from __future__ import annotations

import asyncio
import time
from dataclasses import dataclass, replace
from enum import Flag

from service.ipc.messages import Loaded, Progress
from service.server.renders.store.record import ENDED, End, Outcome


@dataclass(frozen=True)
class Queued:
    """It waits for a slot, for memory, for the disk or for a renderer."""


@dataclass(frozen=True)
class Loading:
    """It has a slot; its scene is read, and sent to a renderer, which compiles its kernel."""


@dataclass(frozen=True)
class Tracing:
    """A renderer adds samples, or did and is being replaced."""


@dataclass(frozen=True)
class Ended:
    how: End


RenderState = Queued | Loading | Tracing | Ended


class PictureAt(Flag):
    """Where the newest samples of a render are."""

    NOWHERE = 0
    RENDERER = 1
    DISK = 2
    BOTH = 3


def monotonic(ended_at: float | None) -> float:
    """A time since 1970, by default now, by the monotonic clock."""
    return time.monotonic() - max(0.0, time.time() - (ended_at or time.time()))


class Life:
    """The state of one render, and what is known of it. Each method is an arrow of the diagram in docs/house.md.

    `finished` is set when it has ended, `over` then and when the server ends, `left` whenever it needs no slot.
    """

    def __init__(self, outcome: Outcome) -> None:
        """A render that was running when the server ended waits, and goes on before others begin."""
        self.finished, self.over, self.left = asyncio.Event(), asyncio.Event(), asyncio.Event()
        self.began = outcome.state == "running"
        self.ended_at = 0.0  # by the monotonic clock, once it has ended
        self._has_slot = False
        if outcome.state in ENDED:
            self.end(outcome)
        else:
            self.outcome = replace(outcome, state="queued")

    @property
    def state(self) -> RenderState:
        match self.outcome.state:
            case "queued":
                return Loading() if self._has_slot else Queued()
            case "running":
                return Tracing()
            case how:
                return Ended(how)

    def load(self) -> None:
        """It gets a slot: Queued -> Loading."""
        self._has_slot = True
        self.left.clear()
        if self.outcome.started_at is None:
            self.outcome = replace(self.outcome, started_at=time.time())

    def trace(self, loaded: Loaded) -> None:
        """A renderer has its scene: Loading -> Tracing. One that was cancelled meanwhile stays Ended."""
        self.outcome = self.outcome.loaded(loaded)

    def progressed(self, progress: Progress) -> None:
        self.outcome = replace(self.outcome, progress=progress)

    def requeue(self) -> None:
        """It gives its slot back: Loading or Tracing -> Queued."""
        self._has_slot = False
        self.outcome = replace(self.outcome, state="queued")
        self.left.set()

    def end(self, outcome: Outcome) -> None:
        """Any state -> Ended, where it stays."""
        self.outcome = outcome
        self.ended_at = monotonic(outcome.ended_at)
        self.finished.set()
        self.close()

    def close(self) -> None:
        """The server ends: a render that has not ended stays as it is, for the next start."""
        self.over.set()
        self.left.set()
