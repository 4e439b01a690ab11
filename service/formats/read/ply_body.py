"""The data of a PLY file, element by element; they give no more than the file contains."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
from struct import Struct
from typing import Any

import numpy as np
import numpy.typing as npt

from service.formats.errors import ParseError
from service.formats.read.numbers import number, parsed
from service.formats.read.ply_header import Element, Header, count_of
from service.formats.read.polygons import Longs

CODES = {
    **{"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "i8": "q", "u8": "Q"},
    **{"f4": "f", "f8": "d"},
}

Column = npt.NDArray[Any]
Columns = dict[str, Column]


@dataclass
class Table:
    """The numbers of an element's properties by name; of a list the lengths, and all values, row after row."""

    columns: Columns = field(default_factory=dict)
    lists: dict[str, tuple[Longs, Column]] = field(default_factory=dict)


class Body:
    def __init__(self, data: memoryview, header: Header) -> None:
        """A text's numbers are read as float64, which represents any 32-bit index exactly; words as NaN."""
        self.data: bytes | memoryview = data
        self.at = header.start
        self.unit = "byte"
        if header.encoding == "ascii":
            text = _declared(_without_end(bytes(data[header.start :])), header)
            self.data, self.at, self.unit = parsed(text).tobytes(), 0, "word"
            for p in (p for element in header.elements for p in element.properties):
                p.dtype, p.count = "<f8", p.count and "<f8"

    def rest(self) -> str:
        """What follows the elements that were read; "" where nothing does."""
        left = (len(self.data) - self.at) // (8 if self.unit == "word" else 1)
        return f"{left} {self.unit}{'s' if left != 1 else ''}" if left else ""

    def table(self, element: Element, wanted: Collection[str]) -> Table:
        """The wanted properties, of those that the element has. Raises ParseError where the file is cut off."""
        if not element.lists():
            rows = self._rows(element, {})
            return Table({p.name: rows[p.name] for p in element.properties if p.name in wanted})
        if not element.length:
            none = np.empty(0, np.int64)
            return Table(
                {p.name: np.empty(0, p.dtype) for p in element.properties if p.name in wanted and not p.count},
                {p.name: (none, np.empty(0, p.dtype)) for p in element.lists() if p.name in wanted},
            )
        start = self.at
        lengths = self._walk(element, (), 1)[1]
        self.at = start
        if element.length * element.row(lengths).itemsize <= len(self.data) - start:
            rows = self._rows(element, lengths)
            if all((rows[count_of(p)] == lengths[p.name]).all() for p in element.lists()):
                table = Table()
                for p in element.properties:
                    if p.name in wanted and p.count is None:
                        table.columns[p.name] = rows[p.name]
                    elif p.name in wanted:
                        counts = np.full(len(rows), rows[p.name].shape[1])
                        table.lists[p.name] = counts, rows[p.name].reshape(-1)
                return table
            self.at = start
        return self._walk(element, wanted, element.length)[0]

    def _rows(self, element: Element, lengths: dict[str, int]) -> npt.NDArray[np.void]:
        dtype = element.row(lengths)
        if element.length and not dtype.itemsize:
            raise ParseError(f"element {element.name} has no properties")
        self._need(element.length * dtype.itemsize, element)
        if not element.length:
            return np.empty(0, dtype)
        rows = np.frombuffer(self.data, dtype, element.length, self.at)
        self.at += rows.nbytes
        return rows

    def _walk(self, element: Element, wanted: Collection[str], rows: int) -> tuple[Table, dict[str, int]]:
        """Row by row, for lists that differ: the table, and the lengths of the last row's lists."""
        lengths: dict[str, int] = {}
        counts: dict[str, list[int]] = {p.name: [] for p in element.properties if p.name in wanted}
        pieces: dict[str, list[Any]] = {name: [] for name in counts}
        counters = [p.count and Struct(p.count[0] + CODES[p.count[1:]]) for p in element.properties]
        sizes = [int(p.dtype[-1]) for p in element.properties]
        for _ in range(rows):
            for p, count, size in zip(element.properties, counters, sizes, strict=True):
                n = 1
                if count:
                    self._need(count.size, element)
                    n = self._length(count.unpack_from(self.data, self.at)[0], element)
                    self.at += count.size
                    lengths[p.name] = n
                self._need(n * size, element)
                if p.name in counts:
                    counts[p.name].append(n)
                    pieces[p.name].append(self.data[self.at : self.at + n * size])
                self.at += n * size
        table = Table()
        for p in element.properties:
            if p.name in counts:
                values = np.frombuffer(b"".join(pieces[p.name]), p.dtype)
                if p.count is None:
                    table.columns[p.name] = values
                else:
                    table.lists[p.name] = np.array(counts[p.name], np.int64), values
        return table, lengths

    def _length(self, written: float, element: Element) -> int:
        if not written >= 0 or written != written // 1:
            raise ParseError(f"element {element.name} has a list of length {written}")
        return int(written)

    def _need(self, size: int, element: Element) -> None:
        if size > len(self.data) - self.at:
            raise ParseError(
                f"the file is cut off: {element.length} rows of element {element.name} are promised, "
                f"{len(self.data) - self.at} bytes are left"
            )


def _declared(text: bytes, header: Header) -> bytes:
    """The text, where each row has a line to itself, without words at the ends of lines that the header does not
    declare: read on without lines they would be the next row's."""
    if text.count(b"\n") + 1 != sum(element.length for element in header.elements):
        return text
    lines, start = text.split(b"\n"), 0
    for element in header.elements:
        end = start + element.length
        first = lines[start].split() if element.length else []
        if _words(element, first) < len(first):
            rows = [line.split() for line in lines[start:end]]
            lines[start:end] = [b" ".join(words[: _words(element, words)]) for words in rows]
            header.warnings.append(
                f"rows of element {element.name} have more numbers than the header declares; the last are not read"
            )
        start = end
    return b"\n".join(lines)


def _words(element: Element, words: list[bytes]) -> int:
    """How many of a row's words the header declares."""
    count = 0
    for p in element.properties:
        more = number(words[count]) if p.count and count < len(words) else 0.0
        count += 1 + (int(more) if 0 <= more <= len(words) else 0)
    return count


def _without_end(text: bytes) -> bytes:
    """The text without the bytes that mark its end, and no more."""
    return text.rstrip(b"\0\x1a \t\r\n")
