"""Arrays in memory that another process may map: written once, and not copied on their way to the renderer."""

from __future__ import annotations

import ctypes
import math
import mmap
import os
import threading
import weakref
from contextlib import suppress
from typing import Any

import numpy as np

LEAST = 1 << 18  # bytes of arrays; fewer are not worth a descriptor
ALIGNMENT = 64  # a cache line, and more than any dtype asks for
_TRIM_THRESHOLD, _TOP_PAD, _MMAP_THRESHOLD = -1, -2, -3  # of mallopt(3)


class Block(mmap.mmap):
    """A block of shared memory, zeros at first. It has a descriptor, and lasts as long as an array in it."""

    descriptor: int


# By address. A plain dict, as its `copy` is one step of the interpreter: blocks come and go in other threads, and a
# WeakValueDictionary that is listed meanwhile raises RuntimeError.
_blocks: dict[int, weakref.ref[Block]] = {}
# Of changes. An mmap is unmapped before its weak references are called [CPython, mmapmodule.c], and another thread
# may map a new block there in between. Reentrant, as the collector may drop a block in between, too.
_changing = threading.RLock()


def block(size: int) -> Block:
    descriptor = os.memfd_create("sunbox", os.MFD_CLOEXEC)
    try:
        os.ftruncate(descriptor, size)
        made = Block(descriptor, size)
    except BaseException:
        os.close(descriptor)
        raise
    made.descriptor = descriptor
    weakref.finalize(made, os.close, descriptor)
    _register(made)
    return made


def _register(made: Block) -> None:
    """List the block for as long as it lasts."""
    address = _address(np.frombuffer(made, np.uint8))

    def forget(dead: weakref.ref[Block]) -> None:
        with _changing:
            if _blocks.get(address) is dead:  # else a new block has the address by now
                del _blocks[address]

    with _changing:
        _blocks[address] = weakref.ref(made, forget)


def locate(part: memoryview) -> tuple[Block, int] | None:
    """The block in which these bytes lie, and from which of its bytes on."""
    if not part.nbytes:
        return None
    at = _address(np.frombuffer(part, np.uint8))
    for address, listed in _blocks.copy().items():
        found = listed()
        if found is not None and address <= at < address + len(found):
            return found, at - address
    return None


class SharedArena:
    """Room for arrays side by side, in one block where they are large."""

    def __init__(self, *sizes: int) -> None:
        """`sizes`: bytes of each array that will be put here."""
        room = sum(-(-size // ALIGNMENT) * ALIGNMENT for size in sizes)
        self._block = block(room) if room >= LEAST else None
        self._end = 0

    def room(self, shape: tuple[int, ...], dtype: np.dtype[Any]) -> np.ndarray:
        """An array of zeros to be written over."""
        count = math.prod(shape)
        if self._block is None or not count:
            return np.zeros(shape, dtype)
        out = np.frombuffer(self._block, dtype, count, self._end).reshape(shape)
        self._end += -(-out.nbytes // ALIGNMENT) * ALIGNMENT
        return out

    def put(self, array: np.ndarray, rows: np.ndarray | None = None) -> np.ndarray:
        """A copy of the array, or of its `rows` in that order, in the block where there is one."""
        if self._block is None:
            return array if rows is None else array[rows]
        out = self.room((len(array) if rows is None else len(rows), *array.shape[1:]), array.dtype)
        if rows is None:
            out[...] = array
        else:
            np.take(array, rows, axis=0, out=out, mode="clip")  # in range; otherwise numpy buffers it all
        return out


def reuse_freed() -> None:
    """Make the C library keep freed memory for later requests, in a process that soon ends.

    Pages that are new to a process cost 2 to 3 us each in a virtual machine: of packing a million triangles, a tenth.
    """
    _set({_TRIM_THRESHOLD: 1 << 30, _TOP_PAD: 1 << 24, _MMAP_THRESHOLD: 1 << 25})


def return_freed(block: int = 1 << 20) -> None:
    """Make the C library return freed blocks of that many bytes or more at once, in a process that stays.

    By default it learns to reuse blocks of up to 32 MiB, such as a scene's arrays: after packing a mesh of a million
    triangles it had 95 MB of them.
    """
    _set({_MMAP_THRESHOLD: block, _TRIM_THRESHOLD: 4 << 20})


def _set(parameters: dict[int, int]) -> None:
    with suppress(OSError, AttributeError):  # only glibc has it
        library = ctypes.CDLL(None)
        for parameter, size in parameters.items():
            library.mallopt(parameter, size)


def trim() -> None:
    """Return freed memory to the system, after hundreds of megabytes of numpy's temporaries."""
    with suppress(OSError, AttributeError):  # only glibc has it
        ctypes.CDLL(None).malloc_trim(0)


def _address(array: np.ndarray) -> int:
    return int(array.__array_interface__["data"][0])
