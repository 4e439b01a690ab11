"""Wavefront OBJ -> triangles, strictly. Runs in the parsing child.

Our own, and not trimesh's: that one drops a face or a normal it cannot read in silence, keeps indices beyond the
vertices, and reorders. Lines, materials and free-form statements are skipped.
"""

import re
import warnings
from array import array
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from service.assets.data import Doubles
from service.assets.errors import ParseError
from service.assets.parts import Parts
from service.assets.polygons import Longs, triangulate

NUMBERS = rb"\s*(?:[-+]?(?:\d+\.?\d*|\.\d+|inf|nan)(?:e[-+]?\d+)?(?:\s+|$))+"
CORNERS = rb"\s*(?:[-+]?\d+(?:/(?:[-+]?\d+)?)*(?:\s+|$))+"
BLANK = 32  # this byte and those below separate words


@dataclass
class Statements:
    """The statements of one keyword: what followed it, and on which line it stood."""

    rows: list[bytes] = field(default_factory=list)
    lines: "array[int]" = field(default_factory=lambda: array("q"))

    def error(self, row: int, what: str) -> ParseError:
        return ParseError(f"line {self.lines[row]}: {what}: {_shown(self.rows[row])}")


def read_obj(data: bytes) -> Parts:
    """Vertices as the file has them, or, where it gives more, one for each set of indices that a corner has."""
    found, seen = _statements(data)
    vertices, colors = _vectors(found["v"], "v", 3)
    faces = found["f"]
    if not faces.rows:
        raise ParseError("it has no faces")
    counts, *corner = _corners(faces)
    row = np.repeat(np.arange(len(counts)), counts)
    places = np.frombuffer(seen, np.int64).reshape(-1, 3)[row]
    index = _resolve(faces, row, corner[0], places[:, 0], len(vertices), "vertex", "vertices")
    triangles = triangulate(vertices, index, counts)
    tables: list[Doubles | None] = [vertices, colors]
    indices = [index, index]
    for k, keyword, one, many, width in ((1, "vt", "texture coordinate", "texture coordinates", 2),
                                         (2, "vn", "normal", "normals", 3)):  # fmt: skip
        given = corner[k] != 0
        if not given.any():
            tables.append(None)
            indices.append(corner[k])
            continue
        table = _vectors(found[keyword], keyword, width)[0]
        corner[k][given] = _resolve(faces, row[given], corner[k][given], places[given, k], len(table), one, many)
        corner[k][~given] = len(table)  # a row of zeros: a normal is computed
        tables.append(np.concatenate([table, np.zeros((1, width))]))
        indices.append(corner[k])
    parts = _joined(tables, indices, triangles)
    bare = int(np.count_nonzero(corner[1] == len(tables[2]) - 1)) if tables[2] is not None else 0
    if bare:
        parts.warnings.append(f"{bare} corners have no texture coordinate; they take 0 0")
    return parts


def _joined(tables: list[Doubles | None], indices: list[Longs], triangles: Longs) -> Parts:
    """One vertex for each distinct set of indices; the file's own where they all count alike."""
    vertices, colors, uvs, normals = tables
    assert vertices is not None
    index, first = indices[0], np.empty(0, np.int64)
    others = [(place, table) for place, table in zip(indices[2:], tables[2:], strict=True) if table is not None]
    if all(len(table) == len(vertices) + 1 and np.array_equal(index, place) for place, table in others):
        n = len(vertices)
        return Parts(vertices, index[triangles], normals=_first(normals, n), uvs=_first(uvs, n), colors=colors)
    for place, _ in others:
        mixed = index * (int(place.max()) + 1) + place
        _, first, index = np.unique(mixed, return_index=True, return_inverse=True)
    vertices, colors, uvs, normals = (
        None if table is None else table[place[first]] for table, place in zip(tables, indices, strict=True)
    )
    assert vertices is not None
    return Parts(vertices, index[triangles], normals=normals, uvs=uvs, colors=colors)


def _first(table: Doubles | None, count: int) -> Doubles | None:
    return None if table is None else table[:count]


def _statements(data: bytes) -> tuple[dict[str, Statements], "array[int]"]:
    """The statements that matter, and how many rows of each preceded each face: indices may count back."""
    v, vt, vn, f = Statements(), Statements(), Statements(), Statements()
    kinds, seen = {b"v": v, b"vt": vt, b"vn": vn, b"f": f}, array("q")
    text = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n").replace(b"\\\n", b" ")
    for number, line in enumerate(text.split(b"\n"), 1):
        words = line.split(None, 1)
        if not words or (kind := kinds.get(words[0])) is None:
            continue
        rest = words[1] if len(words) == 2 else b""
        kind.rows.append(rest.partition(b"#")[0] if b"#" in rest else rest)
        kind.lines.append(number)
        if kind is f:
            seen.extend((len(v.rows), len(vt.rows), len(vn.rows)))
    return {"v": v, "vt": vt, "vn": vn, "f": f}, seen


