"""Messages between the server and the renderer's process: a datagram each, its arrays in one piece of shared memory.

A message is pickled (both ends are this program, on a private socket pair). Its arrays stay out of the pickle: they
are laid one after the other into a memfd, whose descriptor travels with the datagram; those that already lie in a
block of `service.system.shared_memory` stay there, and its descriptor goes along. The receiver maps them and gets
read-only arrays without a copy. (A memfd, and not /dev/shm: a container's holds 64 MB.)
"""

from __future__ import annotations

import fcntl
import io
import mmap
import os
import pickle
import socket
import struct
from collections.abc import Callable
from typing import Any

from service.system import shared_memory

INLINE = 32 * 1024  # bytes of a pickle; a longer one goes to memory: a datagram must fit the socket's buffer
ALIGNMENT = 64  # a cache line, and more than any dtype asks for
RECEIVED = 2 * INLINE
DESCRIPTOR = struct.Struct("i")
# A sender that is not trusted must not change or shorten memory that was checked: mapping a truncated file raises
# SIGBUS.
SEALS = fcntl.F_SEAL_SEAL | fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_GROW | fcntl.F_SEAL_WRITE
MOST = 8  # descriptors that go with a datagram
ROOM = socket.CMSG_SPACE(MOST * DESCRIPTOR.size)

Encoded = tuple[bytes, tuple[int, ...]]  # a datagram, and the descriptors of the memory that goes with it
FindClass = Callable[[str, str], Any]  # of a module and a name: the class; raises UnpicklingError
Place = tuple[int, int, int]  # which descriptor, the first byte there, how many


class Closed(Exception):
    """The other end is gone."""


def pair() -> tuple[socket.socket, socket.socket]:
    return socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)


def encode(message: object, sealed: bool = False) -> Encoded:
    """The message as a datagram and descriptors; the caller discards them. `sealed`: as for `send`."""
    arrays: list[pickle.PickleBuffer] = []
    body = pickle.dumps(message, protocol=5, buffer_callback=arrays.append)
    parts = [array.raw() for array in arrays]
    spilled = len(body) > INLINE
    if spilled:
        parts.append(memoryview(body))
    places, copied, blocks = _places(parts)
    datagram = pickle.dumps((b"" if spilled else body, places))
    descriptors = [os.dup(block.descriptor) for block in blocks]
    if copied:
        try:
            descriptors.append(_shared(copied, sealed))
        except BaseException:
            discard((datagram, tuple(descriptors)))
            raise
    return datagram, tuple(descriptors)


def decode(datagram: bytes, descriptors: tuple[int, ...], find: FindClass | None = None) -> Any:
    """The message; its arrays are read-only views of the mapped memory. Closes the descriptors.

    `find` gives what the message may be made of, where its sender is not trusted. Raises UnpicklingError for anything
    else, and where its memory is not sealed.
    """
    try:
        body, places = _loads(datagram, [], find and _nothing)
        maps = [memoryview(_mapped(each, find is None)) for each in descriptors]
    finally:
        discard((datagram, descriptors))
    parts = [maps[which][at : at + size] if size else memoryview(b"") for which, at, size in places]
    if not body:
        body = parts.pop()
    return _loads(body, parts, find)


def _mapped(descriptor: int, trusted: bool) -> mmap.mmap:
    if trusted:
        return mmap.mmap(descriptor, 0, prot=mmap.PROT_READ)
    try:
        sealed = fcntl.fcntl(descriptor, fcntl.F_GET_SEALS) & SEALS == SEALS
    except OSError:  # it is no file in memory
        sealed = False
    if not sealed:
        raise pickle.UnpicklingError("the memory of a message could still change")
    # Private, because until Linux 6.7 a sealed file cannot be mapped as shared; nothing is copied.
    return mmap.mmap(descriptor, 0, flags=mmap.MAP_PRIVATE, prot=mmap.PROT_READ)


