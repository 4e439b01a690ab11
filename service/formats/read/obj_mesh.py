"""Wavefront OBJ -> triangles, strictly. Runs in the parsing child.

This reader is our own. trimesh's silently drops faces and normals that it cannot read, accepts indices beyond the
vertices, and reorders them. Here a face with an index that leads nowhere is left out, with a warning.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from service.formats.errors import ParseError
from service.formats.read.obj_lines import CORNERS, NUMBERS, Lines, Named, blocks, starts_of_words
from service.formats.read.polygons import Longs, triangulate
from service.formats.read.raw_mesh import Numbers, RawMesh
from service.formats.types import Doubles

Ints = npt.NDArray[np.int32]
Faults = list[tuple[int, str]]  # lines with an index that leads nowhere, and why
WIDTHS = {"v": 3, "vt": 2, "vn": 3}
NAMES = {
    "v": ("vertex", "vertices"),
    "vt": ("texture coordinate", "texture coordinates"),
    "vn": ("normal", "normals"),
}
NOWHERE = 2**31 - 1  # an index that leads to no row, whatever the file wrote: none has so many
SHARES = 8
MOST_NAMED = 1 << 20


@dataclass
class Found:
    """The contents of the blocks read so far. Corners count from 1, 0 is none; negative ones are resolved already."""

    tables: dict[str, list[Numbers]] = field(default_factory=lambda: {"v": [], "vt": [], "vn": []})
    colors: list[Numbers] = field(default_factory=list)
    counts: list[Ints] = field(default_factory=list)
    corners: dict[str, list[Ints]] = field(default_factory=lambda: {"v": [], "vt": [], "vn": []})
    lines: list[Ints] = field(default_factory=list)  # of the faces
    named: list[Named] = field(default_factory=list)  # `faces` are those of the whole file
    faults: Faults = field(default_factory=list)
    left_out: int = 0  # faces with an index that leads nowhere

    def rows(self, keyword: str) -> int:
        return sum(map(len, self.tables[keyword]))


@dataclass
class MaterialMesh:
    """An OBJ file with the materials that it names: triangle k has `materials[of_triangle[k]]`."""

    mesh: RawMesh
    materials: list[str]  # the first is that of faces before any `usemtl`: ""
    of_triangle: Ints
    libraries: list[Named]  # `mtllib` statements, each text once


def read_obj(data: bytes | memoryview) -> RawMesh:
    """The mesh of an OBJ file. Its vertices are the file's, or one for each distinct set of a corner's indices."""
    return _joined(_found(data))


def read_obj_with_materials(data: bytes | memoryview) -> MaterialMesh:
    """The mesh of `read_obj`, with the material of each triangle."""
    found = _found(data)
    counts = np.concatenate(found.counts)
    names, of_face = _in_force([one for one in found.named if one.keyword == "usemtl"], len(counts))
    libraries: dict[str, Named] = {}
    for one in found.named:
        if one.keyword == "mtllib":
            libraries.setdefault(one.name, one)
    return MaterialMesh(_joined(found), names, np.repeat(of_face, counts - 2), list(libraries.values()))


def _in_force(statements: list[Named], faces: int) -> tuple[list[str], Ints]:
    """The distinct names of these statements, the first being "", and the number of the one that is in force at each
    of so many faces: the last before it."""
    numbers = {"": 0}
    chosen = [0, *(numbers.setdefault(one.name, len(numbers)) for one in statements)]
    starts = np.array([0, *(one.faces for one in statements)])
    use = np.searchsorted(starts, np.arange(faces), "right") - 1
    return list(numbers), np.array(chosen, np.int32)[use]


def _groups(found: Found, counts: Longs) -> Ints | None:
    """The smoothing group of each triangle, from 1 on, 0 where smoothing is off; None where all share one group."""
    said = [one for one in found.named if one.keyword == "s"]
    off = {"off", "0", ""}
    _, of_face = _in_force(
        [replace(one, name="" if one.name.lower() in off else one.name) for one in said], len(counts)
    )
    if of_face.min() == of_face.max() > 0:
        return None
    return np.repeat(of_face, counts - 2)


def _found(data: bytes | memoryview) -> Found:
    found, faces = Found(), 0
    for block in blocks(data):
        found.named += [replace(one, faces=one.faces + faces) for one in block.named]
        faces += len(block.before)
        rows_before = [found.rows(k) for k in WIDTHS]
        for keyword, width in WIDTHS.items():
            if block.rows[keyword].text:
                table, colors = _vectors(block.rows[keyword], keyword, width)
                found.tables[keyword].append(table)
                if keyword == "v":
                    found.colors.append(np.empty((0, 3)) if colors is None else colors)
        if block.rows["f"].text:
            lines = block.rows["f"].lines
            counts, *corners = _corners(block.rows["f"], found.faults)
            found.counts.append(counts.astype(np.int32))
            found.lines.append(lines.astype(np.int32))
            for k, (keyword, index) in enumerate(zip(WIDTHS, corners, strict=True)):
                _count_back(index, counts, rows_before[k] + block.before[:, k], keyword, lines, found.faults)
                _check(index, NOWHERE, found.rows(keyword), keyword, counts, lines, found.faults)
                found.corners[keyword].append(index.astype(np.int32))
        if len(found.named) > MOST_NAMED:
            raise ParseError(f"it has more than {MOST_NAMED} `usemtl`, `mtllib` and `s` statements")
    if not found.counts:
        raise ParseError("it has no faces")
    _leave_out(found)
    return found


def _count_back(index: Longs, counts: Longs, before: Longs, keyword: str, lines: Longs, faults: Faults) -> None:
    """Resolve negative indices to indices from 1; `before` is the number of rows before each face."""
    back = np.flatnonzero(index < 0)
    if len(back):
        row = np.repeat(np.arange(len(counts)), counts)[back]
        resolved = index[back] + before[row] + 1
        bad = np.flatnonzero(resolved < 1)
        if len(bad):
            one, many = NAMES[keyword]
            named, have = index[back[bad[0]]], before[row[bad[0]]]
            faults.append(
                (int(lines[row[bad[0]]]), f"{one} {named} does not exist; there are {have} {many} before it")
            )
            resolved[bad] = NOWHERE
        index[back] = resolved


def _check(
    index: Longs | Ints, most: int, have: int, keyword: str, counts: Longs | Ints, lines: Longs | Ints, faults: Faults
) -> Longs:
    """The places of indices beyond `most`, which lead nowhere from here on; `have` is the number of rows so far."""
    beyond = np.flatnonzero(index > most)
    new = beyond[index[beyond] != NOWHERE]
    if len(new):
        one, many = NAMES[keyword]
        line = lines[np.searchsorted(np.cumsum(counts), new[0], "right")]
        faults.append((int(line), f"{one} {index[new[0]]} does not exist; there are {have} {many}"))
        index[new] = NOWHERE
    return beyond


def _leave_out(found: Found) -> None:
    """Take out the faces with an index that leads nowhere. Raises ParseError where no face is left."""
    rows = {keyword: found.rows(keyword) for keyword in WIDTHS}
    broken = []
    for k, (counts, lines) in enumerate(zip(found.counts, found.lines, strict=True)):
        bad = np.zeros(len(counts), bool)
        for keyword, have in rows.items():
            beyond = _check(found.corners[keyword][k], have, have, keyword, counts, lines, found.faults)
            bad[np.searchsorted(np.cumsum(counts), beyond, "right")] = True
        if bad.any():
            remaining = np.repeat(~bad, counts)
            found.counts[k] = counts[~bad]
            for pieces in found.corners.values():
                pieces[k] = pieces[k][remaining]
        broken.append(bad)
    found.lines = []
    before = np.concatenate([[0], *broken]).cumsum()
    found.left_out = int(before[-1])
    if found.left_out:
        if not sum(map(len, found.counts)):
            raise ParseError("line {}: {}".format(*min(found.faults)))
        found.named = [replace(one, faces=one.faces - int(before[one.faces])) for one in found.named]


def _joined(found: Found) -> RawMesh:
    """One vertex for each distinct set of indices; the file's own where they all count alike."""
    counts = np.concatenate(found.counts).astype(np.int64)
    tables = {k: np.concatenate(found.tables[k] or [np.empty((0, width))]) for k, width in WIDTHS.items()}
    colors = np.concatenate(found.colors or [np.empty((0, 3))])
    found.tables, found.colors = {}, []
    index = {}
    for keyword in WIDTHS:
        index[keyword] = np.concatenate(found.corners.pop(keyword))
    vertices = tables["v"]
    warnings = []
    if found.left_out:
        which = "1 face is left out" if found.left_out == 1 else f"{found.left_out} faces are left out, the first"
        warnings.append("{}: line {}: {}".format(which, *min(found.faults)))
    missing = {keyword: int(np.count_nonzero(place == 0)) for keyword, place in index.items()}
    for place in index.values():
        place -= 1  # -1: the row of zeros at the end; a normal is computed
    corner = index.pop("v")
    used = {keyword: place for keyword, place in index.items() if missing[keyword] < len(corner)}
    del index
    for keyword in used:
        if missing[keyword]:
            tables[keyword] = np.concatenate([tables[keyword], np.zeros((1, WIDTHS[keyword]))])
            if keyword == "vt":
                warnings.append(f"{missing[keyword]} corners have no texture coordinate; they take 0 0")
    triangles = None if (counts == 3).all() else triangulate(vertices, corner, counts)
    alike = all(len(tables[k]) == len(vertices) and np.array_equal(corner, place) for k, place in used.items())
    rows = {"v": vertices, **{k: tables[k] for k in used}}
    if len(colors) == len(vertices):
        rows["colors"] = colors
    if not alike:
        first, joined = _distinct(corner, len(vertices), [(place, len(tables[k])) for k, place in used.items()])
        places = {"v": corner, "colors": corner, **used}
        rows = {k: table[places[k][first]] for k, table in rows.items()}
        corner = joined
    faces = corner.reshape(-1, 3) if triangles is None else corner[triangles]
    groups = None if "vn" in rows else _groups(found, counts)
    return RawMesh(
        rows["v"], faces, rows.get("vn"), rows.get("vt"), None, rows.get("colors"), warnings, groups=groups
    )


