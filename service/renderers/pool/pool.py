"""Several renderers behind one door: which of them gets a task, and which goes on with the tasks of a lost one."""

from __future__ import annotations

import asyncio
import itertools
import logging
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from service.ipc.channel import Encoded
from service.ipc.leases import Lease, LeaseDone, LeaseFailed, LeaseRefuted
from service.ipc.messages import Heard, Restore, SavedPicture, ToRenderer, Update
from service.problems import Unavailable
from service.renderers.local.keeper import STARTING
from service.renderers.local.process import Options, Start
from service.renderers.local.supervisor import Supervisor
from service.renderers.pool.division import Division
from service.renderers.protocol import Events, Listener, Member, Place
from service.renderers.statistics import ClientStatistics, Kind

DRIVERS_S = 15.0  # how long a stored picture waits for renderers to start, one of which may be its own
QUESTIONS: tuple[Kind, ...] = ("bsdf", "server")

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class RendererSpec:
    """Where a renderer of the pool runs, and how its process is started: one of this machine by default."""

    place: Place = field(default_factory=Place)
    options: Options = field(default_factory=Options)
    start: Start | None = None


class RendererPool:
    """Fulfils `Renderers` with a supervisor for each of them.

    A stream or a render stays with its renderer for life, through the losses of the process too. Where there is no
    hope for that one, its tasks move to others; it is tried again all the time, and gets new tasks when it is back.
    Questions, which take less time than a process takes to start, move at once.
    """

    def __init__(self, specs: Sequence[RendererSpec]) -> None:
        self.statistics = ClientStatistics()
        numbers = itertools.count(1)
        self.supervisors = [
            Supervisor(spec.options, spec.start, spec.place, numbers, _RendererEvents(self, number))
            for number, spec in enumerate(specs)
        ]
        self.homes: dict[int, Supervisor] = {}  # which of them works on it, by open task
        self._stirred = asyncio.Event()  # set, and replaced, when a renderer is ready or lost
        self._division = Division([_Peer(supervisor) for supervisor in self.supervisors])

    def start(self) -> None:
        for supervisor in self.supervisors:
            supervisor.start()

    def drain(self) -> None:
        for supervisor in self.supervisors:
            supervisor.drain()
        self._changed()

    async def close(self) -> None:
        self.drain()
        await asyncio.gather(*(supervisor.close() for supervisor in self.supervisors))

    @property
    def members(self) -> list[Member]:
        return [member for supervisor in self.supervisors for member in supervisor.members]

    @property
    def info(self) -> dict[str, Any] | None:
        return next((info for each in self.supervisors if (info := each.info) is not None), None)

    @property
    def process_id(self) -> int | None:
        return next((id for each in self.supervisors if (id := each.process_id) is not None), None)

    @property
    def hopeless(self) -> bool:
        return all(supervisor.hopeless for supervisor in self.supervisors)

    @property
    def waiting(self) -> str:
        """The reasons why there is no place for any renderer; "" where one of them renders, or starts."""
        reasons = [each.waiting for each in self.supervisors]
        return " ".join(dict.fromkeys(reasons)) if all(reasons) else ""

    async def ready(self, timeout_s: float) -> dict[str, Any]:
        try:
            async with asyncio.timeout(timeout_s):
                while True:
                    able = any(supervisor.takes_tasks for supervisor in self.supervisors)
                    if not able:
                        raise Unavailable(self._detail)
                    if (info := self.info) is not None:
                        return info
                    await self._stirred.wait()
        except TimeoutError:
            raise Unavailable(self.waiting or STARTING) from None

    async def able(self, timeout_s: float) -> None:
        if not any(supervisor.replaces for supervisor in self.supervisors):
            await self.ready(timeout_s)

    def open(self, listener: Listener, kind: Kind = "stream", client: str = "") -> int:
        home = self._best(_load(kind, client))
        if home is None:
            raise Unavailable(self._detail)
        task = home.open(listener, kind, client)
        self.homes[task] = home
        self._division.opened(task, self.supervisors.index(home), None if kind == "render" else 1)
        return task

    def divide(self, task: int, most: int | None) -> None:
        self._division.divide(task, most)

    def tracing(self, task: int | None) -> int:
        return 0 if task is None else self._division.renderers(task)

    def drop(self, task: int) -> None:
        if (home := self.homes.get(task)) is not None:
            home.drop(task)

    def send(self, message: ToRenderer) -> None:
        if (home := self.homes.get(message.task)) is not None:
            self._division.sent(message)
            home.send(message)

    async def send_scene(self, update: Update, restore: Restore | None = None) -> None:
        if restore is not None and restore.reason is None:
            await self._move_to_driver(update.task, restore.saved.driver)
        # It may move to another renderer while the scene is encoded.
        while (home := self.homes.get(update.task)) is not None:
            if not await home.sent_scene(update, restore):
                continue
            if update.scene is None:
                self._division.sent(update)
            else:
                self._division.scene_sent(update, ended=restore is not None and restore.reason is not None)
            break

    def stored(self, task: int, picture: SavedPicture, read: Callable[[], Restore]) -> None:
        if (home := self.homes.get(task)) is not None:
            home.stored(task, picture, read)

    @property
    def _detail(self) -> str:
        """Why nothing renders, as each renderer says it, and once where all say the same."""
        return " ".join(dict.fromkeys(supervisor.detail for supervisor in self.supervisors))

    def _best(
        self, load: Callable[[Supervisor], tuple[int, ...]], driver: str = "", other_than: Supervisor | None = None
    ) -> Supervisor | None:
        """The renderer with the least load, of those with that driver, if any, and of those that render just now.

        None where there is none.
        """
        able = [each for each in self.supervisors if each.takes_tasks and each is not other_than]
        return min(
            able,
            key=lambda each: (bool(driver) and each.driver != driver, each.info is None, load(each)),
            default=None,
        )

    def _changed(self) -> None:
        for supervisor in self.supervisors:
            if supervisor.waiting:
                self._take_over_from(supervisor)
        self._division.assign()
        self._stirred.set()
        self._stirred = asyncio.Event()

    def _take_over_from(self, lost: Supervisor) -> None:
        """Have others go on with tasks of a renderer that has no process just now, as far as there are others."""
        moved = 0
        for number, task in list(lost.tasks.items()):
            driver = task.record.driver
            home = self._best(_load(task.kind, task.client), driver, other_than=lost)
            if home is None or number not in lost.tasks:
                continue
            at_once = home.info is not None and driver in ("", home.driver)  # nothing of it is lost
            if lost.hopeless or (at_once and (lost.waiting or task.kind in QUESTIONS)):
                self.move(number, home)
                moved += 1
        if moved:
            log.info("moved tasks to other renderers", {"renderer": lost.place.id, "tasks": moved})

    async def _move_to_driver(self, number: int, driver: str) -> None:
        """Move a task of which nothing has been sent yet to a renderer that can go on with its picture.

        Waits for renderers that are being started: nobody knows their drivers before that.
        """
        if not driver:
            return
        with suppress(TimeoutError):
            async with asyncio.timeout(DRIVERS_S):
                while len(self.supervisors) > 1 and not self._is_at_driver(number, driver) and self._starts:
                    await self._stirred.wait()
        home = self.homes.get(number)
        if home is None or home.driver == driver:
            return
        task = home.tasks[number]
        best = self._best(_load(task.kind, task.client), driver)
        if best is not None and best is not home and best.driver == driver:
            self.move(number, best)

    def _is_at_driver(self, number: int, driver: str) -> bool:
        """True if it is with a renderer of that driver, or gone."""
        home = self.homes.get(number)
        return home is None or home.driver == driver

    @property
    def _starts(self) -> bool:
        """True if a renderer is being started that was never ready."""
        return any(each.driver is None and each.takes_tasks and not each.waiting for each in self.supervisors)

    def move(self, number: int, home: Supervisor) -> None:
        """Let another renderer go on with an open task, from its last checkpoint."""
        self._division.leave(number)
        task = self.homes[number].give_up(number)
        self.homes[number] = home
        home.take_over(number, task)
        self._division.moved(number, self.supervisors.index(home))

    def _forget(self, task: int) -> None:
        self.homes.pop(task, None)
        self._division.dropped(task)

    def _work_of(self, task: int) -> tuple[Kind, str]:
        """The kind and the client of a task that a renderer assists."""
        home = self.homes.get(task)
        task_record = None if home is None else home.tasks.get(task)
        return ("server", "") if task_record is None else (task_record.kind, task_record.client)


