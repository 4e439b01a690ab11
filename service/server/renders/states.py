"""The states of a render, and where its picture may be."""

from __future__ import annotations

import time
from dataclasses import dataclass
from enum import Flag

from service.server.renders.store.record import End


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