def _loads(body: bytes | memoryview, parts: list[memoryview], find: FindClass | None) -> Any:
    if find is None:
        return pickle.loads(body, buffers=parts)
    unpickler = _Restricted(io.BytesIO(body), buffers=parts)
    unpickler.find = find
    return unpickler.load()


def _nothing(module: str, name: str) -> Any:
    raise pickle.UnpicklingError(f"{module}.{name} has no place here")


class _Restricted(pickle.Unpickler):
    """Makes only what `find` gives."""

    find: FindClass

    def find_class(self, module: str, name: str) -> Any:
        return self.find(module, name)


def receive(end: socket.socket, wait: bool = False, find: FindClass | None = None) -> Any:
    """The next message; `find` as for `decode`. Raises BlockingIOError where there is none and `wait` is False,
    Closed where there will be none."""
    try:  # not socket.recv_fds, which in Python 3.11 forgets its flags and waits
        datagram, passed, _, _ = end.recvmsg(RECEIVED, ROOM, 0 if wait else socket.MSG_DONTWAIT)
    except ConnectionError as error:
        raise Closed from error
    if not datagram:
        raise Closed
    descriptors = tuple(each for (each,) in DESCRIPTOR.iter_unpack(passed[0][2])) if passed else ()
    return decode(datagram, descriptors, find)


def send(end: socket.socket, message: object, sealed: bool = False) -> None:
    """Send, waiting for room. Raises Closed when nobody listens any more.

    `sealed`: for a receiver that does not trust this process. Arrays must not lie in blocks of shared memory then.
    """
    encoded = encode(message, sealed)
    try:
        transmit(end, *encoded)
    except ConnectionError as error:
        raise Closed from error
    finally:
        discard(encoded)


def transmit(end: socket.socket, datagram: bytes, descriptors: tuple[int, ...]) -> None:
    """Send what `encode` gave."""
    if descriptors:
        socket.send_fds(end, [datagram], list(descriptors))
    else:
        end.send(datagram)


def another(message: Encoded) -> Encoded:
    """The same message once more, with descriptors of its own."""
    return message[0], tuple(os.dup(each) for each in message[1])


def discard(message: Encoded) -> None:
    """Close the descriptors of an encoded message."""
    for each in message[1]:
        os.close(each)


def _places(parts: list[memoryview]) -> tuple[list[Place], list[memoryview], list[shared_memory.Block]]:
    """Where each part will be found, those that must be copied, and the blocks in which the others lie."""
    blocks: list[shared_memory.Block] = []
    found = [shared_memory.locate(part) for part in parts]
    for known in found:
        if known is not None and len(blocks) < MOST - 1 and all(known[0] is not block for block in blocks):
            blocks.append(known[0])
    places, copied, end = list[Place](), list[memoryview](), 0
    for part, known in zip(parts, found, strict=True):
        which = next((i for i, block in enumerate(blocks) if known is not None and known[0] is block), None)
        if known is not None and which is not None:
            places.append((which, known[1], part.nbytes))
        else:
            places.append((len(blocks), end, part.nbytes))
            if part.nbytes:
                copied.append(part)
            end += -(-part.nbytes // ALIGNMENT) * ALIGNMENT
    return places, copied, blocks


def _shared(parts: list[memoryview], sealed: bool) -> int:
    descriptor = os.memfd_create("sunbox", os.MFD_CLOEXEC | (os.MFD_ALLOW_SEALING if sealed else 0))
    try:
        start = 0
        for part in parts:
            written = 0
            while written < part.nbytes:  # a write stops at 2 GiB
                written += os.pwrite(descriptor, part[written:], start + written)
            start += -(-part.nbytes // ALIGNMENT) * ALIGNMENT
        if sealed:
            fcntl.fcntl(descriptor, fcntl.F_ADD_SEALS, SEALS)
    except BaseException:
        os.close(descriptor)
        raise
    return descriptor
