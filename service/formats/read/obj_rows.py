"""The numbers of an OBJ text: rows of vertices, texture coordinates and normals, and the corners of faces.

A row that can't be read costs itself alone: its place is kept, so that indices still lead where they did.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from service.formats.read.bad_elements import Mask, are_places
from service.formats.read.numbers import NO_NUMBER, number, quickly
from service.formats.read.obj_lines import COMMENT, Lines, shown, starts_of_words
from service.formats.read.polygons import Longs
from service.formats.types import Doubles

Ints = npt.NDArray[np.int32]
Faults = list[tuple[int, str]]  # lines, and what is wrong with them
WIDTHS = {"v": 3, "vt": 2, "vn": 3}
NOWHERE = 2**31 - 1  # an index that leads to no row, whatever the file wrote: none has so many
LEAST = {"v": 3, "vt": 1, "vn": 3}  # a texture coordinate of one number lies on v = 0
MOST_REASONS = 1000
CORNER = rb"[-+]?\d++(?:/(?:[-+]?\d++)?+){0,2}"
FACE = re.compile(rb"\s*+(?:" + CORNER + rb"(?:\s++|$)){3,}")
SLASHES = re.compile(rb"[-+]?\d++(?:/(?:[-+]?\d++)?+){3,}")


@dataclass
class BadRows:
    """The rows of a table that can't be used: their numbers from 0 on, the lines, and for the first why."""

    rows: list[Longs] = field(default_factory=list)
    lines: list[Longs] = field(default_factory=list)
    reasons: dict[int, str] = field(default_factory=dict)

    def add(self, rows: Longs, at: int, found: Lines, texts: list[bytes], reasons: list[str]) -> None:
        """`rows` of these lines, whose first is row `at` of the table."""
        self.rows.append(rows + at)
        self.lines.append(found.lines[rows])
        for row, reason in zip(rows, reasons, strict=False):
            if len(self.reasons) < MOST_REASONS:
                self.reasons[int(row) + at] = f"line {found.lines[row]}: {reason}: {shown(texts[row])}"

    def __len__(self) -> int:
        return sum(map(len, self.rows))

    def mask(self, count: int) -> Mask:
        mask = np.zeros(count, bool)
        for rows in self.rows:
            mask[rows] = True
        return mask

    def reason(self, row: int) -> str:
        return self.reasons.get(row, f"vertex {row + 1} can't be read")


@dataclass
class Vectors:
    """The rows of one block, (n, width); the numbers after the position, (n, 4), of vertices that have any."""

    rows: Doubles
    more: Doubles | None = None
    more_counts: Longs | None = None  # (n,) the numbers of each row
    odd: Longs = field(default_factory=lambda: np.empty(0, np.int64))  # lines with something after their numbers


def vectors(found: Lines, keyword: str, at: int, bad: BadRows) -> Vectors:
    """The rows of a block, zeros where they can't be read; `at` is the number of rows before it."""
    width = WIDTHS[keyword]
    text = found.text
    if b"#" in text:
        text = COMMENT.sub(b"", NO_NUMBER.sub(b"nan", text))
    counts = Lines(text, found.lines).counts(starts_of_words(np.frombuffer(text, np.uint8)))
    flat, odd = quickly(text), np.empty(0, np.int64)
    if flat is None or len(flat) != counts.sum():
        flat, counts, odd = _slowly(text)
    if (counts == width).all():
        rows: Doubles = flat.reshape(-1, width)
    else:
        rows = _columns(flat, counts, 0, width, 0.0)
    sound = are_places(rows) if keyword == "v" else np.isfinite(rows).all(axis=1)
    sound = sound & (counts >= LEAST[keyword])
    more = None
    if keyword == "v":
        known = (counts <= 4) | (counts == 6) | (counts == 7)
        odd = np.union1d(odd, np.flatnonzero(~known))
        if ((counts == 6) | (counts == 7)).any():
            more = _columns(flat, counts, 3, 4, np.nan)
    if not sound.all():
        wrong = np.flatnonzero(~sound)
        reasons = [_reason(rows[row], int(counts[row]), keyword) for row in wrong[:MOST_REASONS]]
        bad.add(wrong, at, found, found.text.split(b"\n"), reasons)
        rows = np.where(sound[:, None], rows, 0.0)
    return Vectors(rows, more, counts if more is not None else None, found.lines[odd])


def _reason(row: Doubles, count: int, keyword: str) -> str:
    if count < LEAST[keyword]:
        return f"`{keyword}` needs {'a number' if LEAST[keyword] == 1 else 'three numbers'}"
    if not np.isfinite(row).all():
        return f"`{keyword}` is not finite"
    return f"`{keyword}` lies beyond 1e9 m"


