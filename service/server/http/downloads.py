"""Large answers: sent in pieces, as the client takes them, from files and not from memory, but for small ones.

Pictures are encoded one at a time for each caller, so that a caller that requests many delays only itself.
"""

from __future__ import annotations

import asyncio
import errno
import logging
import os
import tempfile
import weakref
from collections import OrderedDict
from collections.abc import AsyncIterator, Callable, Hashable, Iterator, Mapping
from contextlib import asynccontextmanager, contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import BinaryIO

from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.problems import TooLarge, Unavailable
from service.system.disk_usage import FULL, trouble
from service.system.executors import KeyedLocks
from service.system.memory import MemoryBudget, Reservation
from service.system.shares import Shares

SMALL = 1 << 20  # bytes of an answer that is made in memory, and needs no disk
PIECE = 1 << 18  # bytes that are read and sent at a time
AT_ONCE = 2  # pictures that are fetched from the renderer and encoded at the same time
LASTING = 16  # files that stay when they were sent
ROOM = 4 << 30  # bytes on the disk of pictures that are being sent, of all clients
RETRY_S = 10
READ_ONLY = {errno.EACCES, errno.EPERM, errno.EROFS}

log = logging.getLogger(__name__)


class Pieces:
    """ASGI middleware that sends bodies from memory in pieces: nothing is copied whole into the connection."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def sending(message: Message) -> None:
            body = message.get("body", b"")
            if message["type"] != "http.response.body" or len(body) <= PIECE:
                return await send(message)
            view, more = memoryview(body), message.get("more_body", False)
            for start in range(0, len(body), PIECE):
                end = start + PIECE
                await send({**message, "body": view[start:end], "more_body": more or end < len(body)})

        await self._app(scope, receive, sending if scope["type"] == "http" else send)


class FileAnswer(Response):
    """The bytes of an open file, which need not have a name. A reference to `source` lasts until the answer's end."""

    def __init__(self, file: BinaryIO, media_type: str, headers: Mapping[str, str], source: object = None) -> None:
        self._file = file
        self._source = source
        self._size = os.fstat(file.fileno()).st_size
        super().__init__(None, media_type=media_type, headers={**headers, "content-length": str(self._size)})

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        sent = 0
        async with present(receive) as gone:
            await send({"type": "http.response.start", "status": self.status_code, "headers": self.raw_headers})
            while not gone():
                data = await asyncio.to_thread(os.pread, self._file.fileno(), PIECE, sent)
                sent += len(data)
                if not data and sent < self._size:
                    raise OSError(f"a file became shorter while it was sent: {sent} of {self._size} bytes")
                await send({"type": "http.response.body", "body": data, "more_body": sent < self._size})
                if sent >= self._size:
                    break
        self._source = None


@asynccontextmanager
async def present(receive: Receive) -> AsyncIterator[Callable[[], bool]]:
    """A function that says whether the client is still there; what it still sends is discarded."""
    listening = asyncio.ensure_future(disconnected(receive))
    try:
        yield lambda: listening.done() and listening.exception() is None
    finally:
        listening.cancel()
        await asyncio.gather(listening, return_exceptions=True)


async def disconnected(receive: Receive) -> None:
    """Return once the client has gone away."""
    while (await receive())["type"] != "http.disconnect":
        pass


