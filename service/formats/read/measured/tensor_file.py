"""The container of the RGL database's files: named arrays of any shape, each at its place in the file.

"tensor_file" and a zero byte, two bytes of version (1.0) and the number of arrays; then of each its name, its number
of axes, the kind of its numbers, its place in the file and its length along each axis. All numbers are little-endian.
"""

from __future__ import annotations

import math
import struct

import numpy as np

from service.formats.errors import ParseError

MAGIC = b"tensor_file\0"
MOST_FIELDS, MOST_AXES = 64, 8
DTYPES = ("|u1", "|i1", "<u2", "<i2", "<u4", "<i4", "<u8", "<i8", "<f2", "<f4", "<f8")  # from 1 on


def parse_tensor_file(data: bytes | memoryview) -> dict[str, np.ndarray]:
    """The arrays by name, as they are in the file. Raises ParseError."""
    reader = _Reader(memoryview(data))
    if reader.bytes(len(MAGIC)) != MAGIC:
        raise ParseError("it does not begin as a tensor file")
    major, minor = reader.numbers("BB")
    if (major, minor) != (1, 0):
        raise ParseError(f"its version is {major}.{minor}; 1.0 is supported")
    (count,) = reader.numbers("I")
    if count > MOST_FIELDS:
        raise ParseError(f"it says that it has {count} arrays; at most {MOST_FIELDS} are allowed")
    return dict(reader.array() for _ in range(count))


class _Reader:
    """Reads a file's head from its beginning on."""

    def __init__(self, data: memoryview) -> None:
        self._data, self._at = data, 0

    def bytes(self, size: int) -> bytes:
        if self._at + size > len(self._data):
            raise ParseError(f"it ends after {len(self._data)} bytes, within the list of its arrays")
        self._at += size
        return bytes(self._data[self._at - size : self._at])

    def numbers(self, kinds: str) -> tuple[int, ...]:
        return struct.unpack("<" + kinds, self.bytes(struct.calcsize("<" + kinds)))

    def array(self) -> tuple[str, np.ndarray]:
        (length,) = self.numbers("H")
        name = self.bytes(length).decode("utf-8", "replace")
        axes, kind, place = self.numbers("HBQ")
        said = f"its array {name[:40]!r}"
        if not 1 <= axes <= MOST_AXES:
            raise ParseError(f"{said} has {axes} axes; 1 to {MOST_AXES} are allowed")
        if not 1 <= kind <= len(DTYPES):
            raise ParseError(f"{said} is of the unknown kind {kind}")
        shape = self.numbers("Q" * axes)
        dtype = np.dtype(DTYPES[kind - 1])
        if place + math.prod(shape) * dtype.itemsize > len(self._data):
            raise ParseError(f"it ends after {len(self._data)} bytes, within {said.removeprefix('its ')}")
        return name, np.frombuffer(self._data, dtype, math.prod(shape), place).reshape(shape)
