"""Ended renders whose scenes and pictures stay with the renderer, so that looking at them takes no time."""

from __future__ import annotations

import asyncio
import concurrent.futures
import contextlib
from collections import OrderedDict

from service.server.renders.job import Job
from service.server.renders.life import PictureAt

# Bytes of them; the last one stays however large it is. The others come back from the disk.
RESTING_BYTES = 256 << 20
RESTING = 256  # renders: each takes 20 KB in this process, too
SHRINK_S = 0.5  # how long a thread waits for the event loop to free memory


class Resting:
    """For the event loop, but for `shrink`."""

    def __init__(self) -> None:
        self._renders: OrderedDict[str, Job] = OrderedDict()  # the last one looked at last
        self._loop: asyncio.AbstractEventLoop | None = None

    @property
    def bytes(self) -> int:
        """About the memory that they take."""
        return sum(each.resident_bytes for each in self._renders.values() if _rests(each))

    def add(self, job: Job) -> None:
        """Keep a render that has ended, or waits, with the renderer if it is there, and let others go that have not
        been looked at for longer."""
        self._loop = asyncio.get_running_loop()
        self._renders.pop(job.id, None)
        self._renders[job.id] = job
        for each in list(self._renders.values()):
            if not _rests(each):
                del self._renders[each.id]
        total = self.bytes
        for each in list(self._renders.values())[:-1]:
            if total <= RESTING_BYTES and len(self._renders) <= RESTING:
                break
            size = each.resident_bytes
            if each.rest():
                total -= size
                del self._renders[each.id]

    def remove(self, job: Job) -> None:
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
            if job.rest():
                size -= freed
                del self._renders[job.id]


def _rests(job: Job) -> bool:
    """Whether a renderer has its picture and adds nothing to it: it ended, or it gave way and was looked at."""
    return job.resident_bytes > 0 and (job.finished.is_set() or job.picture_at is PictureAt.BOTH)
