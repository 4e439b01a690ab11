"""One batch: its renders, as far as there are any, and how far they are. They are made one after the other: what its
axes leave unchanged is validated and packed once.
"""

from __future__ import annotations

import asyncio
import json
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any
from weakref import WeakValueDictionary

from service.document.document import Parsed
from service.document.quality import ResolvedSettings, resolve
from service.document.settings import Settings
from service.document.text import most_bytes
from service.pack import PackCache, Packed
from service.problems import InvalidDocument, ServiceError, TooLarge
from service.server.renders.render import Render
from service.server.renders.status import iso, status
from service.server.renders.store.batch_rows import BatchOrder
from service.server.renders.store.record import ENDED, End, Order, Outcome, State
from service.server.requests.batch_request import variations
from service.server.requests.request_parser import LONGEST_LABEL, folded, unfolded
from service.server.requests.request_reader import RequestReader
from service.system.executors import packing

STATES: tuple[State, ...] = ("queued", "running", *ENDED)
RENDERS_OF_ONE = 10  # renders of a batch that count as one where ended renders are kept
ID_DIGITS, STEP_DIGITS = 24, 8  # of a render's id: those of its batch, and its place


def member_id(batch: str, step: int) -> str:
    """The id of render `step`, which is known before there is one."""
    return f"{batch[:ID_DIGITS]}{step:0{STEP_DIGITS}x}"


def step_of(id: str) -> int:
    """The place of a render in its batch."""
    return int(id[ID_DIGITS:], 16)


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
        self.steps = Steps.of(order.renders)
        # By step: renders that wait, run, or have ended and are not whole on the disk; and those that are rows of the
        # store, as long as somebody looks at them.
        self.jobs: dict[int, Render] = {}
        self.shown: WeakValueDictionary[int, Render] = WeakValueDictionary()
        self.finished = asyncio.Event()
        self.changed = asyncio.Event()  # a render ended, or the batch was cancelled; the waiting task clears it
        self.ended_at = 0.0  # by the monotonic clock
        self.making = asyncio.Lock()  # while one of its files is made
        self._stored_bytes = 0  # of the renders that are rows

    def add(self, step: int, job: Render) -> None:
        """A render is there; it may have ended before it began."""
        self.jobs[step] = job
        job.batch = self
        self.steps.make(step)
        if job.finished.is_set():
            self.ended(job)

    def add_ended(self, step: int, state: End, ended_at: float, size: int) -> None:
        """A render is there that had ended before the server started; `ended_at` by the monotonic clock."""
        self.steps.make(step)
        self.steps.end(step, state, ended_at)
        self._stored_bytes += size

    def ended(self, job: Render) -> None:
        """One of its renders has ended."""
        step, state = step_of(job.id), job.state
        if not self.steps.is_under_way(step) or state == "queued" or state == "running":
            return
        self.steps.end(step, state, job.ended_at)
        if state != "cancelled":
            self.steps.busy_s += job.outcome.setup_s + job.elapsed_s
            self.steps.measured += 1
        self.finish_if_done()

    def move_to_row(self, job: Render) -> None:
        """An ended render is whole on the disk, and from now on a row there."""
        step = step_of(job.id)
        if self.jobs.pop(step, None) is not None:
            self._stored_bytes += job.size
            self.shown[step] = job

    def job(self, step: int) -> Render | None:
        """A render that is in memory."""
        return self.jobs.get(step) or self.shown.get(step)

    @property
    def ids(self) -> Iterator[str]:
        """Names of the renders that were made."""
        return (member_id(self.id, step) for step in self.steps.that_are_made())

    def finish_if_done(self) -> None:
        """Finish once its last render has ended; after it was cancelled, the last of those that there are."""
        self.changed.set()
        done = self.steps.ended == (self.steps.made if self.cancelled else self.order.renders)
        if done and not self.queueing and not self.finished.is_set():
            self.ended_at = self.steps.last_end if self.steps.ended else time.monotonic()
            self.finished.set()

    @property
    def ahead(self) -> int:
        """Renders that wait or run."""
        return self.steps.made - self.steps.ended

    @property
    def pictured(self) -> list[int]:
        """The steps whose renders are done, in order."""
        return self.steps.that("done")

    @property
    def size(self) -> int:
        """The bytes that it takes on the disk."""
        return self.order.bytes + self._stored_bytes + sum(job.size for job in self.jobs.values())

    @property
    def state(self) -> State:
        if not self.finished.is_set():
            begun = self.steps.ended or any(job.outcome.started_at for job in self.jobs.values())
            return "running" if begun else "queued"
        if self.cancelled:
            return "cancelled"
        return "failed" if len(self.steps.that("failed")) == self.steps.made else "done"

    def state_of(self, step: int) -> State:
        return self._state_of(step, self.steps, self.jobs)

    def _state_of(self, step: int, steps: Steps, jobs: Mapping[int, Render]) -> State:
        if not steps.is_made(step):
            return "cancelled" if self.cancelled else "queued"
        return jobs[step].state if steps.is_under_way(step) else steps.how(step)

    def status(self) -> dict[str, Any]:
        """As JSON."""
        return self.snapshot()()

    def snapshot(self) -> Callable[[], dict[str, Any]]:
        """A function that makes the status, for any thread: that of 10 000 renders takes 20 ms."""
        measured = self.steps.measured if not self.finished.is_set() else 0
        each_s = self.steps.busy_s / measured if measured else None
        return partial(self._status, self.state, self.steps.copy(), dict(self.jobs), each_s)

    def _status(self, state: State, steps: Steps, jobs: Mapping[int, Render], each_s: float | None) -> dict[str, Any]:
        """`each_s`: the seconds that a render takes; None: it is not known, or none is to come."""
        states = [self._state_of(step, steps, jobs) for step in range(self.order.renders)]
        counts = Counter(states)
        ended = sum(counts[each] for each in ENDED)
        return {
            "id": self.id,
            "state": state,
            "label": self.order.label,
            "priority": self.order.priority,
            "created": iso(self.order.created_at),
            "counts": {each: counts[each] for each in STATES},
            "renders": [{"id": member_id(self.id, step), "state": each} for step, each in enumerate(states)],
            "eta_s": None if each_s is None else (self.order.renders - ended) * each_s,
        }

    def waiting_status(self, step: int) -> dict[str, Any]:
        """The status of a render that is not there yet."""
        return status(self.member(step), Outcome(state=self.state_of(step)), 0)

    def member(self, step: int) -> Order:
        """A render's order before its turn: neither its settings nor its name are known."""
        return Order(
            member_id(self.id, step), self.owner, resolve(Settings()), self.order.label, self.order.priority,
            self.order.created_at,
        )  # fmt: skip


