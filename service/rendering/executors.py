"""Threads for the server's slow work: neither the event loop nor another kind of work waits for it."""

from __future__ import annotations

import asyncio
import os
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, TypeVar

from service.rendering.priority import raise_thread_niceness

# Steps of niceness above the event loop and the encoders; the renderer is 10 above.
NICENESS = 5  # of threads that parse and pack scenes, for which a client waits
WRITING_NICENESS = 12  # of threads that write large pictures to files while every stream goes on

T = TypeVar("T")


def _yield_to_others(niceness: int = NICENESS) -> None:
    raise_thread_niceness(os.getpriority(os.PRIO_PROCESS, os.getpid()) + niceness)


@dataclass(frozen=True)
class _Work:
    run: Callable[[], Any]
    result: Future[Any]


class Pool:
    """Threads for one kind of work, which waits for no other kind: `await pool(work, client)`.

    Turns go round the clients that have work here, and then in the order of arrival: one client with much work delays
    itself.
    """

    def __init__(self, name: str, threads: int, niceness: int = 0) -> None:
        self._threads = ThreadPoolExecutor(threads, name, _yield_to_others, (niceness,))
        self._lock = threading.Lock()
        self._waiting = dict[str, deque[_Work]]()  # by client; the first one's turn is next

    async def __call__(self, work: Callable[[], T], client: str = "") -> T:
        result = Future[T]()
        with self._lock:
            self._waiting.setdefault(client, deque()).append(_Work(work, result))
        self._threads.submit(self._run_next)
        return await asyncio.wrap_future(result)

    def _run_next(self) -> None:
        with self._lock:
            client, works = next(iter(self._waiting.items()))
            work = works.popleft()
            del self._waiting[client]
            if works:
                self._waiting[client] = works  # behind the others
        if not work.result.set_running_or_notify_cancel():
            return
        try:
            work.result.set_result(work.run())
        except BaseException as error:
            work.result.set_exception(error)


parsing = Pool("parsing", 2, NICENESS)  # small bodies: milliseconds
waiting_for_parsers = Pool("waiting", 2)  # waits for processes that parse large bodies: seconds
packing = Pool("packing", 2, NICENESS)  # scenes: seconds for the largest
storing = Pool("storing", 2, NICENESS)  # assets, which are parsed and hashed first: seconds
saving = Pool("saving", 2)  # documents: the disk's time
encoding = Pool("encoding", 2)  # frames to JPEG and the like: milliseconds, while a person watches
writing = Pool("writing", 2, WRITING_NICENESS)  # pictures to files: seconds for the largest
recording = Pool("recording", 1)  # the rows of renders, in order: the disk's time
saving_pictures = Pool("pictures", 1)  # of renders to the disk and back: seconds for the largest
sending = Pool("sending", 2)  # scenes to the renderer: copied to shared memory
tending = Pool("tending", 2)  # ends and replaces renderers, and restores what they had rendered
measuring = Pool("measuring", 1)  # /metrics


class ClientExecutor:
    """A thread for one client's parsing and packing, started at first use: no client delays another."""

    def __init__(self, name: str) -> None:
        self._threads = ThreadPoolExecutor(1, name, _yield_to_others)

    async def run(self, work: Callable[[], T]) -> T:
        return await asyncio.get_running_loop().run_in_executor(self._threads, work)

    def close(self) -> None:
        self._threads.shutdown(wait=False, cancel_futures=True)
