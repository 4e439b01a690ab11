"""Retention of ended renders. First to make room are those of an owner of too many, those of the owner that stores
most, and old ones. Some stay with the renderer, so that looking at them takes no time; those of batches are rows of
the store, and objects while somebody looks at them, or the renderer has their pictures."""

from __future__ import annotations

import asyncio
import concurrent.futures
import contextlib
import logging
from collections import Counter, OrderedDict
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from service.problems import Gone, ServiceError
from service.server.renders.recorder import Recorder
from service.server.renders.render import InBatch, Render
from service.server.renders.status import PictureAt, monotonic
from service.server.renders.store.record import Order, Outcome
from service.server.renders.store.rows import EndedMember
from service.server.renders.store.store import RenderStore

# Bytes of them; the last one stays however large it is. The others come back from the disk.
RESTING_BYTES = 256 << 20
RESTING = 256  # renders: each takes 20 KB in this process, too
SHRINK_S = 0.5  # how long a thread waits for the event loop to free memory

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Retention:
    """Limits on the ended renders that are stored."""

    most_renders: int  # renders of each owner, of those of batches ten times as many
    most_bytes: int  # of the pictures and documents of all of them
    longest_s: float  # after a render's end


@dataclass(frozen=True)
class QueueLimits:
    """How many renders run and wait at once, and which of the ended ones are kept."""

    running: int  # renders; the others wait, as each has its scene and its picture on the GPU
    waiting: int
    each: int  # running and waiting, of one owner
    retention: Retention
    disk_bytes: int | None  # of SUNBOX_DATA_QUOTA, of which the documents of what waits have a part


class Retained(Protocol):
    @property
    def owner(self) -> str: ...

    @property
    def ended_at(self) -> float:
        """By the monotonic clock, s."""

    @property
    def size(self) -> int: ...

    @property
    def counts_as(self) -> int:
        """The number that it counts as among its owner's stored renders."""


T = TypeVar("T", bound=Retained)


class RetainedRenders(Generic[T]):
    """The ended renders within their bounds. What happens at an end does not grow with their number."""

    def __init__(self, bounds: Retention) -> None:
        self._bounds = bounds
        self._lines: dict[str, dict[T, int]] = {}  # sizes by owner, the oldest end first
        self._bytes: Counter[str] = Counter()
        self._renders: Counter[str] = Counter()
        self._count = 0
        self._newest: T | None = None

    def __len__(self) -> int:
        return self._count

    def add(self, render: T) -> None:
        """Keep one that has ended now; or count it by the size that it has by now. At a start they come in the order
        of their ends."""
        line = self._lines.setdefault(render.owner, {})
        if render not in line:
            self._newest = render
            self._count += 1
            self._renders[render.owner] += render.counts_as
        self._bytes[render.owner] += render.size - line.get(render, 0)
        line[render] = render.size

    def remove(self, render: T) -> None:
        line = self._lines.get(render.owner, {})
        if render in line:
            self._count -= 1
            self._newest = None if self._newest is render else self._newest
            self._bytes[render.owner] -= line.pop(render)
            self._renders[render.owner] -= render.counts_as
            if not line:
                del self._lines[render.owner], self._bytes[render.owner], self._renders[render.owner]

    def take_superfluous(self, now: float) -> list[T]:
        """Remove those to forget, by `now`. The newest one, and an owner's only one, stay until they are old, however
        large they are."""
        goes, bounds = list[T](), self._bounds
        for owner, line in list(self._lines.items()):
            while line and now - (first := next(iter(line))).ended_at >= bounds.longest_s:
                goes.append(self._take(first))
            while len(line) > 1 and self._renders[owner] > bounds.most_renders:
                goes.append(self._take(next(iter(line))))
        return goes + self._take_largest(self._bytes.total() - bounds.most_bytes)

    def take_for(self, size: int) -> list[T]:
        """Remove as many as take so many bytes, but for the newest one."""
        return self._take_largest(size)

    def left_s(self, now: float) -> float | None:
        """Seconds until the next one is old; None where there is none."""
        ends = [next(iter(line)).ended_at for line in self._lines.values()]
        return max(0.0, min(ends) + self._bounds.longest_s - now) if ends else None

    def _take_largest(self, size: int) -> list[T]:
        """Oldest renders of the owner that stores most, until `size` bytes are freed; not those of another owner of
        few."""
        goes = list[T]()
        while size > 0 and self._count > 1:
            for owner, _ in self._bytes.most_common(2):
                first = next(iter(self._lines[owner]))
                if first is not self._newest:
                    break
            size -= self._lines[owner][first]
            goes.append(self._take(first))
        return goes

    def _take(self, render: T) -> T:
        self.remove(render)
        return render


