"""Wavefront OBJ -> triangles. Runs in the parsing child.

This reader is our own. trimesh's silently drops faces and normals that it cannot read, accepts indices beyond the
vertices, and reorders them. Here what can't be used is left out with a warning, and everything else is there.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from service.formats.errors import ParseError
from service.formats.read.bad_elements import Mask, left_out
from service.formats.read.corners import distinct
from service.formats.read.obj_colors import VertexColors
from service.formats.read.obj_lines import Block, Named, blocks
from service.formats.read.obj_rows import NOWHERE, WIDTHS, BadRows, Faults, Ints, corners, vectors
from service.formats.read.polygons import Longs, triangulate
from service.formats.read.raw_mesh import Numbers, RawMesh

NAMES = {
    "v": ("vertex", "vertices"),
    "vt": ("texture coordinate", "texture coordinates"),
    "vn": ("normal", "normals"),
}
INSTEAD = {"vt": "0 0 is used instead", "vn": "a computed one is used instead"}
MOST_NAMED = 1 << 20
MOST_KEYWORDS, OTHERS = 20, "…"  # different statements that are told as not read, and what stands for all others


@dataclass
class Found:
    """The contents of the blocks read so far. Corners count from 1, 0 is none; negative ones are resolved already."""

    tables: dict[str, list[Numbers]] = field(default_factory=lambda: {"v": [], "vt": [], "vn": []})
    bad: dict[str, BadRows] = field(default_factory=lambda: {keyword: BadRows() for keyword in WIDTHS})
    colors: VertexColors = field(default_factory=VertexColors)
    counts: list[Ints] = field(default_factory=list)
    corners: dict[str, list[Ints]] = field(default_factory=lambda: {"v": [], "vt": [], "vn": []})
    lines: list[Ints] = field(default_factory=list)  # of the faces
    named: list[Named] = field(default_factory=list)  # `faces` are those of the whole file
    faults: dict[str, Faults] = field(default_factory=lambda: {keyword: [] for keyword in WIDTHS})
    unread: dict[str, list[int]] = field(default_factory=dict)  # lines of statements that are not read, by keyword
    odd: list[Longs] = field(default_factory=list)  # lines with something after their numbers
    warnings: list[str] = field(default_factory=list)
    lost: int = 0  # corners whose texture coordinate does not exist
    named_vertices: Mask = field(
        default_factory=lambda: np.zeros(0, bool)
    )  # by any face; empty where all can be read

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
        for keyword, lines in block.unread.items():
            known = keyword in found.unread or len(found.unread) < MOST_KEYWORDS
            found.unread.setdefault(keyword if known else OTHERS, []).extend(lines)
        rows_before = [found.rows(k) for k in WIDTHS]
        _add_rows(found, block)
        if block.rows["f"].text:
            lines_of = block.rows["f"].lines
            counts, *places = corners(block.rows["f"], found.faults)
            found.counts.append(counts.astype(np.int32))
            found.lines.append(lines_of.astype(np.int32))
            for k, (keyword, index) in enumerate(zip(WIDTHS, places, strict=True)):
                faults = found.faults[keyword]
                _count_back(index, counts, rows_before[k] + block.before[:, k], keyword, lines_of, faults)
                _check(index, NOWHERE, found.rows(keyword), keyword, counts, lines_of, faults)
                found.corners[keyword].append(index.astype(np.int32))
        if len(found.named) > MOST_NAMED:
            raise ParseError(f"it has more than {MOST_NAMED} `usemtl`, `mtllib` and `s` statements")
    if not found.counts:
        raise ParseError("it has no faces")
    _leave_out(found)
    _tell_unread(found)
    return found


def _add_rows(found: Found, block: Block) -> None:
    for keyword in WIDTHS:
        if block.rows[keyword].text:
            at = found.rows(keyword)
            read = vectors(block.rows[keyword], keyword, at, found.bad[keyword])
            found.tables[keyword].append(read.rows)
            found.odd.append(read.odd)
            if read.more is not None and read.more_counts is not None:
                found.colors.add(at, read.more, read.more_counts)
    found.colors.add_comments(block.comments)


def _tell_unread(found: Found) -> None:
    """Warn about rows that can't be read, if they did not cost a face, and about statements that are not read."""
    for keyword, bad in found.bad.items():
        rows = np.concatenate(bad.rows) if len(bad) else np.empty(0, np.int64)
        if keyword == "v":
            rows = rows[~found.named_vertices[rows]]
        if len(rows):
            one, many = NAMES[keyword]
            which = f"1 {one} can't be read" if len(rows) == 1 else f"{len(rows)} {many} can't be read, the first"
            otherwise = INSTEAD.get(keyword, "no face uses it" if len(rows) == 1 else "no face uses them")
            found.warnings.append(f"{which}: {bad.reason(int(rows[0]))}; {otherwise}")
    odd = np.concatenate(found.odd) if found.odd else np.empty(0, np.int64)
    if len(odd):
        which = f"line {odd[0]} goes" if len(odd) == 1 else f"{len(odd)} lines, the first of them {min(odd)}, go"
        found.warnings.append(f"{which} on after their numbers with something that is not understood")
    for keyword, lines in found.unread.items():
        which = f"line {lines[0]} is" if len(lines) == 1 else f"{len(lines)} lines, the first of them {lines[0]}, are"
        found.warnings.append(f"the statement {keyword!r} is not supported: {which} not read")


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
    """Take out the faces that lead nowhere or name a vertex that can't be used, and the indices of other rows that
    lead nowhere. Raises ParseError where no face is left."""
    rows = {keyword: found.rows(keyword) for keyword in WIDTHS}
    lost = {keyword: 0 for keyword in INSTEAD}
    bad_vertices = found.bad["v"].mask(rows["v"]) if len(found.bad["v"]) else None
    found.named_vertices = np.zeros(rows["v"] if bad_vertices is not None else 0, bool)
    broken = []
    for k, (counts, lines) in enumerate(zip(found.counts, found.lines, strict=True)):
        row = np.repeat(np.arange(len(counts)), counts)
        without = {}
        for keyword in INSTEAD:
            index = found.corners[keyword][k]
            beyond = _check(index, rows[keyword], rows[keyword], keyword, counts, lines, found.faults[keyword])
            index[beyond] = 0
            without[keyword] = beyond
        index = found.corners["v"][k]
        beyond = _check(index, rows["v"], rows["v"], "v", counts, lines, found.faults["v"])
        bad = np.zeros(len(counts), bool)
        bad[row[beyond]] = True
        if bad_vertices is not None:
            is_there = index <= rows["v"]
            found.named_vertices[index[is_there] - 1] = True
            unusable = np.flatnonzero(is_there & bad_vertices[np.where(is_there, index, 1) - 1])
            if len(unusable):
                vertex = int(index[unusable[0]])
                why = found.bad["v"].reason(vertex - 1)
                found.faults["v"].append((int(lines[row[unusable[0]]]), f"vertex {vertex} can't be used ({why})"))
                bad[row[unusable]] = True
        if bad.any():
            remaining = np.repeat(~bad, counts)
            found.counts[k] = counts[~bad]
            for pieces in found.corners.values():
                pieces[k] = pieces[k][remaining]
        broken.append(bad)
        for keyword, beyond in without.items():
            lost[keyword] += int(np.count_nonzero(~bad[row[beyond]]))
    found.lines = []
    before = np.concatenate([[0], *broken]).cumsum()
    count = int(before[-1])
    if count:
        reason = _first(found.faults["v"])
        if not sum(map(len, found.counts)):
            raise ParseError(reason if count == 1 else f"none of its {count} faces can be used; {reason}")
        found.named = [replace(one, faces=one.faces - int(before[one.faces])) for one in found.named]
        found.warnings.append(left_out(count, "face", reason))
    for keyword, number in lost.items():
        if number:
            reason = _first(found.faults[keyword])
            which = "1 corner names" if number == 1 else f"{number} corners name"
            found.warnings.append(
                f"{which} {NAMES[keyword][1]} that do not exist; {INSTEAD[keyword]}; the first: {reason}"
            )
    found.lost = lost["vt"]


