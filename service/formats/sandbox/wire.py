"""Arrays and small messages between the service and its parsing child: JSON over a socket, arrays in a memfd.

A memfd, because a container's /dev/shm is 64 MB; JSON, because what parses strangers' files is not trusted with
pickle; and sealed, because a file that shrinks under a mapping kills the reader.
"""

import fcntl
import json
import mmap
import os
import socket
from typing import Any

import numpy as np
import numpy.typing as npt

MESSAGE_BYTES = 65536
ALIGNMENT = 64
COPIED = 1 << 20  # bytes; so little is not worth a descriptor, of which a process may have no more than 1 024
SEALS = fcntl.F_SEAL_SEAL | fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_GROW | fcntl.F_SEAL_WRITE
DTYPES = ("|u1", "<f4", "<f8", "<i4")

Array = npt.NDArray[Any]
Pieces = list[Array]  # of one array, along its first axis


def send(link: socket.socket, message: dict[str, Any], fd: int) -> None:
    socket.send_fds(link, [json.dumps(message).encode()], [fd] if fd >= 0 else [])


def receive(link: socket.socket) -> tuple[dict[str, Any], int]:
    """The next message and its file descriptor, -1 without one. Raises EOFError when the other side has gone."""
    data, fds, _, _ = socket.recv_fds(link, MESSAGE_BYTES, 1, socket.MSG_CMSG_CLOEXEC)
    if not data:
        raise EOFError
    message: dict[str, Any] = json.loads(data)
    return message, fds[0] if fds else -1


def memory(data: bytes | memoryview, name: str) -> int:
    """A new file in memory holding `data`; the caller closes it."""
    fd = os.memfd_create(name, os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
    write(fd, memoryview(data), 0)
    return fd


def write(fd: int, view: memoryview, offset: int) -> None:
    """All of `view`: one call writes at most 2 GiB."""
    while view:
        done = os.pwrite(fd, view, offset)
        view, offset = view[done:], offset + done


def publish(arrays: dict[str, Pieces]) -> tuple[int, list[dict[str, Any]]]:
    """A sealed memfd with the arrays one after the other, and where each lies. Takes them out of the dictionary: what
    is written need not be there twice.
    """
    fd, table, end = memory(b"", "sunbox-asset"), [], 0
    for name in list(arrays):
        pieces = arrays.pop(name)
        offset = end = -(-end // ALIGNMENT) * ALIGNMENT
        shape = (sum(map(len, pieces)), *pieces[0].shape[1:])
        table.append({"name": name, "dtype": pieces[0].dtype.str, "shape": shape, "offset": offset})
        while pieces:
            data = np.ascontiguousarray(pieces.pop(0))
            write(fd, data.reshape(-1).view(np.uint8).data, end)
            end += data.nbytes
    fcntl.fcntl(fd, fcntl.F_ADD_SEALS, SEALS)
    return fd, table


def adopt(fd: int, table: list[dict[str, Any]]) -> dict[str, Array]:
    """The arrays, read-only, and without a copy where they are large; then they keep the memory alive, and with it a
    descriptor. Raises ValueError on a table that lies.
    """
    if fcntl.fcntl(fd, fcntl.F_GET_SEALS) & SEALS != SEALS:
        raise ValueError("the memory is not sealed")
    size = os.fstat(fd).st_size
    large = size > COPIED
    # Private: before Linux 6.7 memory that is sealed against writing cannot be mapped as shared, not even to be read.
    mapped: mmap.mmap | bytes
    mapped = mmap.mmap(fd, size, mmap.MAP_PRIVATE, mmap.PROT_READ) if large else os.pread(fd, size, 0)
    arrays = {}
    for row in table:
        if row["dtype"] not in DTYPES:
            raise ValueError(f"unexpected dtype {row['dtype']!r}")
        shape = tuple(int(n) for n in row["shape"])
        count = int(np.prod(shape, dtype=np.int64))
        arrays[row["name"]] = np.frombuffer(mapped, row["dtype"], count, int(row["offset"])).reshape(shape)
    return arrays
