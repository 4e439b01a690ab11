"""Messages to the renderer's process that control one task, as a shell controls its jobs."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Pause:
    """Stops sampling but for a first look at what is new; with `away` that as well, as nobody is there to look."""

    task: int
    away: bool = False


@dataclass(frozen=True)
class Hold:
    """Stops sampling for a moment, or until the next update: one is being packed, which wants the processor, and what
    is shown will be out of date."""

    task: int


@dataclass(frozen=True)
class Resume:
    task: int


@dataclass(frozen=True)
class Stop:
    """Ends sampling; the picture so far stays readable until Drop."""

    task: int


@dataclass(frozen=True)
class Drop:
    task: int


@dataclass(frozen=True)
class TakeCheckpoint:
    """Asks for a Checkpoint of a render under way as soon as possible: the server is about to end."""

    task: int


@dataclass(frozen=True)
class CheckpointStored:
    """Says that the last Checkpoint is on the disk, and the seconds from its arrival until it was."""

    task: int
    took_s: float


@dataclass(frozen=True)
class ApplyNow:
    """Asks to apply the updates so far before the next one, which may be too much and fall back to them."""

    task: int