def _distinct(corner: Ints, have: int, others: list[tuple[Ints, int]]) -> tuple[Longs, Ints]:
    """(the first corner of each distinct set of indices, in their order; the number of each corner's set).

    `others`: indices from -1 on, and how many rows they count in. A share of the vertices at a time: sorting all
    corners of a million triangles at once takes a quarter of a gigabyte.
    """
    firsts, joined, count = [], np.empty(len(corner), np.int32), 0
    step = max(have // SHARES, 1)
    for low in range(0, have, step):
        these = np.flatnonzero((corner >= low) & (corner < low + step))
        mixed = corner[these].astype(np.int64)
        for number, (place, rows) in enumerate(others):
            mixed = mixed * (rows + 1) + (place[these] + 1)
            if number < len(others) - 1:  # three indices of 31 bits don't fit into 64: two at a time
                mixed = np.unique(mixed, return_inverse=True)[1]
        _, first, inverse = np.unique(mixed, return_index=True, return_inverse=True)
        firsts.append(these[first])
        joined[these] = inverse + count
        count += len(first)
    return np.concatenate(firsts), joined


def _vectors(found: Lines, keyword: str, width: int) -> tuple[Doubles, Doubles | None]:
    """The first numbers of each row; and where every row has six, as some write colours, the last three."""
    counts = found.counts(starts_of_words(np.frombuffer(found.text, np.uint8)))
    # A texture coordinate of one number lies on v = 0.
    least = 1 if keyword == "vt" else width
    if counts.min() < least:
        needs = "a number" if least == 1 else "three numbers"
        raise found.error(int(counts.argmin()), f"`{keyword}` needs {needs}")
    flat = found.parse(found.text, np.float64, NUMBERS, int(counts.sum()))
    colors = None
    if (counts == width).all():
        vectors: Doubles = flat.reshape(-1, width)
    else:
        starts = np.cumsum(counts) - counts
        vectors = flat[np.minimum(starts[:, None] + np.arange(width), len(flat) - 1)]
        vectors[counts[:, None] <= np.arange(width)] = 0
        if keyword == "v" and (counts == 6).all():
            colors = flat.reshape(-1, 6)[:, 3:]
    if not np.isfinite(vectors).all():
        row = int(np.flatnonzero(~np.isfinite(vectors).all(axis=1))[0])
        raise found.error(row, f"`{keyword}` is not finite")
    return vectors, colors


def _corners(faces: Lines, faults: Faults) -> tuple[Longs, Longs, Longs, Longs]:
    """The number of corners of each face, and each corner's v, vt and vn as written, 0 where absent.

    A corner is v, v/vt, v//vn or v/vt/vn: the slashes before a number say which of them it is.
    """
    letters = np.frombuffer(faces.text, np.uint8)
    corners = starts_of_words(letters)
    counts = faces.counts(corners)
    if counts.min() < 3:
        worst = int(counts.argmin())
        raise faces.error(worst, f"a face needs at least three corners, this one has {counts[worst]}")
    spaced = faces.text.replace(b"/", b" ")
    numbers = starts_of_words(np.frombuffer(spaced, np.uint8))
    values = faces.parse(spaced, np.int64, CORNERS, len(numbers))
    owner = np.searchsorted(corners, numbers, "right") - 1
    slashes = np.flatnonzero(letters == ord("/"))
    slot = np.searchsorted(slashes, numbers) - np.searchsorted(slashes, corners)[owner]
    row = np.repeat(np.arange(len(counts)), counts)
    long = np.flatnonzero(slot > 2)
    if len(long):
        raise faces.error(int(row[owner[long[0]]]), "corners are v, v/vt, v//vn or v/vt/vn")
    zero = np.flatnonzero(values == 0)
    if len(zero):
        faults.append(
            (int(faces.lines[row[owner[zero[0]]]]), "an index of 0 does not exist; they are counted from 1")
        )
        values[zero] = NOWHERE
    v, vt, vn = (np.zeros(len(corners), np.int64) for _ in range(3))
    for k, index in enumerate((v, vt, vn)):
        index[owner[slot == k]] = values[slot == k]
    if not v.all():
        raise faces.error(int(row[np.flatnonzero(v == 0)[0]]), "a corner lacks its vertex")
    return counts, v, vt, vn
