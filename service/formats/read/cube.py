"""Reader of .cube files: tables from displayed colours to displayed colours [Adobe, Cube LUT Specification 1.0]."""

from __future__ import annotations

import math
import re

import numpy as np

from service.formats.errors import ParseError
from service.formats.formats import text
from service.formats.types import LutData

MOST_BYTES = 32 << 20  # five times what a table of the largest side takes, written with nine digits
MOST_SIDE = {1: 65536, 3: 65}  # entries along an axis, by the number of axes
MOST_VALUE = 1e6  # of an entry and of the domain: beyond it is no picture, and float32 would lose the difference
_SIZE = re.compile(r"LUT_([13])D_SIZE")
_RANGE = re.compile(r"LUT_[13]D_INPUT_RANGE")  # as DaVinci Resolve writes the domain


def parse_cube(data: bytes) -> LutData:
    """Raises ParseError, which names the line."""
    if len(data) > MOST_BYTES:
        raise ParseError(f"{len(data)} bytes; {MOST_BYTES} are allowed for a .cube file")
    reader = _Reader()
    for number, line in enumerate(text(data).decode("utf-8", "replace").splitlines(), 1):
        words = line.split()
        if words and not words[0].startswith("#"):
            reader.take(number, words)
    return reader.end()


class _Reader:
    """The state of a reader between two lines."""

    def __init__(self) -> None:
        self.axes = self.side = 0
        self.low, self.high = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
        self.rows: list[tuple[float, float, float]] = []

    @property
    def wanted(self) -> int:
        return self.side**self.axes if self.axes else 0

    def take(self, number: int, words: list[str]) -> None:
        name, *values = words
        if not (name[0].isalpha() and name[0].isupper()):
            return self._row(number, words)
        if name == "TITLE":
            return None
        if self.rows:
            raise ParseError(f"line {number}: {name[:40]!r} comes after the table has begun")
        if size := _SIZE.fullmatch(name):
            return self._size(number, int(size[1]), values)
        if name == "DOMAIN_MIN":
            self.low = _three(number, values)
        elif name == "DOMAIN_MAX":
            self.high = _three(number, values)
        elif _RANGE.fullmatch(name):
            if len(values) != 2:
                raise ParseError(f"line {number}: {name} takes two numbers")
            low, high, _ = _three(number, [*values, "0"])
            self.low, self.high = (low,) * 3, (high,) * 3
        else:
            raise ParseError(f"line {number}: {name[:40]!r} is not a keyword of .cube files")
        return None

    def _size(self, number: int, axes: int, values: list[str]) -> None:
        if self.axes:
            raise ParseError(f"line {number}: a second table is not supported; a file has one size")
        most = MOST_SIDE[axes]
        if len(values) != 1 or not re.fullmatch(r"\d{1,6}", values[0]) or not 2 <= int(values[0]) <= most:
            raise ParseError(f"line {number}: LUT_{axes}D_SIZE must be a whole number from 2 to {most}")
        self.axes, self.side = axes, int(values[0])

    def _row(self, number: int, words: list[str]) -> None:
        if not self.axes:
            raise ParseError(f"line {number}: LUT_1D_SIZE or LUT_3D_SIZE must come before the table")
        if len(self.rows) == self.wanted:
            raise ParseError(f"line {number}: the table has {self.wanted} lines, and this is one more")
        self.rows.append(_three(number, words))

    def end(self) -> LutData:
        if not self.axes:
            raise ParseError("LUT_1D_SIZE or LUT_3D_SIZE is missing")
        if len(self.rows) < self.wanted:
            raise ParseError(f"the table ends after {len(self.rows)} of {self.wanted} lines")
        if any(low >= high for low, high in zip(self.low, self.high, strict=True)):
            raise ParseError(f"the domain ends at {self.high}, which is not above its beginning, {self.low}")
        values = np.array(self.rows, np.float32).reshape((self.side,) * self.axes + (3,))
        return LutData(values, self.low, self.high)


def _three(number: int, words: list[str]) -> tuple[float, float, float]:
    try:
        x, y, z = map(float, words)
    except ValueError:
        raise ParseError(f"line {number}: must be three numbers") from None
    if not all(math.isfinite(value) and abs(value) <= MOST_VALUE for value in (x, y, z)):
        raise ParseError(f"line {number}: a number must be finite, and at most {MOST_VALUE:g}")
    return x, y, z