def _vectors(found: Statements, keyword: str, width: int) -> tuple[Doubles, Doubles | None]:
    """The first numbers of each row; and where every row has six, as some write colours, the last three."""
    if not found.rows:
        return np.empty((0, width)), None
    text = b"\n".join(found.rows)
    counts = _counts(text, _starts(np.frombuffer(text, np.uint8)))
    # A texture coordinate of one number lies on v = 0.
    least = 1 if keyword == "vt" else width
    if counts.min() < least:
        raise found.error(int(counts.argmin()), f"`{keyword}` needs {'a number' if least == 1 else 'three numbers'}")
    flat = _parse(text, np.float64, found, NUMBERS, int(counts.sum()))
    starts = np.cumsum(counts) - counts
    vectors: Doubles = flat[np.minimum(starts[:, None] + np.arange(width), len(flat) - 1)]
    vectors[counts[:, None] <= np.arange(width)] = 0
    colors = flat[starts[:, None] + np.arange(3, 6)] if keyword == "v" and (counts == 6).all() else None
    if not np.isfinite(vectors).all():
        row = int(np.flatnonzero(~np.isfinite(vectors).all(axis=1))[0])
        raise found.error(row, f"`{keyword}` is not finite")
    return vectors, colors


def _corners(faces: Statements) -> tuple[Longs, Longs, Longs, Longs]:
    """How many corners each face has, and each corner's v, vt and vn as written, 0 where absent.

    A corner is v, v/vt, v//vn or v/vt/vn: a number's place is told by the slashes before it in its corner.
    """
    text = b"\n".join(faces.rows)
    letters = np.frombuffer(text, np.uint8)
    corners = _starts(letters)
    counts = _counts(text, corners)
    if counts.min() < 3:
        worst = int(counts.argmin())
        raise faces.error(worst, f"a face needs at least three corners, this one has {counts[worst]}")
    spaced = text.replace(b"/", b" ")
    numbers = _starts(np.frombuffer(spaced, np.uint8))
    values = _parse(spaced, np.int64, faces, CORNERS, len(numbers))
    owner = np.searchsorted(corners, numbers, "right") - 1
    slashes = np.flatnonzero(letters == ord("/"))
    slot = np.searchsorted(slashes, numbers) - np.searchsorted(slashes, corners)[owner]
    row = np.repeat(np.arange(len(counts)), counts)
    for bad in (np.flatnonzero(slot > 2), np.flatnonzero(values == 0)):
        if len(bad):
            raise faces.error(int(row[owner[bad[0]]]), "corners are v, v/vt, v//vn or v/vt/vn, counted from 1")
    v, vt, vn = (np.zeros(len(corners), np.int64) for _ in range(3))
    for k, index in enumerate((v, vt, vn)):
        index[owner[slot == k]] = values[slot == k]
    if not v.all():
        raise faces.error(int(row[np.flatnonzero(v == 0)[0]]), "a corner lacks its vertex")
    return counts, v, vt, vn


def _resolve(faces: Statements, row: Longs, index: Longs, before: Longs, have: int, one: str, many: str) -> Longs:
    """Indices from 0, of indices from 1 or, negative, from the last one read before the face."""
    resolved = np.where(index > 0, index - 1, before + index)
    bad = np.flatnonzero((resolved < 0) | (resolved >= have))
    if len(bad):
        what = f"{one} {index[bad[0]]} does not exist, there are {have} {many}"
        raise faces.error(int(row[bad[0]]), what)
    return resolved


def _starts(letters: npt.NDArray[np.uint8]) -> Longs:
    """Where words begin."""
    blank = letters <= BLANK
    return np.flatnonzero(~blank & np.concatenate([[True], blank[:-1]]))


def _counts(text: bytes, starts: Longs) -> Longs:
    """Words on each line."""
    ends = np.flatnonzero(np.frombuffer(text + b"\n", np.uint8) == ord("\n"))
    return np.diff(np.searchsorted(starts, ends), prepend=0)


def _parse(text: bytes, dtype: Any, found: Statements, pattern: bytes, expected: int) -> npt.NDArray[Any]:
    """`expected` numbers; where the quick parser stumbles, the pattern of a good row finds the bad one."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # numpy warns where it stops short of the end
            values = np.fromstring(text, dtype, sep=" ")
        if len(values) == expected:
            return values
    except (ValueError, DeprecationWarning):
        pass
    for row, content in enumerate(found.rows):
        if not re.fullmatch(pattern, content, re.IGNORECASE):
            raise found.error(row, "not understood")
    raise ParseError("it holds numbers that can't be read")


def _shown(row: bytes) -> str:
    """A row for a message: short, printable."""
    text = row[:60].decode("utf-8", "replace").strip()
    return repr(text + ("…" if len(row) > 60 else "")) if text else "nothing follows"
