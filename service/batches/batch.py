"""One batch: its renders, as far as there are any, and how far they are."""

from __future__ import annotations

import asyncio
import time
from collections import Counter
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from service.quality import resolve
from service.renders.job import Job
from service.renders.status import iso, status
from service.renders.store.batch_rows import BatchOrder
from service.renders.store.record import ENDED, Order, Outcome, State
from service.scene.settings import Settings

STATES: tuple[State, ...] = ("queued", "running", *ENDED)
RENDERS_OF_ONE = 10  # renders of a batch that count as one where ended renders are kept
ID_DIGITS, STEP_DIGITS = 24, 8  # of a render's id: those of its batch, and its place


def member_id(batch: str, step: int) -> str:
    """The id of render `step`, which is known before there is one."""
    return f"{batch[:ID_DIGITS]}{step:0{STEP_DIGITS}x}"


class Batch:
    """For the event loop. Renders are made a few at a time; of the others only their number counts."""

    number = 0  # rises in the order of arrival
    cancelled = False
    gone = False  # it was deleted, or made room for others
    queueing = False  # a render is being stored, and is there as soon as it is

    def __init__(self, order: BatchOrder) -> None:
        self.order = order
        self.id, self.owner = order.id, order.owner
        self.client = order.owner or order.id  # whose share of the disk its document counts towards
        self.bytes = order.bytes
        self.counts_as = -(-order.renders // RENDERS_OF_ONE)
        self.jobs: dict[int, Job] = {}  # by step: those that there are
        self.finished = asyncio.Event()
        self.changed = asyncio.Event()  # a render ended, or the batch was cancelled; whoever waits clears it
        self.ended_at = 0.0  # by the monotonic clock
        self.making = asyncio.Lock()  # while one of its files is made
        self._busy_s = 0.0  # seconds that ended renders took, setup included
        self._ended, self._done = set[int](), set[int]()  # steps

    def add(self, step: int, job: Job) -> None:
        """A render is there; it may have ended before the server started."""
        self.jobs[step] = job
        job.batch = self
        if job.finished.is_set():
            self.ended(job)

    def ended(self, job: Job) -> None:
        """One of its renders has ended."""
        step = int(job.id[ID_DIGITS:], 16)
        if step in self._ended:
            return
        self._ended.add(step)
        if job.state == "done":
            self._done.add(step)
        self._busy_s += job.outcome.setup_s + job.elapsed_s
        self.look()

    def look(self) -> None:
        """Finish once its last render has ended; after it was cancelled, the last of those that there are."""
        self.changed.set()
        done = len(self._ended) == (len(self.jobs) if self.cancelled else self.order.renders)
        if done and not self.queueing and not self.finished.is_set():
            self.ended_at = max((job.ended_at for job in self.jobs.values()), default=time.monotonic())
            self.finished.set()

    @property
    def ahead(self) -> int:
        """Renders that wait or run."""
        return len(self.jobs) - len(self._ended)

    @property
    def pictured(self) -> list[int]:
        """The steps whose renders are done, in order."""
        return sorted(self._done)

    @property
    def size(self) -> int:
        """The bytes that it takes on the disk."""
        return self.order.bytes + sum(job.size for job in self.jobs.values())

    @property
    def state(self) -> State:
        if not self.finished.is_set():
            return "running" if any(job.outcome.started_at for job in self.jobs.values()) else "queued"
        if self.cancelled:
            return "cancelled"
        return "failed" if all(job.state == "failed" for job in self.jobs.values()) else "done"

    def state_of(self, step: int) -> State:
        job = self.jobs.get(step)
        return job.state if job is not None else "cancelled" if self.cancelled else "queued"

    def status(self) -> dict[str, Any]:
        """As JSON."""
        return self.snapshot()()

    def snapshot(self) -> Callable[[], dict[str, Any]]:
        """What makes the status, for any thread: that of 10 000 renders takes 20 ms."""
        return partial(self._status, self.state, self.finished.is_set(), dict(self.jobs), self._busy_s)

    def _status(self, state: State, is_finished: bool, jobs: Mapping[int, Job], busy_s: float) -> dict[str, Any]:
        unmade: State = "cancelled" if self.cancelled else "queued"
        states = [jobs[step].state if step in jobs else unmade for step in range(self.order.renders)]
        counts = Counter(states)
        ended, measured = sum(counts[each] for each in ENDED), counts["done"] + counts["failed"]
        return {
            "id": self.id,
            "state": state,
            "label": self.order.label,
            "priority": self.order.priority,
            "created": iso(self.order.created_at),
            "counts": {each: counts[each] for each in STATES},
            "renders": [{"id": member_id(self.id, step), "state": each} for step, each in enumerate(states)],
            "eta_s": (self.order.renders - ended) * busy_s / measured if measured and not is_finished else None,
        }

    def waiting_status(self, step: int) -> dict[str, Any]:
        """The status of a render that is not there yet."""
        return status(self.member(step), Outcome(state=self.state_of(step)), 0)

    def member(self, step: int) -> Order:
        """What is known of a render before its turn: neither its settings nor its name."""
        return Order(
            member_id(self.id, step), self.owner, resolve(Settings()), self.order.label, self.order.priority,
            self.order.created_at,
        )  # fmt: skip
