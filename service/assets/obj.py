"""Wavefront OBJ -> triangles, strictly. Runs in the parsing child.

Our own, and not trimesh's: that one drops a face or a normal it cannot read in silence, keeps indices beyond the
vertices, and reorders. Lines, texture coordinates, materials and free-form statements are skipped.
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


def read_obj(data: bytes) -> tuple[Doubles, Longs, Doubles | None]:
    """Vertices as the file has them, or, where it gives normals, one for each pair of vertex and normal in use."""
    found, seen = _statements(data)
    vertices, normals = _vectors(found["v"], "v"), _vectors(found["vn"], "vn")
    faces = found["f"]
    if not faces.rows:
        raise ParseError("it has no faces")
    counts, corner_v, corner_n = _corners(faces)
    row = np.repeat(np.arange(len(counts)), counts)
    places = np.frombuffer(seen, np.int64).reshape(-1, 2)[row]
    corner_v = _resolve(faces, row, corner_v, places[:, 0], len(vertices), "vertex", "vertices")
    triangles = triangulate(vertices, corner_v, counts)
    given = corner_n != 0
    if not given.any():
        return vertices, corner_v[triangles], None
    corner_n[given] = _resolve(
        faces, row[given], corner_n[given], places[given, 1], len(normals), "normal", "normals"
    )
    corner_n[~given] = len(normals)  # a row of zeros: to be computed
    normals = np.concatenate([normals, np.zeros((1, 3))])
    if len(normals) == len(vertices) + 1 and np.array_equal(corner_v, corner_n):
        return vertices, corner_v[triangles], normals[:-1]
    pairs, corner = np.unique(corner_v * len(normals) + corner_n, return_inverse=True)
    return vertices[pairs // len(normals)], corner[triangles], normals[pairs % len(normals)]


def _statements(data: bytes) -> tuple[dict[str, Statements], "array[int]"]:
    """The statements that matter, and how many vertices and normals preceded each face: indices may count back."""
    v, vn, f = Statements(), Statements(), Statements()
    kinds, seen = {b"v": v, b"vn": vn, b"f": f}, array("q")
    text = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n").replace(b"\\\n", b" ")
    for number, line in enumerate(text.split(b"\n"), 1):
        words = line.split(None, 1)
        if not words or (kind := kinds.get(words[0])) is None:
            continue
        rest = words[1] if len(words) == 2 else b""
        kind.rows.append(rest.partition(b"#")[0] if b"#" in rest else rest)
        kind.lines.append(number)
        if kind is f:
            seen.extend((len(v.rows), len(vn.rows)))
    return {"v": v, "vn": vn, "f": f}, seen


def _vectors(found: Statements, keyword: str) -> Doubles:
    """The first three numbers of each row; a weight or a colour may follow."""
    if not found.rows:
        return np.empty((0, 3))
    text = b"\n".join(found.rows)
    counts = _counts(text, _starts(np.frombuffer(text, np.uint8)))
    if counts.min() < 3:
        raise found.error(int(counts.argmin()), f"`{keyword}` needs three numbers")
    flat = _parse(text, np.float64, found, NUMBERS, int(counts.sum()))
    vectors: Doubles = flat[(np.cumsum(counts) - counts)[:, None] + np.arange(3)]
    if not np.isfinite(vectors).all():
        row = int(np.flatnonzero(~np.isfinite(vectors).all(axis=1))[0])
        raise found.error(row, f"`{keyword}` is not finite")
    return vectors


def _corners(faces: Statements) -> tuple[Longs, Longs, Longs]:
    """How many corners each face has, and the vertex and normal index of each corner as written, 0 where absent.

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
    v, vn = np.zeros(len(corners), np.int64), np.zeros(len(corners), np.int64)
    v[owner[slot == 0]] = values[slot == 0]
    vn[owner[slot == 2]] = values[slot == 2]
    if not v.all():
        raise faces.error(int(row[np.flatnonzero(v == 0)[0]]), "a corner lacks its vertex")
    return counts, v, vn


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
