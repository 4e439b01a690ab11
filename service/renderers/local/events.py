"""Events of each of several renderers, for their owner."""

from __future__ import annotations

from typing import Protocol

from service.ipc.leases import Lease, LeaseDone, LeaseFailed, LeaseRefuted
from service.ipc.messages import Heard
from service.renderers.statistics import Kind


class Events(Protocol):
    """Events of one of several renderers, for their owner, on the event loop."""

    def changed(self) -> None:
        """The process is ready or lost, waits for a place, or will not be started again for a while."""

    def lost(self) -> None:
        """The process was lost, and none of its tasks can still be blamed for that: others may take them over."""

    def ended(self, task: int) -> None:
        """The renderer has forgotten this task, for whatever reason."""

    def heard(self, message: Heard) -> None:
        """The listener of a task has received this message."""

    def leased(self, message: Lease | LeaseDone | LeaseFailed | LeaseRefuted) -> None:
        """The process gives a part of a picture to another renderer, or answers for a part that it was given."""

    def replayed(self, task: int) -> None:
        """A process that did not know this task has been sent all of it."""

    def work_of(self, task: int) -> tuple[Kind, str]:
        """The kind and the client of another renderer's task, which this one assists."""


class NoEvents:
    """Where a renderer is the only one, nobody needs its events."""

    def changed(self) -> None: ...

    def lost(self) -> None: ...

    def ended(self, task: int) -> None: ...

    def heard(self, message: Heard) -> None: ...

    def leased(self, message: Lease | LeaseDone | LeaseFailed | LeaseRefuted) -> None: ...

    def replayed(self, task: int) -> None: ...

    def work_of(self, task: int) -> tuple[Kind, str]:
        return "server", ""
