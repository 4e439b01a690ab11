"""Meshes -> triangles in the world, with their normals."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from gpu import layout
from gpu.layout import ShapeBit
from service.pack.geometry.parallel import chunks, in_threads
from service.pack.geometry.tangents import Tangents, codes, tangents
from service.pack.geometry.vertex_normals import corner_normals, encode, split

# Sine of an angle below which a triangle's area is rounding noise in float32, whatever its size.
FLAT = 4 * float(np.finfo(np.float32).eps)
SMALLEST = float(np.finfo(np.float32).tiny)

Rows = slice | np.ndarray


@dataclass(frozen=True)
class PlacedMesh:
    """Vertices in the world (n, 3) float64, faces (m, 3) counter-clockwise from outside.

    `normals` (k, 3) float64 in the world, some perhaps zero, are indexed by `normal_faces` (m, 3); None: flat.
    """

    vertices: np.ndarray
    faces: np.ndarray
    normals: np.ndarray | None
    normal_faces: np.ndarray
    single_sided: bool
    material: int
    shape: int
    uvs: np.ndarray | None = None  # (n, 2), one for each vertex
    uvs_1: np.ndarray | None = None
    colors: np.ndarray | None = None  # (n, 3 or 4)
    tangents: Tangents | None = None  # where the material needs them


@dataclass(frozen=True)
class Chart:
    """The source of a mesh's tangents: `given` (n, 4) as in a glTF file, or else the texture coordinates (n, 2)."""

    uvs: np.ndarray | None
    given: np.ndarray | None

    def of(self, which: np.ndarray) -> Chart:
        """The chart of these vertices."""
        return Chart(*(None if rows is None else rows[which] for rows in (self.uvs, self.given)))


def place(
    vertices: np.ndarray, faces: np.ndarray, normals: np.ndarray | None, smooth: bool | np.ndarray,
    matrix: np.ndarray | None, single_sided: bool, used: tuple[int, int],
    uvs: np.ndarray | None = None, uvs_1: np.ndarray | None = None, colors: np.ndarray | None = None,
    chart: Chart | None = None,
) -> PlacedMesh:  # fmt: skip
    """The mesh under its transform; a smooth one without normals gets them here, in its own space, and one with a
    `chart` its tangents. `smooth` may be the smoothing groups of the faces (m,), of which 0 has facets."""
    groups = smooth if isinstance(smooth, np.ndarray) and normals is None and np.any(smooth) else None
    if groups is not None:
        which, group, faces = split(faces, groups)
        vertices = vertices[which]
        uvs, uvs_1, colors = (None if rows is None else rows[which] for rows in (uvs, uvs_1, colors))
        chart = None if chart is None else chart.of(which)
        found, places = corner_normals(vertices, faces, group)
        normals = np.empty((len(vertices), 3))
        normals[faces] = found[places]
    normal_faces = faces
    if not np.any(smooth):
        normals = None
    elif normals is None:
        normals, normal_faces = corner_normals(vertices, faces)
    along = None if chart is None else tangents(vertices, faces, normals, normal_faces, chart.uvs, chart.given)
    if matrix is not None:
        axes = matrix[:3, :3]
        vertices = vertices @ axes.T + matrix[:3, 3]
        if normals is not None:  # by the inverse transpose; rows, so from the right; its size does not matter
            normals = normals @ (np.linalg.inv(axes) * np.abs(axes).max())
        along = None if along is None else along.moved(axes)
        if np.linalg.det(axes) < 0:
            faces, normal_faces = faces[:, [0, 2, 1]], normal_faces[:, [0, 2, 1]]
    return PlacedMesh(vertices, faces, normals, normal_faces, single_sided, *used, uvs, uvs_1, colors, along)