class Written:
    """A picture's file, on the disk or in memory. It has no name, and is deleted with the last reference to this
    object, as its memory is released with that to `source`."""

    def __init__(self, file: BinaryIO, source: object = None) -> None:
        self.file, self._source = file, source
        self.bytes = os.fstat(file.fileno()).st_size

    @property
    def is_modest(self) -> bool:
        """True if as many as stay would leave room for others."""
        return self.bytes <= (SMALL if self._source is not None else ROOM // (2 * LASTING))


class Downloads:
    """Pictures that are written and sent, for the event loop."""

    def __init__(self, folder: Path, memory: MemoryBudget | None = None) -> None:
        self._folder, self._memory = folder, memory or MemoryBudget()
        self._room = asyncio.Semaphore(AT_ONCE)
        self._turns = KeyedLocks[str]()
        self._lasting = OrderedDict[Hashable, Written]()  # the last ones that took long to make
        self._written: weakref.WeakValueDictionary[Hashable, Written] = weakref.WeakValueDictionary()
        self._shares = Shares(ROOM, "pictures that are being sent", retry_s=RETRY_S)  # bytes on the disk

    @asynccontextmanager
    async def turn(self, caller: str) -> AsyncIterator[None]:
        """Wait for the caller's turn to have a picture written: each caller has one at a time."""
        async with self._turns.of(caller), self._room:
            yield

    async def answer(
        self, caller: str, data: bytes, media_type: str, headers: Mapping[str, str] | None = None
    ) -> Response:
        """An answer that takes little memory: a large one is sent from a file. Raises Unavailable."""
        if len(data) <= PIECE:
            return Response(data, media_type=media_type, headers=headers)

        def fill(file: BinaryIO) -> None:
            file.write(data)

        self.admit(caller, len(data))
        written = await asyncio.to_thread(self.write, fill, len(data))
        self.keep(caller, None, written)
        return FileAnswer(written.file, media_type, headers or {}, written)

    def find(self, key: Hashable) -> Written | None:
        """A picture that is still being sent to somebody."""
        return self._written.get(key)

    def admit(self, caller: str, most_bytes: int) -> None:
        """Raise TooManyRequests or Unavailable where `most_bytes` more exceed the caller's share or the room of all.

        A picture of more than a quarter of the room counts as a quarter, so that pictures of any size can be sent.
        """
        self._shares.check(caller, min(most_bytes, ROOM // 4))

    @contextmanager
    def making(self, caller: str, most_bytes: int) -> Iterator[None]:
        """A context in which `most_bytes` count, as `admit` has them: what takes long to make counts meanwhile."""
        with self._shares.taken(caller, min(most_bytes, ROOM // 4)):
            yield

    def write(self, fill: Callable[[BinaryIO], object], most_bytes: int) -> Written:
        """A file that `fill` has written, of about `most_bytes`. For any thread. A small one is in memory, as is one
        for which the disk has no room; `fill` is then called again. Raises Unavailable where neither has room."""
        if most_bytes <= SMALL:
            with suppress(Unavailable, TooLarge, OSError):
                return self._in_memory(fill, most_bytes)
        try:
            file = self._new_file()
            fill(file)
            file.flush()
            return Written(file)
        except OSError as error:
            log.error("could not write an answer to the disk", {"error": error})
            reason = trouble(error, self._folder)
            detail = f"The answer could not be written: {reason}"
            if error.errno is None and reason != FULL:  # what writes it failed, and not the disk
                raise Unavailable(f"{detail}.", RETRY_S) from None
        try:
            return self._in_memory(fill, most_bytes)
        except (Unavailable, TooLarge):
            raise Unavailable(f"{detail}, and there is no memory for it (SUNBOX_MEMORY).", RETRY_S) from None
        except OSError:
            raise Unavailable(f"{detail}.", RETRY_S) from None

    def _in_memory(self, fill: Callable[[BinaryIO], object], most_bytes: int) -> Written:
        """Raises Unavailable, TooLarge where the memory of all callers has no room."""
        holder = Reservation()
        self._memory.hold("pictures", holder, most_bytes)
        file = os.fdopen(os.memfd_create("answer"), "w+b")
        fill(file)
        file.flush()
        written = Written(file, holder)
        self._memory.hold("pictures", holder, written.bytes)
        return written

    def _new_file(self) -> BinaryIO:
        """A file without a name beside the data, or a temporary one where the data is read-only."""
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            return tempfile.TemporaryFile(dir=self._folder)
        except OSError as error:
            if error.errno not in READ_ONLY:
                raise
            return tempfile.TemporaryFile()

    def keep(self, caller: str, key: Hashable | None, written: Written, lasting: bool = False) -> None:
        """Count a picture while it is being sent; with `key`, `find` leads other requests to it. One that took long
        to make is `lasting`: it stays for later requests, too, until others of that kind took its place."""
        if lasting and written.is_modest:
            self._lasting[key] = written
            while len(self._lasting) > LASTING:
                self._lasting.popitem(last=False)
        if key is not None:
            self._written[key] = written
        self._shares.count(caller, written.bytes)
        release = partial(self._shares.release, caller, written.bytes)
        weakref.finalize(written, _call_in, asyncio.get_running_loop(), release)


def _call_in(loop: asyncio.AbstractEventLoop, work: Callable[[], None]) -> None:
    """Have the loop do it: a finalizer runs in whichever thread drops the last reference, and in between anything."""
    with suppress(RuntimeError):  # the loop is closed
        loop.call_soon_threadsafe(work)
