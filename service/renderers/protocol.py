"""The server's interface to its renderers, whether there is one supervised process or a pool of them."""

from __future__ import annotations

import socket
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol

from service.ipc.leases import Lease, LeaseDone, LeaseFailed, LeaseRefuted
from service.ipc.messages import FromRenderer, Heard, Restore, SavedPicture, ToRenderer, Update
from service.renderers.statistics import ClientStatistics, Kind, Statistics

State = Literal["starting", "ready", "lost", "draining"]


class Listener(Protocol):
    """Receives the messages of the task that it opened, on the event loop."""

    def heard(self, message: FromRenderer) -> None: ...

    def again(self) -> None:
        """The renderer was lost, and another one begins the task again."""

    def lost(self, detail: str) -> None:
        """There is no renderer for this task any more."""


@dataclass(frozen=True)
class Place:
    """A renderer's name, device and host."""

    id: str = "0"
    device: str = "0"  # as in SUNBOX_DEVICES
    host: str = field(default_factory=socket.gethostname)


@dataclass(frozen=True)
class Member:
    """One renderer, for those who look at the service from outside."""

    place: Place
    state: State
    vendor: str | None  # of the device, as its driver says it; None: not known yet
    driver: str | None  # and its version; two renderers with equal ones give equal bits. None: not known yet
    process_id: int | None  # on its host; None while there is none
    statistics: Statistics


class Renderers(Protocol):
    """For the event loop. Tasks are numbered; what a lost renderer had is begun again elsewhere."""

    @property
    def statistics(self) -> ClientStatistics:
        """Counters of frames and errors; the sender increments them."""

    @property
    def members(self) -> Sequence[Member]:
        """Each renderer as it is now, in the order of their ids."""

    @property
    def info(self) -> dict[str, Any] | None:
        """The device that renders, of several the first; None while nothing can."""

    @property
    def process_id(self) -> int | None:
        """The process that renders, of several the first; None while there is none."""

    @property
    def hopeless(self) -> bool:
        """True if all attempts to start any renderer failed, so that the next one is some time away."""

    @property
    def waiting(self) -> str:
        """The reasons why there is no place for any renderer; "" where one of them renders, or starts."""

    def start(self) -> None:
        """Start the processes, where that has not been done; they are ready some tenths of a second later."""

    def drain(self) -> None:
        """Take no new tasks from now on, as the server is about to end; those that are there go on."""

    async def close(self) -> None:
        """End them, after what they are at."""

    async def ready(self, timeout_s: float) -> dict[str, Any]:
        """The device that renders, as soon as one does. Raises Unavailable with the reason why nothing does."""

    async def able(self, timeout_s: float) -> None:
        """Return when something renders, or did and is being replaced: then work can be taken. Raises Unavailable."""

    def open(self, listener: Listener, kind: Kind = "stream", client: str = "") -> int:
        """The number of a new task, whose messages `listener` hears until `drop`. Raises Unavailable.

        Tasks of one `client` share its part of the time; without a name each has its own.
        """

    def divide(self, task: int, most: int | None) -> None:
        """Let at most so many renderers trace the task together; None: all that are free.

        Without it renders get all that are free, and other tasks one.
        """

    def tracing(self, task: int | None) -> int:
        """How many renderers trace the task now."""

    def drop(self, task: int) -> None:
        """End a task; its listener hears no more."""

    def send(self, message: ToRenderer) -> None:
        """Hand a message on; nothing happens when its task was lost or dropped."""

    async def send_scene(self, update: Update, restore: Restore | None = None) -> None:
        """Like `send`, for a whole scene or a large edit: it is copied to shared memory off the event loop.

        `restore`: its picture as the server has it, which the task goes on from, or has ended with.
        """

    def stored(self, task: int, picture: SavedPicture, read: Callable[[], Restore]) -> None:
        """A task's picture need not stay in memory: `read`, which is not for an event loop, gives it."""


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
