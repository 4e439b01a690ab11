"""Where the slow work of the server is done, so that neither the event loop nor each other waits for it."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from service.rendering.priority import raise_thread_niceness

NICENESS = 5  # steps above the event loop and the encoders, of what packs scenes; the renderer is 10 above

T = TypeVar("T")


def _yield_to_others() -> None:
    raise_thread_niceness(os.getpriority(os.PRIO_PROCESS, os.getpid()) + NICENESS)


_PACKING = ThreadPoolExecutor(2, "packing", _yield_to_others)  # parsing and packing scenes: seconds for the largest
_ENCODING = ThreadPoolExecutor(2, "encoding")  # frames to JPEG and the like: milliseconds, and somebody looks
_WRITING = ThreadPoolExecutor(2, "writing", _yield_to_others)  # pictures to files: seconds for the largest


class Lane:
    """A thread for one client's parsing and packing, begun at its first work: whoever asks for much waits alone."""

    def __init__(self, name: str) -> None:
        self._threads = ThreadPoolExecutor(1, name, _yield_to_others)

    async def run(self, work: Callable[[], T]) -> T:
        return await asyncio.get_running_loop().run_in_executor(self._threads, work)

    def close(self) -> None:
        self._threads.shutdown(wait=False, cancel_futures=True)


async def packing(work: Callable[[], T]) -> T:
    return await asyncio.get_running_loop().run_in_executor(_PACKING, work)


async def encoding(work: Callable[[], T]) -> T:
    return await asyncio.get_running_loop().run_in_executor(_ENCODING, work)


async def writing(work: Callable[[], T]) -> T:
    return await asyncio.get_running_loop().run_in_executor(_WRITING, work)
