"""Messages between the server and the renderer's process: a datagram each, its arrays in one piece of shared memory.

A message is pickled (both ends are this program, on a private socket pair). Its arrays stay out of the pickle: they
are laid one after the other into a memfd, whose descriptor travels with the datagram. The receiver maps it and gets
read-only arrays without a copy. (A memfd, and not /dev/shm: a container's holds 64 MB.)
"""

from __future__ import annotations

import asyncio
import mmap
import os
import pickle
import socket
import struct
from collections import deque
from collections.abc import Callable
from typing import Any

INLINE = 32 * 1024  # bytes of a pickle; a longer one goes to memory: a datagram must fit the socket's buffer
ALIGNMENT = 64  # a cache line, and more than any dtype asks for
RECEIVED = 2 * INLINE
DESCRIPTOR = struct.Struct("i")
ROOM = socket.CMSG_SPACE(DESCRIPTOR.size)  # for one descriptor

Encoded = tuple[bytes, int | None]  # a datagram, and the descriptor of the memory that goes with it


class Closed(Exception):
    """The other end is gone."""


def pair() -> tuple[socket.socket, socket.socket]:
    return socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)


def encode(message: object) -> Encoded:
    """What to send; the caller discards it."""
    arrays: list[pickle.PickleBuffer] = []
    body = pickle.dumps(message, protocol=5, buffer_callback=arrays.append)
    parts = [array.raw() for array in arrays]
    spilled = len(body) > INLINE
    if spilled:
        parts.append(memoryview(body))
    sizes = [part.nbytes for part in parts]
    datagram = pickle.dumps((b"" if spilled else body, sizes))
    return datagram, _shared(parts) if any(sizes) else None


def decode(datagram: bytes, descriptor: int | None) -> Any:
    """The message; its arrays are read-only views of the mapped memory. Closes the descriptor."""
    body, sizes = pickle.loads(datagram)
    parts = [memoryview(b"")] * len(sizes)
    if descriptor is not None:
        try:
            memory = memoryview(mmap.mmap(descriptor, 0, prot=mmap.PROT_READ))
        finally:
            os.close(descriptor)
        parts = [memory[start : start + size] for start, size in zip(_starts(sizes), sizes, strict=True)]
    if not body:
        body = parts.pop()
    return pickle.loads(body, buffers=parts)


def receive(end: socket.socket, wait: bool = False) -> Any:
    """The next message. BlockingIOError: there is none, and it shall not `wait`. Closed: there will be none."""
    try:  # not socket.recv_fds, which in Python 3.11 forgets its flags and waits
        datagram, passed, _, _ = end.recvmsg(RECEIVED, ROOM, 0 if wait else socket.MSG_DONTWAIT)
    except ConnectionError as error:
        raise Closed from error
    if not datagram:
        raise Closed
    return decode(datagram, DESCRIPTOR.unpack(passed[0][2])[0] if passed else None)


def send(end: socket.socket, message: object) -> None:
    """Waits for room. Raises Closed when nobody listens any more."""
    encoded = encode(message)
    try:
        _transmit(end, *encoded)
    except ConnectionError as error:
        raise Closed from error
    finally:
        discard(encoded)


class Link:
    """The server's end: sends and receives on the event loop and never waits."""

    def __init__(self, end: socket.socket, receive: Callable[[Any], None], lost: Callable[[], None]) -> None:
        end.setblocking(False)
        self._end = end
        self._receive = receive
        self._lost = lost
        self._waiting: deque[Encoded] = deque()
        self.sent = 0  # that the other end can take
        self._loop = asyncio.get_running_loop()
        self._loop.add_reader(end, self._readable)

    def send(self, message: object) -> None:
        self.send_encoded(encode(message))

    def send_encoded(self, message: Encoded) -> None:
        """Sends what `encode` gave; its descriptor is the link's from now on."""
        if self._end.fileno() < 0:
            return discard(message)
        self._waiting.append(message)
        if len(self._waiting) == 1:
            self._writable()

    def close(self) -> None:
        if self._end.fileno() < 0:
            return
        self._loop.remove_reader(self._end)
        self._loop.remove_writer(self._end)
        self._end.close()
        while self._waiting:
            discard(self._waiting.popleft())

    def _readable(self) -> None:
        while self._end.fileno() >= 0:
            try:
                message = receive(self._end)
            except BlockingIOError:
                return
            except Closed:
                self._lose()
                return
            self._receive(message)

    def _writable(self) -> None:
        while self._waiting:
            try:
                _transmit(self._end, *self._waiting[0])
            except BlockingIOError:
                self._loop.add_writer(self._end, self._writable)
                return
            except ConnectionError:
                return  # the reader hears of it after what was still said
            self.sent += 1
            discard(self._waiting.popleft())
        self._loop.remove_writer(self._end)

    def _lose(self) -> None:
        self.close()
        self._lost()


def _transmit(end: socket.socket, datagram: bytes, descriptor: int | None) -> None:
    if descriptor is None:
        end.send(datagram)
    else:
        socket.send_fds(end, [datagram], [descriptor])


def discard(message: Encoded) -> None:
    """Gives back what an encoded message holds."""
    if message[1] is not None:
        os.close(message[1])


def _starts(sizes: list[int]) -> list[int]:
    starts, end = [], 0
    for size in sizes:
        starts.append(end)
        end += -(-size // ALIGNMENT) * ALIGNMENT
    return starts


def _shared(parts: list[memoryview]) -> int:
    descriptor = os.memfd_create("sunbox", os.MFD_CLOEXEC)
    sizes = [part.nbytes for part in parts]
    starts = _starts(sizes)
    try:
        os.ftruncate(descriptor, starts[-1] + sizes[-1] or 1)
        for start, part in zip(starts, parts, strict=True):
            written = 0
            while written < part.nbytes:  # a write stops at 2 GiB
                written += os.pwrite(descriptor, part[written:], start + written)
    except BaseException:
        os.close(descriptor)
        raise
    return descriptor
