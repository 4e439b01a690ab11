"""The statements of an OBJ file that matter, in blocks of whole lines: a file is never split into objects by line.

Lines and free-form statements are skipped.
"""

from __future__ import annotations

import mmap
import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from service.formats.errors import ParseError
from service.formats.formats import decoded
from service.formats.read.polygons import Longs

Letters = npt.NDArray[np.uint8]

BLOCK = 1 << 19  # bytes; a parsed block takes some forty times as much
NAMING = (b"usemtl", b"mtllib", b"s")
NEWLINE, BLANK = 10, 32  # the latter and all below separate words
NUMBERS = rb"\s*(?:[-+]?(?:\d+\.?\d*|\.\d+|inf|nan)(?:e[-+]?\d+)?(?:\s+|$))+"
CORNERS = rb"\s*(?:[-+]?\d+(?:/(?:[-+]?\d+)?)*(?:\s+|$))+"


@dataclass(frozen=True)
class Lines:
    """The text after one keyword, a line each; `lines` are the numbers of these lines in the file."""

    text: bytes
    lines: Longs

    def error(self, row: int, what: str) -> ParseError:
        content = self.text.split(b"\n")[row]
        return ParseError(f"line {self.lines[row]}: {what}: {_shown(content)}")

    def counts(self, starts: Longs) -> Longs:
        """Words on each line, of words that begin at `starts`."""
        ends = np.flatnonzero(np.frombuffer(self.text, np.uint8) == NEWLINE)
        return np.diff(np.searchsorted(starts, ends), prepend=0)

    def parse(self, text: bytes, dtype: Any, pattern: bytes, expected: int) -> npt.NDArray[Any]:
        """`expected` numbers; where the quick parser stumbles, the pattern of a good row finds the bad one."""
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")  # numpy warns where it stops short of the end
                values = np.fromstring(text, dtype, sep=" ")
            if len(values) == expected:
                return values
        except (ValueError, DeprecationWarning):
            pass
        for row, content in enumerate(self.text.split(b"\n")[:-1]):
            if not re.fullmatch(pattern, content, re.IGNORECASE):
                raise self.error(row, "the line is not understood")
        raise ParseError("it holds numbers that can't be read")


@dataclass(frozen=True)
class Named:
    """A `usemtl`, `mtllib` or `s` with its argument; `faces` is the number of faces before it in its block."""

    keyword: str
    name: str
    line: int
    faces: int


@dataclass(frozen=True)
class Block:
    """`before`: how many rows of v, vt and vn preceded each row of f in this block (indices may count back)."""

    rows: dict[str, Lines]
    before: Longs  # (faces, 3)
    named: list[Named]


def blocks(data: bytes | memoryview) -> Iterator[Block]:
    """Only those that have a statement that matters."""
    view, at, line = memoryview(data), 0, 1
    while at < len(view):
        end = _end(view, at)
        text = _plain(bytes(view[at:end]))
        at = end
        if isinstance(view.obj, mmap.mmap):  # pages that were read need not count as this process' memory
            view.obj.madvise(mmap.MADV_DONTNEED, 0, at)
        starts, found, others = _classified(text)
        numbers = line + np.arange(len(starts))
        line += len(starts)
        if any(mask.any() for mask in (*found.values(), others)):
            named = list(_named(text, starts, numbers, np.flatnonzero(others), found["f"]))
            lengths = np.diff(starts, append=len(text))
            rows = {k: Lines(_taken(text, starts, lengths, mask, k), numbers[mask]) for k, mask in found.items()}
            faces = found["f"]
            yield Block(rows, np.stack([np.cumsum(found[k])[faces] for k in ("v", "vt", "vn")], axis=1), named)


def _end(view: memoryview, at: int) -> int:
    """Where a block ends that begins at `at`: after a line that no backslash carries on."""
    end = at + BLOCK
    while end < len(view):
        window = bytes(view[max(end - 4096, at) : end])
        cut = window.rfind(b"\n")
        while cut >= 0 and window[max(cut - 2, 0) : cut].rstrip(b"\r").endswith(b"\\"):
            cut = window.rfind(b"\n", 0, cut)
        if cut >= 0:
            return end - len(window) + cut + 1
        end += BLOCK  # a very long line, or line ends of old: as one block
    return len(view)


def _plain(text: bytes) -> bytes:
    """Lines that end in a newline each, with neither comments nor leading blanks; a continued line is one."""
    if b"\r" in text:
        text = text.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    if b"\\" in text:
        text = text.replace(b"\\\n", b" ")
    if b"#" in text:
        text = re.sub(rb"#[^\n]*+", b"", text)
    if re.search(rb"(?:\A|\n)[\x00-\x09\x0b-\x20]++[vfums]", text):
        text = re.sub(rb"(?m)^[\x00-\x09\x0b-\x20]++", b"", text)
    return text if text.endswith(b"\n") else text + b"\n"


def _classified(text: bytes) -> tuple[Longs, dict[str, npt.NDArray[np.bool_]], npt.NDArray[np.bool_]]:
    """Where lines start, which are of each keyword, and which may be a usemtl, mtllib or s."""
    letters = np.frombuffer(text + b"\n\n\n", np.uint8)
    ends = np.flatnonzero(letters[: len(text)] == NEWLINE)
    starts = np.concatenate([[0], ends[:-1] + 1])
    first, second, third = (letters[starts + k] for k in range(3))
    v = first == ord("v")
    naming = ((first == ord("u")) & (second == ord("s"))) | ((first == ord("m")) & (second == ord("t")))
    others = naming | ((first == ord("s")) & (second <= BLANK))
    keywords = {
        "v": v & (second <= BLANK),
        "vt": v & (second == ord("t")) & (third <= BLANK),
        "vn": v & (second == ord("n")) & (third <= BLANK),
        "f": (first == ord("f")) & (second <= BLANK),
    }
    return starts, keywords, others


def _named(text: bytes, starts: Longs, numbers: Longs, rows: Longs, faces: npt.NDArray[np.bool_]) -> Iterator[Named]:
    """The statements of `rows` that name a material, a library or a smoothing group."""
    before = np.cumsum(faces) if len(rows) else faces
    for row in rows:
        start = int(starts[row])
        keyword, *rest = text[start : text.index(b"\n", start)].split(None, 1)
        if keyword in NAMING:
            name = decoded(rest[0]).strip() if rest else ""
            yield Named(keyword.decode(), name, int(numbers[row]), int(before[row]))


def _taken(text: bytes, starts: Longs, lengths: Longs, mask: npt.NDArray[np.bool_], keyword: str) -> bytes:
    """The lines of one keyword, the keyword blanked out."""
    if not mask.any():
        return b""
    letters = np.frombuffer(text, np.uint8)[np.repeat(mask, lengths)]
    begun = np.cumsum(lengths[mask]) - lengths[mask]
    for k in range(len(keyword)):
        letters[begun + k] = np.where(letters[begun + k] == NEWLINE, NEWLINE, BLANK)
    return letters.tobytes()


def starts_of_words(letters: Letters) -> Longs:
    blank = letters <= BLANK
    return np.flatnonzero(~blank & np.concatenate([[True], blank[:-1]]))


def _shown(row: bytes) -> str:
    """A row for a message: short, printable."""
    text = row[:60].decode("utf-8", "replace").strip()
    return repr(text + ("…" if len(row) > 60 else "")) if text else "nothing follows"