_NOT_MADE, _UNDER_WAY, _FIRST_END = 0, 1, 2  # codes; from the last one on how it ended


class Steps:
    """A batch's state of each of its renders, a byte each, whether that is in memory or a row of the store. For the
    event loop, but for `copy`, which is its caller's."""

    def __init__(self, codes: bytes) -> None:
        self._codes = bytearray(codes)
        self.made = self.ended = 0  # how many
        self.last_end = 0.0  # by the monotonic clock
        self.busy_s, self.measured = 0.0, 0  # seconds that renders took which ended here, setup included

    @classmethod
    def of(cls, count: int) -> Steps:
        """So many renders, none of which is made."""
        return cls(bytes(count))

    def copy(self) -> Steps:
        """As they are now."""
        return Steps(bytes(self._codes))

    def make(self, step: int) -> None:
        """A render waits, or runs."""
        self._codes[step] = _UNDER_WAY
        self.made += 1

    def end(self, step: int, how: End, ended_at: float) -> None:
        """A render that was made has ended."""
        self._codes[step] = _FIRST_END + ENDED.index(how)
        self.ended += 1
        self.last_end = max(self.last_end, ended_at)

    def is_made(self, step: int) -> bool:
        return self._codes[step] != _NOT_MADE

    def is_under_way(self, step: int) -> bool:
        return self._codes[step] == _UNDER_WAY

    def how(self, step: int) -> End:
        """How a render that has ended did so."""
        return ENDED[self._codes[step] - _FIRST_END]

    def that(self, how: End) -> list[int]:
        """Those that ended so, in order."""
        code = _FIRST_END + ENDED.index(how)
        return [step for step, each in enumerate(self._codes) if each == code]

    def that_are_made(self) -> Iterator[int]:
        return (step for step, each in enumerate(self._codes) if each != _NOT_MADE)


# A new render of an order: its document where no store has it, its packed scene where there is one.
NewJob = Callable[[Order, bytes | None, Packed | None], Render]


class Members:
    """For one task of the event loop; the work is done in threads."""

    def __init__(self, batch: Batch, body: bytes, reader: RequestReader, new_job: NewJob) -> None:
        """`body`: the folded `{scene, settings}` that varies, which counts as the work at hand's for as long as this
        lives. For a thread. Raises TooLarge, TooManyRequests, Unavailable."""
        self._batch, self._reader, self._new_job = batch, reader, new_job
        text = unfolded(body)
        reader.memory.hold(reader.batch_memory, self, most_bytes(text) + most_bytes(batch.order.axes))
        self._variations = variations(json.loads(text), batch.order.axes)
        self._cache = PackCache(budget=reader.caches)
        self._before: Parsed | None = None

    async def check(self) -> None:
        """Raise what packing the first render's scene raises."""
        await packing(self._check, self._batch.client)

    async def job(self, step: int, stored: bool) -> Render:
        """A render that is ready to be queued. One whose scene cannot be packed says why when its turn comes."""
        document, settings, packed = await packing(partial(self._packed, step), self._batch.client)
        order, label = self._batch.order, self._variations.name(step)[:LONGEST_LABEL]
        member = Order(
            member_id(self._batch.id, step), order.owner, settings, label, order.priority, order.created_at
        )
        base = None if stored else await packing(partial(folded, document["scene"]), self._batch.client)
        try:
            return self._new_job(member, base, packed)
        except TooLarge:
            return self._new_job(member, base, None)

    def _check(self) -> None:
        document = self._variations.document(0)
        scene = self._reader.scene(document["scene"])
        self._before = Parsed(document["scene"], scene)
        self._reader.pack(scene, self._cache, owner=self._batch.owner)

    def _packed(self, step: int) -> tuple[dict[str, Any], ResolvedSettings, Packed | None]:
        document, settings = self._variations.document(step), resolve(Settings())
        try:
            settings = self._reader.settings(document["settings"])
            scene = self._reader.scene(document["scene"], self._before)
            self._before = Parsed(document["scene"], scene)
            return document, settings, self._reader.pack(scene, self._cache, owner=self._batch.owner)
        except (InvalidDocument, ServiceError):
            return document, settings, None
