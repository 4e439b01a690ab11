"""The statements of an OBJ file that matter, in blocks of whole lines: a file is never split into objects by line.

Lines and free-form statements are only counted.
"""

from __future__ import annotations

import mmap
import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from service.formats.formats import decoded
from service.formats.read.polygons import Longs

Letters = npt.NDArray[np.uint8]

BLOCK = 1 << 19  # bytes; a parsed block takes some forty times as much
NAMING = (b"usemtl", b"mtllib", b"s")
NEWLINE, BLANK = 10, 32  # the latter and all below separate words
COMMENT = re.compile(rb"#[^\n]*+")
# A comment is a whole line. A backslash at its end, as of a path, carries nothing on.
CLOSED = re.compile(rb"(?m)^([^\S\n]*+#[^\n]*?)\\++$")
SILENT = (b"g", b"o")  # statements of no consequence: names, and their groups
COLORS = b"#MRGB"  # ZBrush's comments with colours


@dataclass(frozen=True)
class Lines:
    """The text after one keyword, a line each; `lines` are the numbers of these lines in the file."""

    text: bytes
    lines: Longs

    def counts(self, starts: Longs) -> Longs:
        """Words on each line, of words that begin at `starts`."""
        ends = np.flatnonzero(np.frombuffer(self.text, np.uint8) == NEWLINE)
        return np.diff(np.searchsorted(starts, ends), prepend=0)


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
    comments: list[bytes]  # what follows in those of COLORS
    unread: dict[str, list[int]]  # the lines of other statements, by keyword


def blocks(data: bytes | memoryview) -> Iterator[Block]:
    """Only those that have a statement that matters."""
    view, at, line = memoryview(data), 0, 1
    while at < len(view):
        end = _end(view, at)
        text = _plain(bytes(view[at:end]))
        at = end
        if isinstance(view.obj, mmap.mmap):  # pages that were read need not count as this process' memory
            view.obj.madvise(mmap.MADV_DONTNEED, 0, at)
        starts, found, others, comments = _classified(text)
        numbers = line + np.arange(len(starts))
        line += len(starts)
        if any(mask.any() for mask in (*found.values(), others, comments)):
            named, unread = _named(text, starts, numbers, np.flatnonzero(others), found["f"])
            lengths = np.diff(starts, append=len(text))
            rows = {k: Lines(_taken(text, starts, lengths, mask, k), numbers[mask]) for k, mask in found.items()}
            faces = found["f"]
            before: Longs = np.stack([np.cumsum(found[k])[faces] for k in ("v", "vt", "vn")], axis=1)
            colors = [_line(text, int(starts[row]))[len(COLORS) :] for row in np.flatnonzero(comments)]
            yield Block(rows, before, named, colors, unread)


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
    """Lines that end in a newline each, without leading blanks; a continued line is one."""
    if b"\r" in text:
        text = text.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    if b"\\\n" in text:
        text = (CLOSED.sub(rb"\1", text) if b"#" in text else text).replace(b"\\\n", b" ")
    if re.search(rb"(?:\A|\n)[\x00-\x09\x0b-\x20]++[^\n]", text):
        text = re.sub(rb"(?m)^[\x00-\x09\x0b-\x20]++", b"", text)
    return text if text.endswith(b"\n") else text + b"\n"


Mask = npt.NDArray[np.bool_]


def _classified(text: bytes) -> tuple[Longs, dict[str, Mask], Mask, Mask]:
    """Where lines start, which are of each keyword, which are of others, and which are comments with colours."""
    letters = np.frombuffer(text + b"\n\n\n", np.uint8)
    ends = np.flatnonzero(letters[: len(text)] == NEWLINE)
    starts = np.concatenate([[0], ends[:-1] + 1])
    first, second, third = (letters[starts + k] for k in range(3))
    v = first == ord("v")
    keywords = {
        "v": v & (second <= BLANK),
        "vt": v & (second == ord("t")) & (third <= BLANK),
        "vn": v & (second == ord("n")) & (third <= BLANK),
        "f": (first == ord("f")) & (second <= BLANK),
    }
    is_comment = first == ord("#")
    others = (first > BLANK) & ~is_comment
    for mask in keywords.values():
        others &= ~mask
    return starts, keywords, others, is_comment & (second == ord("M")) & (third == ord("R"))


def _line(text: bytes, start: int) -> bytes:
    return text[start : text.index(b"\n", start)]


def _named(
    text: bytes, starts: Longs, numbers: Longs, rows: Longs, faces: Mask
) -> tuple[list[Named], dict[str, list[int]]]:
    """The statements of `rows` that name a material, a library or a smoothing group, and the lines of the others by
    keyword."""
    before = np.cumsum(faces) if len(rows) else faces
    named: list[Named] = []
    unread: dict[str, list[int]] = {}
    for row in rows:
        keyword, *rest = _line(text, int(starts[row])).split(None, 1)
        if keyword in NAMING:
            given = rest[0] if rest else b""
            given = COMMENT.sub(b"", given) if keyword == b"s" else given
            name = decoded(given).strip()
            named.append(Named(keyword.decode(), name, int(numbers[row]), int(before[row])))
        elif keyword not in SILENT:
            unread.setdefault(keyword[:40].decode("utf-8", "replace"), []).append(int(numbers[row]))
    return named, unread


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


def shown(row: bytes) -> str:
    """A row for a message: short, printable."""
    text = row[:60].decode("utf-8", "replace").strip()
    return repr(text + ("…" if len(row) > 60 else "")) if text else "nothing follows"
