"""Faces that can't be used are left out, and numbers that are none get a value that does no harm: one bad element
never costs a whole file. Each kind is told once, with its count and the first."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from service.formats.errors import ParseError
from service.formats.read.raw_mesh import MAX_COORDINATE, Numbers, RawMesh

Mask = npt.NDArray[np.bool_]
NO_INDEX = -(1 << 31)  # what stands for an index that is no whole number
Namer = Callable[[int], str]

OF_VERTEX: dict[str, tuple[str, float, str]] = {
    "normals": ("the normal of vertex", 0.0, "it is computed"),
    "uvs": ("the texture coordinate of vertex", 0.0, "0 0 is used instead"),
    "uvs_1": ("the second texture coordinate of vertex", 0.0, "0 0 is used instead"),
    "colors": ("the colour of vertex", 1.0, "white is used instead"),
    "tangents": ("the tangent of vertex", 0.0, "it is computed"),
}


def mend(parts: RawMesh, max_triangles: int) -> None:
    """Take out of a mesh what can't be used, with warnings: its numbers are finite and in range afterwards, its faces
    name vertices that there are. Raises ParseError where no triangle remains, or too many."""
    if not len(parts.faces):
        raise ParseError("it has no faces")
    if len(parts.faces) > max_triangles:
        raise ParseError(f"{len(parts.faces)} triangles are more than the {max_triangles} allowed")
    vertices = np.asarray(parts.vertices)
    used = np.zeros(len(vertices), bool)
    if not are_places(vertices).all() or parts.faces.min() < 0 or parts.faces.max() >= len(vertices):
        corners = parts.faces.reshape(-1)
        used[corners[(corners >= 0) & (corners < len(vertices))]] = True
        whole, reason = whole_faces(vertices, corners, np.full(len(parts.faces), 3), counted("triangle"))
        refuse_nothing(whole, reason)
        if not whole.all():
            parts.warnings.append(left_out(int((~whole).sum()), "triangle", reason))
            parts.faces = parts.faces[whole]
            parts.groups = None if parts.groups is None else parts.groups[whole]
        parts.vertices = unused_places(vertices, counted("vertex"), used, parts.warnings)
    for member, (name, fill, otherwise) in OF_VERTEX.items():
        rows = getattr(parts, member)
        if rows is not None:
            setattr(parts, member, finite_rows(rows, fill, counted(name), otherwise, parts.warnings))


def counted(what: str) -> Namer:
    """Names elements by their numbers from 0 on."""
    return lambda number: f"{what} {number} (counted from 0)"


def are_places(vertices: Numbers) -> Mask:
    """(n,) which rows are finite and in range."""
    if not len(vertices) or max(vertices.max(), -vertices.min()) <= MAX_COORDINATE:  # false where NaN is among them
        return np.ones(len(vertices), bool)
    return np.asarray((np.abs(vertices) <= MAX_COORDINATE).all(axis=1))  # false for NaN, too


def fault_of_place(row: Numbers) -> str:
    """Why a vertex can't be used."""
    what = "lies beyond 1e9 m" if np.isfinite(row).all() else "is not finite"
    return f"{what}: {row.tolist()}"


def whole_faces(
    vertices: Numbers,
    corners: npt.NDArray[np.integer],
    counts: npt.NDArray[np.integer],
    face: Namer,
    vertex: Namer | None = None,
) -> tuple[Mask, str]:
    """(m,) the faces of three corners or more that name vertices in range; and why the first of the others is not
    among them.

    `corners` are the vertices of all faces, one face after the other.
    """
    vertex = vertex or counted("vertex")
    is_there = (corners >= 0) & (corners < len(vertices))
    good = are_places(vertices)
    sound = is_there.copy() if good.all() else is_there & good[np.where(is_there, corners, 0)]
    whole = np.asarray(counts >= 3)
    if not sound.all():
        row = np.repeat(np.arange(len(counts)), counts)
        whole[row[~sound]] = False
    if whole.all():
        return whole, ""
    first = int(np.flatnonzero(~whole)[0])
    if counts[first] < 3:
        return whole, f"{face(first)} has {_corners(int(counts[first]))}; it needs three"
    start = int(counts[:first].sum())
    named = corners[start : start + int(counts[first])]
    lost = named[(named < 0) | (named >= len(vertices))]
    if len(lost) and lost[0] == NO_INDEX:
        return whole, f"{face(first)} has an index that is no whole number"
    if len(lost):
        return whole, f"{face(first)} names vertex {int(lost[0])}; there are {len(vertices)}"
    bad = int(named[~good[named]][0])
    return whole, f"{face(first)}: {vertex(bad)} {fault_of_place(vertices[bad])}"


def _corners(count: int) -> str:
    return {0: "no corners", 1: "1 corner"}.get(count, f"{count} corners")


def left_out(count: int, what: str, reason: str) -> str:
    """The warning about faces that are not there, the first for this reason."""
    which = f"1 {what} is left out" if count == 1 else f"{count} {what}s are left out, the first"
    return f"{which}: {reason}"


def refuse_nothing(whole: Mask, reason: str) -> None:
    """Raise ParseError where no face remains."""
    if len(whole) and not whole.any():
        raise ParseError(reason if len(whole) == 1 else f"none of its {len(whole)} faces can be used; {reason}")


def unused_places(vertices: Numbers, vertex: Namer, used: Mask, warnings: list[str]) -> Numbers:
    """The vertices, those out of range at the origin, where no face shows them; of those that no face named, `used`,
    there is a warning."""
    good = are_places(vertices)
    if good.all():
        return vertices
    alone = np.flatnonzero(~good & ~used)
    if len(alone):
        first = f"{vertex(int(alone[0]))} {fault_of_place(vertices[alone[0]])}"
        warnings.append(
            f"{first}; no face uses it" if len(alone) == 1
            else f"{len(alone)} vertices that no face uses can't be placed, the first: {first}"
        )  # fmt: skip
    return np.where(good[:, None], vertices, 0.0)


def finite_rows(
    rows: Numbers, fill: float | Sequence[float], name: Namer, otherwise: str, warnings: list[str]
) -> Numbers:
    """The rows, those that are not finite as `fill`, with a warning that ends in `otherwise`: what they become."""
    finite: Mask = np.asarray(np.isfinite(rows).all(axis=1))
    if finite.all():
        return rows
    bad = np.flatnonzero(~finite)
    more = "" if len(bad) == 1 else f" (here and {len(bad) - 1} more)"
    warnings.append(f"{name(int(bad[0]))} is not finite{more}: {rows[bad[0]].tolist()}; {otherwise}")
    return np.where(finite[:, None], rows, np.asarray(fill, rows.dtype))
