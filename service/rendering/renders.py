"""All renders asked for over REST: some run, some wait, the newest finished ones are kept."""

from __future__ import annotations

import asyncio
from collections import OrderedDict

from service.problems import Gone, NotFound
from service.rendering.job import Job

RUNNING = 8  # at once; the others wait in line, for each holds its scene and its picture on the GPU
KEPT = 64  # finished ones ...
KEPT_BYTES = 1 << 30  # ... and what their pictures and scenes may hold
REMEMBERED = 10_000  # ids that are answered with "gone" and not with "unknown"


class Renders:
    def __init__(self) -> None:
        self._jobs: dict[str, Job] = {}
        self._gone: OrderedDict[str, None] = OrderedDict()
        self._room = asyncio.Semaphore(RUNNING)
        self._running: dict[asyncio.Task[None], Job] = {}

    def submit(self, job: Job, listed: bool = True) -> None:
        """Has it run when its turn comes; a job that is not `listed` is its owner's to release."""
        if listed:
            self._jobs[job.id] = job
        task = asyncio.get_running_loop().create_task(self._run(job))
        self._running[task] = job
        task.add_done_callback(self._running.pop)

    def get(self, id: str) -> Job:
        if id in self._gone:
            raise Gone("This render was finished long ago; its image made room for newer ones.")
        if id not in self._jobs:
            raise NotFound("There is no render of this id.")
        return self._jobs[id]

    @property
    def queued(self) -> int:
        return len(self._running) - self.running

    @property
    def running(self) -> int:
        return min(len(self._running), RUNNING)

    def all(self) -> list[Job]:
        return list(self._jobs.values())

    def close(self) -> None:
        for job in self._running.values():
            job.cancel()

    async def _run(self, job: Job) -> None:
        async with self._room:
            await job.run()
        self._evict()

    def _evict(self) -> None:
        finished = [job for job in self._jobs.values() if job.finished.is_set()]
        held = sum(job.bytes for job in finished)
        while finished[1:] and (len(finished) > KEPT or held > KEPT_BYTES):
            job = finished.pop(0)
            held -= job.bytes
            job.release()
            del self._jobs[job.id]
            self._gone[job.id] = None
        while len(self._gone) > REMEMBERED:
            self._gone.popitem(last=False)
