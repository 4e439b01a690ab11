"""All renders asked for over REST: some run, some wait, finished ones are kept for a while. Each has its owner."""

from __future__ import annotations

import asyncio
import time
from collections import Counter, OrderedDict
from dataclasses import dataclass

from service.problems import Gone, NotFound, TooManyRequests, Unavailable
from service.rendering.jobs.job import Job

REMEMBERED = 10_000  # ids that are answered with "gone" and not with "unknown"
RETRY_S = 5  # when to ask again where there is no room


@dataclass(frozen=True)
class QueueLimits:
    """How many renders run at once, and which of the ended ones are kept."""

    running: int = 8  # renders; the others wait, as each has its scene and its picture on the GPU
    waiting: int = 256
    each: int = 64  # running and waiting, of one owner
    kept: int = 64  # ended, of one owner ...
    kept_bytes: int = 1 << 30  # ... what the pictures and scenes of all of them may hold ...
    kept_s: float = 3600.0  # ... and for how long


class RenderQueue:
    """The renders of all owners. An owner is a text that the caller chooses; nobody else learns of its renders."""

    def __init__(self, bounds: QueueLimits | None = None) -> None:
        self._bounds = bounds or QueueLimits()
        self._jobs: dict[str, Job] = {}
        self._gone: OrderedDict[str, str] = OrderedDict()  # the owners of forgotten ones
        self._room = asyncio.Semaphore(self._bounds.running)
        self._running: dict[asyncio.Task[None], Job] = {}

    def submit(self, job: Job, listed: bool = True) -> None:
        """Queue a job, which runs when its turn comes; the caller releases one that is not `listed`.

        Raises TooManyRequests where its owner has as many under way as one may have, Unavailable where the queue is
        full.
        """
        self.admit(job.owner)
        if listed:
            self._jobs[job.id] = job
        task = asyncio.get_running_loop().create_task(self._run(job))
        self._running[task] = job
        task.add_done_callback(self._running.pop)

    def admit(self, owner: str) -> None:
        """Raise what `submit` would raise, before a scene is read for nothing."""
        own = sum(job.owner == owner for job in self._running.values())
        if own >= self._bounds.each:
            detail = f"{own} renders of yours are under way: no more than {self._bounds.each} (SUNBOX_MAX_JOBS)"
            raise TooManyRequests(detail, RETRY_S)
        if self.queued >= self._bounds.waiting:
            raise Unavailable(f"{self.queued} renders are waiting; the queue is full (SUNBOX_MAX_QUEUE)", RETRY_S)

    def get(self, id: str, owner: str = "") -> Job:
        if self._gone.get(id) == owner:
            raise Gone("This render ended long ago, and made room for newer ones.")
        job = self._jobs.get(id)
        if job is None or job.owner != owner:
            raise NotFound("There is no render of this id.")
        return job

    @property
    def queued(self) -> int:
        return len(self._running) - self.running

    @property
    def running(self) -> int:
        return min(len(self._running), self._bounds.running)

    @property
    def kept(self) -> int:
        return sum(job.finished.is_set() for job in self._jobs.values())

    def all(self, owner: str = "") -> list[Job]:
        return [job for job in self._jobs.values() if job.owner == owner]

    def close(self) -> None:
        for job in self._running.values():
            job.cancel()

    async def _run(self, job: Job) -> None:
        async with self._room:
            await job.run()
        self._evict()
        # So that memory is freed also when no more requests come.
        asyncio.get_running_loop().call_later(self._bounds.kept_s + 1, self._evict)

    def _evict(self) -> None:
        ended = [job for job in self._jobs.values() if job.finished.is_set()]
        now = time.monotonic()
        for job in [job for job in ended if now - job.ended_at >= self._bounds.kept_s]:
            self._forget(job, ended)
        counts = Counter(job.owner for job in ended)
        for owner, count in counts.items():
            for job in [job for job in ended if job.owner == owner][: max(0, count - self._bounds.kept)]:
                self._forget(job, ended)
        while ended[1:] and sum(job.bytes for job in ended) > self._bounds.kept_bytes:
            held: Counter[str] = Counter()
            for job in ended:
                held[job.owner] += job.bytes
            most = held.most_common(1)[0][0]  # the owner of most pictures loses one, and not another owner of few
            self._forget(next(job for job in ended if job.owner == most), ended)

    def _forget(self, job: Job, ended: list[Job]) -> None:
        ended.remove(job)
        job.release()
        del self._jobs[job.id]
        self._gone[job.id] = job.owner
        while len(self._gone) > REMEMBERED:
            self._gone.popitem(last=False)