def survey(meshes: list[PlacedMesh], origin: np.ndarray) -> tuple[Triangles, np.ndarray]:
    """The triangles that have an area, and the boxes (n, 6) float32 around them, in the order of the meshes."""
    points = [(mesh.vertices - origin).astype(np.float32) for mesh in meshes]
    valid, boxes, degenerate = list[np.ndarray | None](), [np.zeros((0, 6), np.float32)], dict[int, int]()
    for mesh, vertices in zip(meshes, points, strict=True):
        found, flat = np.empty((len(mesh.faces), 6), np.float32), np.empty(len(mesh.faces), bool)
        in_threads(partial(_survey, vertices, mesh.faces, found, flat), chunks(len(found)))
        lost = int(np.count_nonzero(flat))
        valid.append(np.flatnonzero(~flat) if lost else None)
        boxes.append(found[~flat] if lost else found)
        if lost:
            degenerate[mesh.shape] = lost
    return Triangles(meshes, points, valid, degenerate), boxes[1] if len(meshes) == 1 else np.concatenate(boxes)


def _survey(points: np.ndarray, faces: np.ndarray, boxes: np.ndarray, flat: np.ndarray, which: slice) -> None:
    """Fill in the boxes of these faces, and which of them are degenerate: their normal would be lost in float32."""
    a, b, c = (points.take(faces[which, k], axis=0) for k in range(3))
    boxes[which, :3] = np.minimum(np.minimum(a, b), c)
    boxes[which, 3:] = np.maximum(np.maximum(a, b), c)
    e1, e2 = b - a, c - a
    size = _squares(np.cross(e1, e2))
    limit = np.maximum(FLAT**2 * _squares(e1) * _squares(e2), SMALLEST)
    flat[which] = ~((size > limit) & np.isfinite(size))


@dataclass(frozen=True)
class Triangles:
    """Triangles that are not laid out yet: the records of a million are written only once, into their final place.

    `places` (n,) of the methods below are the final places; None: the order of the meshes.
    """

    meshes: list[PlacedMesh]
    points: list[np.ndarray]  # their vertices (k, 3) float32, relative to the origin
    valid: list[np.ndarray | None]  # the faces that are not degenerate; None: all
    degenerate: dict[int, int]  # the number of degenerate faces, by shape

    def __len__(self) -> int:
        return sum(self._counts())

    @property
    def any_smooth(self) -> bool:
        return any(mesh.normals is not None for mesh in self.meshes)

    @property
    def any_tangents(self) -> bool:
        return any(mesh.tangents is not None for mesh in self.meshes)

    def have(self, name: str) -> bool:
        """True if a mesh has `uvs`, `uvs_1` or `colors`."""
        return any(getattr(mesh, name) is not None for mesh in self.meshes)

    def doubled_areas(self) -> np.ndarray:
        """(n,) float64: twice the area of each."""
        out = [np.zeros(0)]
        for number, which in enumerate(self.valid):
            a, b, c = self._corners(number, slice(None) if which is None else which)
            out.append(np.sqrt(_squares(np.cross(b - a, c - a))))
        return np.concatenate(out)

    def write(self, places: np.ndarray | None, out: np.ndarray) -> None:
        """Fill `layout.Triangle` records."""

        def some(number: int, which: Rows, where: Rows) -> None:
            mesh, record = self.meshes[number], np.empty(_count(which), layout.Triangle.dtype)
            record["v0"], record["v1"], record["v2"] = self._corners(number, which)
            record["material"], record["light"] = mesh.material, layout.NONE
            record["shape"] = mesh.shape | (ShapeBit.SINGLE_SIDED if mesh.single_sided else 0)
            _words(out)[where] = _words(record)

        self._spread(places, some)

    def write_normals(self, places: np.ndarray | None, out: np.ndarray) -> None:
        """Fill `layout.TriangleNormals` records."""
        smooth = [None if mesh.normals is None else _Smooth.of(mesh.normals) for mesh in self.meshes]

        def some(number: int, which: Rows, where: Rows) -> None:
            mesh, shading = self.meshes[number], smooth[number]
            record = np.zeros(_count(which), layout.TriangleNormals.dtype)
            if shading is not None or mesh.tangents is not None:
                a, b, c = self._corners(number, which)
                across = np.cross(b - a, c - a)
                if shading is not None:
                    shading.fill(mesh.normal_faces[which], across, record)
                else:
                    record["n0"] = record["n1"] = record["n2"] = encode(across)
                if mesh.tangents is not None:
                    _tangents(mesh.tangents, which, record)
            _words(out)[where] = _words(record)

        self._spread(places, some)

    def write_corners(self, name: str, places: np.ndarray | None, out: np.ndarray) -> None:
        """Fill `uvs`, `uvs_1` (n, 3, 2) or `colors` (n, 3, 4), with zeros or white for a mesh without them."""

        def some(number: int, which: Rows, where: Rows) -> None:
            values = getattr(self.meshes[number], name)
            corners = np.full((_count(which), *out.shape[1:]), name == "colors", out.dtype)
            if values is not None:
                faces = self.meshes[number].faces[which]
                corners[:, :, : values.shape[1]] = values.take(faces, axis=0)
            out[where] = corners

        self._spread(places, some)

    def _counts(self) -> list[int]:
        return [
            len(mesh.faces) if valid is None else len(valid)
            for mesh, valid in zip(self.meshes, self.valid, strict=True)
        ]

    def _corners(self, number: int, which: Rows) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        a, b, c = (self.points[number].take(self.meshes[number].faces[which, k], axis=0) for k in range(3))
        return a, b, c

    def _spread(self, places: np.ndarray | None, some: Callable[[int, Rows, Rows], None]) -> None:
        """Call `some` with a mesh's number, some of its faces and their final places, until all faces are done."""
        jobs, start = list[tuple[int, Rows, Rows]](), 0
        for number, (valid, count) in enumerate(zip(self.valid, self._counts(), strict=True)):
            for part in chunks(count):
                which = part if valid is None else valid[part]
                where = slice(start + part.start, start + part.stop)
                jobs.append((number, which, where if places is None else places[where]))
            start += count
        in_threads(lambda job: some(*job), jobs)