def _columns(flat: Doubles, counts: Longs, first: int, width: int, missing: float) -> Doubles:
    """(n, width) the numbers of each row from its number `first` on."""
    starts = np.cumsum(counts) - counts
    if not len(flat):
        return np.full((len(counts), width), missing)
    columns = first + np.arange(width)
    found: Doubles = flat[np.minimum(starts[:, None] + columns, len(flat) - 1)]
    found[counts[:, None] <= columns] = missing
    return found


def _slowly(text: bytes) -> tuple[Doubles, Longs, Longs]:
    """The numbers with which each row begins, how many these are, and the rows that go on with something else."""
    flat: list[float] = []
    counts, odd = [], []
    for row, content in enumerate(text.split(b"\n")[:-1]):
        before = len(flat)
        for word in NO_NUMBER.sub(b"nan", content).split():
            value = number(word)
            if value != value and b"nan" not in word.lower():
                odd.append(row)
                break
            flat.append(value)
        counts.append(len(flat) - before)
    return np.array(flat, np.float64), np.array(counts, np.int64), np.array(odd, np.int64)


def corners(faces: Lines, faults: dict[str, Faults]) -> tuple[Longs, Longs, Longs, Longs]:
    """The number of corners of each face, and each corner's v, vt and vn as written, 0 where absent, NOWHERE where it
    leads nowhere. A face that can't be read has three corners that lead nowhere.

    A corner is v, v/vt, v//vn or v/vt/vn: the slashes before a number say which of them it is.
    """
    if b"#" in faces.text:
        faces = Lines(COMMENT.sub(b"", faces.text), faces.lines)
    found = _split(faces)
    if found is None:
        found = _split(_readable(faces, faults["v"]))
        assert found is not None
    counts, values, slot, owner, corner_count = found
    zero = np.flatnonzero(values == 0)
    row = np.repeat(np.arange(len(counts)), counts)
    for k, keyword in enumerate(WIDTHS):
        mine = zero[slot[zero] == k]
        if len(mine):
            line = int(faces.lines[row[owner[mine[0]]]])
            faults[keyword].append((line, "an index of 0 does not exist; they are counted from 1"))
    values[zero] = NOWHERE
    v, vt, vn = (np.zeros(corner_count, np.int64) for _ in range(3))
    for k, index in enumerate((v, vt, vn)):
        index[owner[slot == k]] = values[slot == k]
    return counts, v, vt, vn


def _split(faces: Lines) -> tuple[Longs, Longs, Longs, Longs, int] | None:
    """The corners of each face; all numbers with their places in a corner and the corners to which they belong; and
    the number of corners. None where something is not understood."""
    letters = np.frombuffer(faces.text, np.uint8)
    starts = starts_of_words(letters)
    counts = faces.counts(starts)
    spaced = faces.text.replace(b"/", b" ")
    numbers = starts_of_words(np.frombuffer(spaced, np.uint8))
    values = quickly(spaced, np.int64)
    if counts.min() < 3 or values is None or len(values) != len(numbers):
        return None
    owner = np.searchsorted(starts, numbers, "right") - 1
    slashes = np.flatnonzero(letters == ord("/"))
    slot = np.searchsorted(slashes, numbers) - np.searchsorted(slashes, starts)[owner]
    if slot.max() > 2 or np.count_nonzero(slot == 0) != len(starts):
        return None
    return counts, values.astype(np.int64), slot, owner, len(starts)


def _readable(faces: Lines, faults: Faults) -> Lines:
    """The faces, those that are not understood with three corners that lead nowhere; the first of each kind is added
    to `faults`."""
    nowhere = b" ".join([b"%d" % NOWHERE] * 3)
    rows, seen = faces.text.split(b"\n")[:-1], set()
    for k, content in enumerate(rows):
        if not FACE.fullmatch(content):
            words = content.split()
            if len(words) < 3:
                what = f"a face needs at least three corners, this one has {len(words)}"
            elif any(word.startswith(b"/") for word in words):
                what = "a corner lacks its vertex"
            elif any(map(SLASHES.fullmatch, words)):
                what = "corners are v, v/vt, v//vn or v/vt/vn"
            else:
                what = "the line is not understood"
            if what not in seen:
                seen.add(what)
                faults.append((int(faces.lines[k]), f"{what}: {shown(content)}"))
            rows[k] = nowhere
    return Lines(b"\n".join(rows) + b"\n", faces.lines)
