"""The slots of SUNBOX_MAX_RUNNING: which renders run, which wait, and which give way to others.

Those of a client with more slots than its share give way, or the longest ones.
A render that gives way is stored and goes on later, so that it costs a checkpoint and loading its scene again.
"""

from __future__ import annotations

import asyncio
import itertools
import logging
import time
from collections import Counter, deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain, islice
from typing import Protocol, TypeVar

from service.server.renders.render import Render
from service.system.background import Background, reported
from service.system.turns import FairQueue

AGAIN_S = 5.0  # between two attempts to begin a render that waits for memory, the disk or a renderer
LOOK_S = 1.0  # between two looks at the renders that wait
PATIENCE_S = 30.0  # for which others pass a render that waits for memory; then, for as long, only small ones do
AT_ONCE = 64  # renders that are looked at in one go, which takes a millisecond
FEW = 8  # of one owner
SMALL = 4  # so many small renders in every slot would take all memory
WAIT_S = 10.0  # that a render waits before others give way to it
SOON_S = 1.0  # instead, where its client has nothing and had less than LITTLE_S within the last minute
# A client that comes again and again with a little interrupts others for that part of the time at most: each
# interruption costs them a checkpoint and a scene to load.
LITTLE_S = 1.0
TIMES = 2  # a render gives way once it has run this many times as long as the waiting one
RECENT_S = 60.0  # for which a turn at a slot counts after its end

log = logging.getLogger(__name__)