def _count(which: Rows) -> int:
    return which.stop - which.start if isinstance(which, slice) else len(which)


def _words(records: np.ndarray) -> np.ndarray:
    """The records as rows of words, which numpy moves faster."""
    return records.view(np.uint32).reshape(len(records), -1)


def _squares(v: np.ndarray) -> np.ndarray:
    return np.asarray(np.einsum("ij,ij->i", v, v, dtype=np.float64))


@dataclass(frozen=True)
class _Smooth:
    """A mesh's normals, with values that are computed once for each normal and not for each corner."""

    normals: np.ndarray
    codes: np.ndarray
    missing: np.ndarray | None  # which of them are zero; None: none of them

    @classmethod
    def of(cls, normals: np.ndarray) -> _Smooth:
        missing = np.asarray(~normals.any(axis=1))
        return cls(normals, encode(normals), missing if missing.any() else None)

    def fill(self, corners: np.ndarray, cross: np.ndarray, record: np.ndarray) -> None:
        """Fill the records of faces that index the normals by `corners`, and face along `cross`."""
        record["bits"] = layout.NORMALS_SMOOTH
        across = cross.astype(np.float64)
        found = [self.normals.take(corners[:, k], axis=0) for k in range(3)]
        # The order of the vertices decides which side is outward: normals of a file that all point inwards are
        # negated.
        behind = np.logical_and.reduce([np.einsum("ij,ij->i", normal, across) < 0 for normal in found])
        for name, normal, index in zip(("n0", "n1", "n2"), found, corners.T, strict=True):
            code = self.codes.take(index)
            if behind.any():
                code[behind] = encode(-normal[behind])
            if self.missing is not None:
                none = self.missing.take(index)
                code[none] = encode(cross[none])
            record[name] = code


def _tangents(tangents: Tangents, which: Rows, record: np.ndarray) -> None:
    """Add the tangents to records that have the normals already."""
    record["bits"] |= np.where(tangents.left[which], layout.NORMALS_LEFT, 0).astype(np.uint32)
    for k, name in enumerate(("n0", "n1", "n2")):
        code = codes(record[name], tangents.rows.take(tangents.corners[which, k], axis=0))
        record["bits"] |= code << np.uint32(layout.TANGENT_SHIFT + k * layout.TANGENT_BITS)