def _first(faults: Faults) -> str:
    line, what = min(faults)
    return f"line {line}: {what}"


def _joined(found: Found) -> RawMesh:
    """One vertex for each distinct set of indices; the file's own where they all count alike."""
    counts = np.concatenate(found.counts).astype(np.int64)
    tables = {k: np.concatenate(found.tables[k] or [np.empty((0, width))]) for k, width in WIDTHS.items()}
    found.tables = {}
    index = {}
    for keyword in WIDTHS:
        index[keyword] = np.concatenate(found.corners.pop(keyword))
    vertices = tables["v"]
    warnings = found.warnings
    colors = found.colors.resolved(len(vertices), warnings)
    missing = {keyword: int(np.count_nonzero(place == 0)) for keyword, place in index.items()}
    for place in index.values():
        place -= 1  # -1: the row of zeros at the end; a normal is computed
    corner = index.pop("v")
    used = {keyword: place for keyword, place in index.items() if missing[keyword] < len(corner)}
    del index
    for keyword in used:
        if missing[keyword]:
            tables[keyword] = np.concatenate([tables[keyword], np.zeros((1, WIDTHS[keyword]))])
            never = missing[keyword] - found.lost
            if keyword == "vt" and never > 0:
                warnings.append(f"{never} corners have no texture coordinate; they take 0 0")
    triangles = None if (counts == 3).all() else triangulate(vertices, corner, counts)
    alike = all(len(tables[k]) == len(vertices) and np.array_equal(corner, place) for k, place in used.items())
    rows = {"v": vertices, **{k: tables[k] for k in used}}
    if colors is not None:
        rows["colors"] = colors
    if not alike:
        first, joined = distinct(corner, len(vertices), [(place, len(tables[k])) for k, place in used.items()])
        places = {"v": corner, "colors": corner, **used}
        rows = {k: table[places[k][first]] for k, table in rows.items()}
        corner = joined
    faces = corner.reshape(-1, 3) if triangles is None else corner[triangles]
    groups = None if "vn" in rows else _groups(found, counts)
    return RawMesh(
        rows["v"], faces, rows.get("vn"), rows.get("vt"), None, rows.get("colors"), warnings, groups=groups
    )