class LoadedPictures:
    """For the event loop, but for `shrink`."""

    def __init__(self) -> None:
        self._renders: OrderedDict[str, Render] = OrderedDict()  # the last one looked at last
        self._loop: asyncio.AbstractEventLoop | None = None

    @property
    def bytes(self) -> int:
        """About the memory that they take."""
        return sum(each.resident_bytes for each in self._renders.values() if _has_idle_picture(each))

    def add(self, job: Render) -> None:
        """Keep a render that has ended, or waits, with the renderer if it is there, and let others go that have not
        been looked at for longer."""
        self._loop = asyncio.get_running_loop()
        self._renders.pop(job.id, None)
        self._renders[job.id] = job
        for each in list(self._renders.values()):
            if not _has_idle_picture(each):
                del self._renders[each.id]
        total = self.bytes
        for each in list(self._renders.values())[:-1]:
            if total <= RESTING_BYTES and len(self._renders) <= RESTING:
                break
            size = each.resident_bytes
            if each.unload():
                total -= size
                del self._renders[each.id]

    def remove(self, job: Render) -> None:
        self._renders.pop(job.id, None)

    def shrink(self, size: int) -> None:
        """Have ended renders leave the renderer until they have freed that many bytes. For any thread."""
        loop = self._loop
        try:
            elsewhere = loop is not asyncio.get_running_loop()
        except RuntimeError:
            elsewhere = True
        if loop is None or not elsewhere:
            self._shrink(size)
            return
        with contextlib.suppress(concurrent.futures.TimeoutError, RuntimeError):  # busy, or closed
            asyncio.run_coroutine_threadsafe(self._shrunk(size), loop).result(SHRINK_S)

    async def _shrunk(self, size: int) -> None:
        self._shrink(size)

    def _shrink(self, size: int) -> None:
        for job in list(self._renders.values()):
            if size <= 0:
                break
            freed = job.resident_bytes
            if job.unload():
                size -= freed
                del self._renders[job.id]


def _has_idle_picture(job: Render) -> bool:
    """True if a renderer has its picture and adds nothing to it: it ended, or it gave way and was looked at."""
    return job.resident_bytes > 0 and (job.finished.is_set() or job.picture_at is PictureAt.BOTH)


Make = Callable[[Order, Outcome], Render]  # a render that has ended


def take_up(batches: Iterable[InBatch], ended: Iterable[EndedMember], store: RenderStore) -> None:
    """Tell batches of an earlier server which of their renders have ended."""
    known = {batch.number: batch for batch in batches}
    for each in ended:
        if (batch := known.get(each.batch)) is not None:
            batch.add_ended(each.step, each.state, monotonic(each.ended_at), store.picture_size(each.id))


async def move_to_row(job: Render, batch: InBatch, jobs: dict[str, Render]) -> None:
    """A render has ended: it leaves `jobs` once it is whole on the disk."""
    await job.recorded()
    if job.recorder is not None and job.recorder.whole:
        jobs.pop(job.id, None)
        batch.move_to_row(job)


async def looked_at(
    batch: InBatch, step: int, id: str, store: RenderStore | None, loaded_pictures: LoadedPictures, make: Make
) -> Render:
    """A render of a batch, brought back from the store where it is not in memory; its picture stays with
    `loaded_pictures`. Raises Gone."""
    job: Render | None = batch.job(step)
    if job is None and store is not None:
        stored = await store.one(id)
        job = batch.job(step)  # others may have been faster
        if job is None and stored is not None:
            job = batch.shown[step] = make(stored.order, stored.outcome)
            job.number, job.batch, job.loaded_pictures = stored.number, batch, loaded_pictures
            job.recorder = Recorder(store, stored.number, id, True, job.renderers, job.owner)
    if job is None or batch.gone:
        raise Gone("This render was deleted with its batch, or made room for newer ones.")
    return job


def in_memory(batch: InBatch) -> list[Render]:
    """The renders of a batch that are objects."""
    return [*batch.jobs.values(), *batch.shown.values()]


async def forget(dropped: Collection[Recorder | InBatch], store: RenderStore | None) -> None:
    """Delete renders and batches from the store."""
    if store is None:
        return
    batches = [each for each in dropped if not isinstance(each, Recorder)]
    recorders = [each for each in dropped if isinstance(each, Recorder)]
    members = [job.recorder for batch in batches for job in in_memory(batch) if job.recorder is not None]
    for recorder in recorders + members:
        await recorder.close()
    try:
        await store.forget([(recorder.number, recorder.id) for recorder in recorders])
        for batch in batches:
            await store.forget_batch(batch.number, list(batch.ids))
    except ServiceError as error:
        log.warning("could not delete renders from the disk", {"error": error})