class _RendererEvents(Events):
    """The pool's answers to the events of one of its renderers."""

    def __init__(self, pool: RendererPool, number: int) -> None:
        self._pool, self._number = pool, number

    def changed(self) -> None:
        self._pool._changed()

    def lost(self) -> None:
        self._pool._take_over_from(self._pool.supervisors[self._number])

    def ended(self, task: int) -> None:
        self._pool._forget(task)

    def heard(self, message: Heard) -> None:
        self._pool._division.heard(message)

    def leased(self, message: Lease | LeaseDone | LeaseFailed | LeaseRefuted) -> None:
        self._pool._division.forward(message, self._number)

    def replayed(self, task: int) -> None:
        self._pool._division.replayed(task)

    def work_of(self, task: int) -> tuple[Kind, str]:
        return self._pool._work_of(task)


class _Peer:
    """A supervisor as the division of tasks sees it."""

    def __init__(self, supervisor: Supervisor) -> None:
        self._supervisor = supervisor
        self.relay, self.relay_encoded = supervisor.relay, supervisor.relay_encoded
        self.leases = supervisor.statistics.leases

    @property
    def driver(self) -> str | None:
        return None if self._supervisor.info is None else self._supervisor.driver

    def scene_of(self, task: int) -> list[Encoded | ToRenderer]:
        task_record = self._supervisor.tasks.get(task)
        return [] if task_record is None else task_record.record.scenes()


def _load(kind: Kind, client: str) -> Callable[[Supervisor], tuple[int, ...]]:
    """How busy a renderer is for another task of that kind: the less, the better for it."""

    def load(supervisor: Supervisor) -> tuple[int, ...]:
        active = [task for task in supervisor.tasks.values() if task.active]
        if kind == "render":
            return sum(task.kind == "render" for task in active), len(active)
        # What a client's other tasks need is likely to be there already: kernels, above all.
        of_client = sum(bool(client) and task.client == client for task in supervisor.tasks.values())
        return len(active), -of_client

    return load
