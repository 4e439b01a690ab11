"""Threads for the server's slow work: neither the event loop nor another kind of work waits for it; and locks by
caller, for what each does one at a time."""

from __future__ import annotations

import asyncio
import threading
import weakref
from collections import Counter
from collections.abc import Callable, Hashable
from concurrent.futures import Future, ThreadPoolExecutor
from contextvars import copy_context
from dataclasses import dataclass
from functools import partial
from typing import Any, Generic, TypeVar

from service.system.cpu import raise_thread_niceness, working_niceness
from service.system.shares import CALLER
from service.system.turns import FairQueue

# Steps of niceness above the event loop and the encoders, as far as SUNBOX_NICE goes.
NICENESS = 5  # of threads that parse and pack scenes, for which a client waits
WRITING_NICENESS = 12  # of threads that write large pictures to files while every stream goes on

T = TypeVar("T")
K = TypeVar("K", bound=Hashable)


def _yield_to_others(niceness: int = NICENESS) -> None:
    raise_thread_niceness(working_niceness(niceness))


@dataclass(frozen=True, eq=False)
class _Work:
    run: Callable[[], Any]
    result: Future[Any]
    caller: str


class Pool:
    """Threads for one kind of work, which waits for no other kind: `await pool(work, caller)`.

    The next work is that of the caller with the fewest threads, then of the one whose turn is the longest ago: a
    caller with much work delays itself alone. None has more than `each` threads at a time: if work of minutes took
    all of them, nobody else would have a turn until it ended. So a pool has one thread more than one caller alone
    needs.
    """

    def __init__(self, name: str, threads: int, niceness: int = 0, each: int | None = None) -> None:
        """By default a caller has all threads but one, or the only one."""
        self._threads = ThreadPoolExecutor(threads, name, _yield_to_others, (niceness,))
        self._most = threads
        self._each = max(1, threads - 1) if each is None else each
        self._lock = threading.Lock()
        self._waiting: FairQueue[_Work] = FairQueue(lambda work: work.caller)
        self._running: Counter[str] = Counter()  # works, by caller
        self._busy = 0  # threads that have work, or look for some

    async def __call__(self, work: Callable[[], T], caller: str | None = None) -> T:
        """The result of `work`, in the context of this call. `caller` is by default that of the work at hand."""
        caller = CALLER.get() if caller is None else caller
        context, result = copy_context(), Future[T]()
        context.run(CALLER.set, caller)
        with self._lock:
            self._waiting.add(_Work(partial(context.run, work), result, caller))
            if self._busy < self._most:
                self._busy += 1
                self._threads.submit(self._work)
        return await asyncio.wrap_future(result)

    def _work(self) -> None:
        while (work := self._next()) is not None:
            if work.result.set_running_or_notify_cancel():
                try:
                    work.result.set_result(work.run())
                except BaseException as error:
                    work.result.set_exception(error)
            with self._lock:
                self._running[work.caller] -= 1

    def _next(self) -> _Work | None:
        """The work whose turn it is; None where no caller may have another thread."""
        with self._lock:
            work = self._waiting.first(
                self._running.__getitem__, may=lambda caller: self._running[caller] < self._each
            )
            if work is None:
                self._busy -= 1
                return None
            self._waiting.take(work)
            self._running += Counter([work.caller])  # which drops those that have none
            return work


parsing = Pool("parsing", 3, NICENESS)  # small bodies: milliseconds
waiting_for_parsers = Pool("waiting", 3)  # waits for processes that parse large bodies: seconds
packing = Pool("packing", 3, NICENESS)  # scenes: seconds for the largest
storing = Pool("storing", 3, NICENESS)  # assets, which are parsed and hashed first: minutes for the largest
storing_small = Pool("small", 3, NICENESS)  # those of up to a megabyte: milliseconds
opening = Pool("opening", 3, NICENESS)  # finds assets and keeps them from being deleted: milliseconds
saving = Pool("saving", 3)  # documents: the disk's time
encoding = Pool("encoding", 3)  # frames to JPEG and the like: milliseconds, while a person watches
answering = Pool("answering", 2)  # lists as JSON: milliseconds
writing = Pool("writing", 3, WRITING_NICENESS)  # pictures to files: seconds for the largest
filming = Pool("filming", 2, WRITING_NICENESS)  # waits for processes that write animations: minutes
comparing = Pool("comparing", 3, WRITING_NICENESS)  # pictures: seconds for the largest
recording = Pool("recording", 1)  # the rows of renders, in order: the disk's time
saving_pictures = Pool("pictures", 1)  # small ones of renders to the disk and back: milliseconds
saving_large_pictures = Pool("large", 1, NICENESS)  # seconds for the largest, while others' renders end
reading_large_pictures = Pool("reading", 1)  # for which somebody waits
resolving = Pool("resolving", 4)  # names of hosts that are told of ends: seconds where a name server is silent
sending = Pool("sending", 3)  # scenes to the renderer: copied to shared memory
tending = Pool("tending", 3)  # ends and replaces renderers, and restores what they had rendered
measuring = Pool("measuring", 1)  # /metrics


class ClientExecutor:
    """A thread for one client's parsing and packing, started at first use: no client delays another."""

    def __init__(self, name: str) -> None:
        self._threads = ThreadPoolExecutor(1, name, _yield_to_others)

    async def run(self, work: Callable[[], T]) -> T:
        return await asyncio.get_running_loop().run_in_executor(self._threads, copy_context().run, work)

    def close(self) -> None:
        self._threads.shutdown(wait=False, cancel_futures=True)


class KeyedLocks(Generic[K]):
    """A lock for each key, on the event loop: `async with locks.of(caller):` lets a caller do one thing at a time."""

    def __init__(self) -> None:
        self._locks: weakref.WeakValueDictionary[K, asyncio.Lock] = weakref.WeakValueDictionary()

    def of(self, key: K) -> asyncio.Lock:
        return self._locks.setdefault(key, asyncio.Lock())