class Slots:
    """For the event loop. A render has a slot and its memory, or neither of them."""

    def __init__(
        self, most: int, ended: Callable[[Render], None], clock: Callable[[], float] = time.monotonic
    ) -> None:
        """`ended` is called with each render whose slot is free for good."""
        self.waiting: FairQueue[Render] = FairQueue(lambda job: job.owner, _place)
        self._arrivals = itertools.count(1)
        self.closing = False
        self._most = most
        self._ended = ended
        self._clock = clock
        self._running: dict[asyncio.Task[None], Render] = {}
        self._recent = Recent(clock)
        self._since: dict[Render, float] = {}  # when each that waits came into line
        self._starved: dict[Render, float] = {}  # those that something is missing for, since when, the longest first
        self._retry_later: dict[Render, None] = {}  # of these, those that are not tried now, the next ones first
        self._tried_at = 0.0
        self._claimant: Render | None = None  # the one that others are giving way to
        self._yielding: set[Render] = set()  # these others
        self._timer: asyncio.TimerHandle | None = None
        self._tasks = Background()

    @property
    def running(self) -> list[Render]:
        """In the order in which they began."""
        return list(self._running.values())

    def add(self, job: Render) -> None:
        """Have it wait; `dispatch` starts it when its turn comes. One that has waited before has its place again."""
        job.place = job.place or next(self._arrivals)
        self.waiting.add(job)
        self._since[job] = self._clock()

    def remove(self, job: Render) -> bool:
        """True if it was waiting."""
        self._starved.pop(job, None)
        self._retry_later.pop(job, None)
        self._since.pop(job, None)
        return self.waiting.remove(job)

    def close(self) -> None:
        """Start nothing any more."""
        self.closing = True
        if self._timer is not None:
            self._timer.cancel()

    def dispatch(self) -> None:
        """Start what may run."""
        while not self.closing and self._free > 0:
            running = Counter(job.owner for job in self._running.values())
            job = self.waiting.first(partial(self._has, running), self._fits, self._may_have_one)
            if job is None:
                break
            self.waiting.take(job)
            self._start(job)
        self._look_later()

    def _has(self, running: Counter[str], owner: str) -> tuple[int, bool]:
        """How many renders of an owner run; among equals one whose render had begun goes on first."""
        return running[owner], not self.waiting.line(owner)[0].began

    @property
    def _free(self) -> int:
        """Slots that nobody has, without the one that others give way for."""
        stay = sum(job not in self._yielding for job in self._running.values())
        return self._most - max(len(self._running), stay + (self._claimant is not None))

    def _may_have_one(self, owner: str) -> bool:
        """True if an owner may have a slot that is free. While several owners have renders here, or had within the
        last minute, the last one is for owners who have none: they would wait until somebody has given way."""
        running = {job.owner for job in self._running.values()}
        if self._free > 1 or not owner or owner not in running:
            return True
        return len({*running, *self.waiting.callers, *self._recent.owners}) == 1

    def _look(self) -> None:
        self._timer = None
        with reported("look at who waits", lambda _: self._look_later()):
            if self._clock() - self._tried_at >= AGAIN_S:
                self._try_again()
            self.dispatch()
            if self._claimant is None and not self.closing:
                self._make_way()

    def _look_later(self) -> None:
        if self._timer is None and len(self.waiting) and not self.closing:
            self._timer = asyncio.get_running_loop().call_later(LOOK_S, self._look)

    def _try_again(self) -> None:
        for job in list(islice(self._retry_later, AT_ONCE)):
            del self._retry_later[job]
        self._tried_at = self._clock()

    def _start(self, job: Render) -> None:
        self._starved.pop(job, None)
        self._since.pop(job, None)
        self._recent.begins(job)
        task = self._tasks.start("render", job.run(), job.died)
        self._running[task] = job
        task.add_done_callback(self._on_finished)

    def _on_finished(self, task: asyncio.Task[None]) -> None:
        job = self._running.pop(task)
        self._recent.ends(job)
        if job in self._yielding and not job.finished.is_set():
            return
        if job.finished.is_set() or self.closing:
            self._try_again()  # it gave its memory back
            self._ended(job)
        else:
            self.add(job)
            self._starve(job)
        self.dispatch()

    def _starve(self, job: Render) -> None:
        self._starved.setdefault(job, self._clock())
        self._retry_later[job] = None

    def _fits(self, job: Render) -> bool:
        """True if it may begin now; its memory is counted then."""
        if job in self._retry_later or self._yields_memory(job) or not self._in_share(job):
            return False
        if job.reserve():
            return True
        self._starve(job)
        return False

    def _yields_memory(self, job: Render) -> bool:
        """True while a large render is waiting for memory that this one would use: no stream of renders starves it.

        Only for half of the time, as what that one waits for may be endless."""
        first = next(iter(self._starved), job)
        waited = self._clock() - self._starved.get(first, self._clock())
        return first is not job and int(waited / PATIENCE_S) % 2 == 1 and job.memory_share > 1 / (SMALL * self._most)

    def _in_share(self, job: Render) -> bool:
        """True if it may have a slot that it cannot give back: of these an owner leaves half to the others."""
        if job.lasting or not job.owner:
            return True
        fixed = Counter(each.owner for each in self._running.values() if not each.lasting)
        theirs, others = fixed[job.owner], fixed.total() - fixed[job.owner]
        return theirs == 0 or 2 * theirs < self._most - others

    def _make_way(self) -> None:
        """Have others give way to a render that has waited for long, if that is fair."""
        now, running = self._clock(), self.running
        counts = Counter(job.owner for job in running)
        owners = sorted(self.waiting.callers, key=lambda owner: counts[owner])
        for waiting in islice(chain.from_iterable(map(self._firsts, owners)), AT_ONCE):
            if not (self._waited_enough(waiting, now - self._since[waiting]) and self._in_share(waiting)):
                continue
            free = self._free if self._may_have_one(waiting.owner) else 0
            chosen = giving_way(waiting, running, free, waiting.lacks)
            if chosen:
                self._claimant, self._yielding = waiting, set(chosen)
                self._tasks.start("hand-over of slots", self._give_way(waiting, chosen), self._gave_up)
                return

    def _waited_enough(self, waiting: Render, waited_s: float) -> bool:
        """True if others may give way to it. They do so soon where its client has nothing, and has had little lately
        or lacks a slot alone, of which another client has several."""
        if not SOON_S <= waited_s < WAIT_S:
            return waited_s >= WAIT_S
        counts = Counter(job.client for job in self._running.values())
        if counts[waiting.client]:
            return False
        has_several = max(counts.values(), default=0) > 1
        return self._recent.seconds(waiting.client) < LITTLE_S or (has_several and not waiting.lacks)

    def _firsts(self, owner: str) -> list[Render]:
        """Those of an owner for which others may give way: the first that gave way itself, and some that begin."""
        line = self.waiting.line(owner)
        began = [job for job in line[:1] if job.began]
        return began + list(islice((job for job in line if not job.began), FEW))

    async def _give_way(self, waiting: Render, chosen: list[Render]) -> None:
        tasks = {job: task for task, job in self._running.items() if job in self._yielding}
        gave = await asyncio.gather(*(job.give_way() for job in chosen))
        for job, gives in zip(chosen, gave, strict=True):
            if gives:
                await asyncio.wait([tasks[job]])
                log.info("a render gave way to another one", {"id": job.id[:6], "to": waiting.id[:6]})
        await asyncio.sleep(0)  # for `_on_finished`
        self._handed_over(waiting)

    def _gave_up(self, error: Exception) -> None:
        """An error of the server ended the hand-over: renders that gave their slots back by then queue again."""
        if self._claimant is not None:
            self._handed_over(self._claimant)

    def _handed_over(self, waiting: Render) -> None:
        left = self._yielding - set(self._running.values())
        self._claimant, self._yielding = None, set()
        self._retry_later.pop(waiting, None)
        if waiting in self.waiting and not self.closing and self._free > 0 and self._fits(waiting):
            self.waiting.take(waiting)
            self._start(waiting)
        for job in left:
            if not job.finished.is_set():
                self.add(job)
        self.dispatch()


