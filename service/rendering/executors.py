"""Where the slow work of the server is done, so that neither the event loop nor each other waits for it."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from service.rendering.priority import raise_thread_niceness

# Steps of niceness above the event loop and the encoders; the renderer is 10 above.
NICENESS = 5  # of what parses and packs scenes, for which a client waits
WRITING_NICENESS = 12  # of what writes large pictures to files, beside which every stream goes on

T = TypeVar("T")


def _yield_to_others(niceness: int = NICENESS) -> None:
    raise_thread_niceness(os.getpriority(os.PRIO_PROCESS, os.getpid()) + niceness)


class Pool:
    """Threads for one kind of work, which waits for no other kind: `await pool(work)`."""

    def __init__(self, name: str, threads: int, niceness: int = 0) -> None:
        self._threads = ThreadPoolExecutor(threads, name, _yield_to_others, (niceness,))

    async def __call__(self, work: Callable[[], T]) -> T:
        return await asyncio.get_running_loop().run_in_executor(self._threads, work)


parsing = Pool("parsing", 2, NICENESS)  # small bodies: milliseconds
waiting_for_parsers = Pool("waiting", 2)  # of large ones, each in a process of its own: seconds
packing = Pool("packing", 2, NICENESS)  # scenes: seconds for the largest
storing = Pool("storing", 2, NICENESS)  # assets, which are parsed and hashed first: seconds
saving = Pool("saving", 2)  # documents: the disk's time
encoding = Pool("encoding", 2)  # frames to JPEG and the like: milliseconds, and somebody looks
writing = Pool("writing", 2, WRITING_NICENESS)  # pictures to files: seconds for the largest
sending = Pool("sending", 2)  # scenes to the renderer: copied to shared memory
tending = Pool("tending", 2)  # the renderers' ends and replacements, and what they rendered before
measuring = Pool("measuring", 1)  # /metrics


class ClientExecutor:
    """A thread for one client's parsing and packing, begun at its first work: whoever asks for much waits alone."""

    def __init__(self, name: str) -> None:
        self._threads = ThreadPoolExecutor(1, name, _yield_to_others)

    async def run(self, work: Callable[[], T]) -> T:
        return await asyncio.get_running_loop().run_in_executor(self._threads, work)

    def close(self) -> None:
        self._threads.shutdown(wait=False, cancel_futures=True)