def _place(render: Render) -> tuple[bool, int, int]:
    """The place in its owner's line: what had begun goes on first, then the highest priority, then the oldest."""
    return not render.began, -render.priority, render.place


class Interruptible(Protocol):
    @property
    def client(self) -> str:
        """The client that has the slot: its owner, or where there are no owners the render alone."""

    @property
    def owner(self) -> str: ...

    @property
    def priority(self) -> int: ...

    @property
    def place(self) -> int:
        """It rises in the order of arrival."""

    @property
    def elapsed_s(self) -> float:
        """For how long it has been rendered."""

    @property
    def resident_bytes(self) -> int:
        """The memory that it gives back."""

    @property
    def can_give_way(self) -> bool: ...


T = TypeVar("T", bound=Interruptible)


def giving_way(waiting: T, running: Sequence[T], free: int, lacks: int) -> list[T]:
    """Those of `running` that give way to a render that has waited for long; none where that would not be fair.

    `free`: slots; `lacks`: bytes of memory that are missing. A client that has at least two slots more than the
    waiting one gives back the render that it would have begun last. Where there are more clients than slots, slots
    go round by time [least attained service, Nuyens and Wierman 2008]: the render that has had most time gives way to
    one that has had at most half of that, so that it is interrupted a few times however long it is.
    """
    counts = Counter(each.client for each in running)
    left = [each for each in running if each.can_give_way]
    chosen: list[T] = []
    while lacks > 0 or not (free or chosen):
        theirs = counts[waiting.client]
        most = max((counts[each.client] for each in left), default=0)
        if most > theirs + 1:
            rich = [each for each in left if counts[each.client] == most]
            gives = max(rich, key=lambda each: (-each.priority, each.place))
        elif theirs == 0 and (long := [each for each in left if _had_enough(each, waiting)]):
            gives = max(long, key=lambda each: each.elapsed_s)
        else:
            return []
        left.remove(gives)
        chosen.append(gives)
        counts[gives.client] -= 1
        lacks -= gives.resident_bytes
    return chosen


def _had_enough(render: Interruptible, waiting: Interruptible) -> bool:
    if render.owner == waiting.owner and render.priority > waiting.priority:
        return False
    return render.elapsed_s >= max(WAIT_S, TIMES * waiting.elapsed_s)


@dataclass(frozen=True)
class _Turn:
    ended: float
    owner: str
    client: str
    ms: int  # for which it was rendered; whole ones, whose sums lose nothing


class Recent:
    """For the event loop."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._began: dict[Interruptible, float] = {}  # of those that run: for how long each had been rendered before
        self._turns: deque[_Turn] = deque()  # those that ended within the last minute, the first one first
        self._counts: Counter[str] = Counter()  # of these, by owner
        self._ms: Counter[str] = Counter()  # of these, by client

    def begins(self, render: Interruptible) -> None:
        """A render has a slot from now on."""
        self._began[render] = render.elapsed_s

    def ends(self, render: Interruptible) -> None:
        """A render has given its slot back."""
        ms = max(0, round(1000 * (render.elapsed_s - self._began.pop(render))))
        turn = _Turn(self._clock(), render.owner, render.client, ms)
        self._turns.append(turn)
        self._counts[turn.owner] += 1
        self._ms[turn.client] += ms

    @property
    def owners(self) -> set[str]:
        """Those whose turns ended within the last minute."""
        self._expire()
        return set(self._counts)

    def seconds(self, client: str) -> float:
        """For how long the renders of a client were rendered in turns that ended within the last minute."""
        self._expire()
        return self._ms[client] / 1000

    def _expire(self) -> None:
        while self._turns and self._turns[0].ended <= self._clock() - RECENT_S:
            turn = self._turns.popleft()
            self._counts[turn.owner] -= 1
            if not self._counts[turn.owner]:
                del self._counts[turn.owner]
            self._ms[turn.client] -= turn.ms
            if not self._ms[turn.client]:
                del self._ms[turn.client]
