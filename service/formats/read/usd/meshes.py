"""Meshes: polygons -> triangles, with values for each corner where the file has them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from pxr import Usd, UsdGeom

from service.formats.read.bad_elements import counted, left_out, unused_places, whole_faces
from service.formats.read.polygons import Longs, triangulate
from service.formats.read.raw_mesh import area_weighted
from service.formats.read.scenes.warnings import Warnings
from service.formats.read.usd.subdivision import bends
from service.formats.types import Indices

COLOR, OPACITY = "displayColor", "displayOpacity"
LEFT = "leftHanded"

Array = npt.NDArray[Any]


@dataclass(frozen=True)
class Values:
    """Rows (n, width), and which of them each corner of a triangle has (3 m,), or each point."""

    rows: Array
    of_corner: Longs | None = None
    of_point: Longs | None = None

    def at(self, corners: Longs, points: Longs) -> Longs:
        """The rows of these corners, which are those of these points."""
        if self.of_corner is not None:
            return self.of_corner[corners]
        return points if self.of_point is None else self.of_point[points]


@dataclass(frozen=True)
class Piece:
    """Triangles with one material: rows for each vertex (n, ...)."""

    vertices: Array
    faces: Indices
    normals: Array | None
    uvs: list[Array | None]
    colors: Array | None


class Mesh:
    """The triangles of a mesh. Raises ParseError where it names points or faces that it lacks."""

    def __init__(self, prim: Usd.Prim, time: Usd.TimeCode, notes: Warnings) -> None:
        self._prim, self._time, self._notes = prim, time, notes
        self.pointer = str(prim.GetPath())
        mesh = UsdGeom.Mesh(prim)
        self.points = _array(mesh.GetPointsAttr().Get(time), 3).astype(np.float64)
        corners = _array(mesh.GetFaceVertexIndicesAttr().Get(time)).astype(np.int64)
        counts = _array(mesh.GetFaceVertexCountsAttr().Get(time)).astype(np.int64)
        self.face_count = len(counts)
        if len(corners) != counts.sum() or (len(counts) and counts.min() < 0):
            detail = f"{counts.sum()} corners make its faces, and it has {len(corners)}; the mesh is left out"
            notes.leave_out(self.pointer, detail)
            corners, counts = corners[:0], counts[:0]
        self._corners = corners
        self._face_of_corner = np.repeat(np.arange(len(counts)), counts)
        whole, reason = whole_faces(self.points, corners, counts, counted("face"))
        if reason:
            notes.leave_out(self.pointer, left_out(int((~whole).sum()), "face", reason))
        self.points = self._finite_points(corners)
        holes = _array(mesh.GetHoleIndicesAttr().Get(time)).astype(np.int64)
        whole[holes[(holes >= 0) & (holes < len(counts))]] = False
        places = np.flatnonzero(whole[self._face_of_corner])
        self._whole = corners[places], counts[whole]
        local = triangulate(self.points, *self._whole)
        self.triangles: Longs = places[local]  # (m, 3): places among the corners
        if mesh.GetOrientationAttr().Get(time) == LEFT:
            self.triangles = self.triangles[:, ::-1]
        self.face_of = self._face_of_corner[self.triangles[:, 0]] if len(self.triangles) else np.empty(0, np.int64)
        scheme = mesh.GetSubdivisionSchemeAttr().Get(time)
        self.is_cage = scheme in ("catmullClark", "loop")
        self._api = UsdGeom.PrimvarsAPI(prim)
        self._normals = self._read_normals(mesh)

    def _finite_points(self, corners: Longs) -> Array:
        used, told = np.zeros(len(self.points), bool), list[str]()
        used[corners[(corners >= 0) & (corners < len(used))]] = True
        points = unused_places(self.points, counted("point"), used, told)
        for detail in told:
            self._notes.add(self.pointer, detail)
        return points

    @property
    def is_smooth(self) -> bool:
        return self._normals is not None

    def piece(self, which: Longs | None, charts: list[str], colored: bool) -> Piece:
        """The triangles of these numbers (None: all), with texture coordinates of these names."""
        corners = (self.triangles if which is None else self.triangles[which]).reshape(-1)
        points = self._corners[corners]
        uvs = [self.primvar(name, 2) for name in charts]
        colors = self._colors() if colored else None
        columns = [self._normals, *uvs, colors]
        rows = [None if values is None else values.at(corners, points) for values in columns]
        keys = [points, *(row for values, row in zip(columns, rows, strict=True)
                          if row is not None and values is not None and values.of_corner is not None)]  # fmt: skip
        first, faces = _welded(keys)
        taken = [
            None if values is None or row is None else values.rows[row[first]]
            for values, row in zip(columns, rows, strict=True)
        ]
        missing = np.zeros((len(first), 2), np.float32)  # as a reader of primvars gives where there are none
        return Piece(
            self.points[points[first]],
            faces.reshape(-1, 3).astype(np.int32),
            taken[0],
            [missing if rows is None else rows for rows in taken[1:-1]],
            taken[-1],
        )

    def primvar(self, name: str, width: int) -> Values | None:
        """The values of a primvar, its own or inherited; None where there are none that fit the mesh."""
        primvar = self._api.FindPrimvarWithInheritance(name)
        if not primvar or not primvar.HasValue():
            return None
        return self._values(
            f"primvars:{name}", primvar.Get(self._time), primvar.GetIndices(self._time),
            str(primvar.GetInterpolation()), width,
        )  # fmt: skip

    def has(self, name: str) -> bool:
        """True if there is a primvar of this name, whether or not it fits."""
        found = self._api.FindPrimvarWithInheritance(name)
        return bool(found) and bool(found.HasValue())

    def has_color(self) -> bool:
        return self.primvar(COLOR, 3) is not None

    def constant_color(self) -> list[float] | None:
        """The colour that the whole mesh has by itself; None where it has none, or many."""
        found, faint = self.primvar(COLOR, 3), self.primvar(OPACITY, 1)
        if found is None or len(found.rows) != 1 or (faint is not None and (faint.rows != 1).any()):
            return None
        return [float(value) for value in np.clip(found.rows[0], 0, 1)]

    def _colors(self) -> Values | None:
        found, faint = self.primvar(COLOR, 3), self.primvar(OPACITY, 1)
        if found is None:
            return None
        rows = np.clip(found.rows, 0, 1)
        if faint is not None and len(faint.rows) == 1 and faint.rows[0, 0] != 1:
            alpha = np.full((len(rows), 1), min(max(float(faint.rows[0, 0]), 0.0), 1.0))
            rows = np.concatenate([rows, alpha], axis=1)
        elif faint is not None and (faint.rows != 1).any():
            self._notes.add(
                self.pointer, "a displayOpacity that varies over the mesh is not supported; it is ignored"
            )
        return Values(rows, found.of_corner, found.of_point)

    def _read_normals(self, mesh: UsdGeom.Mesh) -> Values | None:
        """The file's normals, else those of a cage of a subdivision surface; None: the faces are flat."""
        found = self.primvar("normals", 3)
        if found is None:
            rows = mesh.GetNormalsAttr().Get(self._time)
            if rows:
                found = self._values("normals", rows, None, str(mesh.GetNormalsInterpolation()), 3)
        if self.is_cage and bends(self.points, *self._whole):
            self._notes.add(self.pointer, "subdivision is not supported; the surface is shown as its cage")
        if found is not None or not self.is_cage or not len(self.triangles):
            return found
        # From all faces of a point, which may be of several materials or have several texture coordinates.
        return Values(area_weighted(self.points, self._corners[self.triangles].astype(np.int32)))

    def _values(self, name: str, given: Any, indices: Any, interpolation: str, width: int) -> Values | None:
        rows = _array(given, width) if interpolation != "constant" or _is_list(given) else _array([given], width)
        count = {
            "constant": 1, "uniform": self.face_count, "vertex": len(self.points), "varying": len(self.points),
            "faceVarying": len(self._corners),
        }.get(interpolation, 0)  # fmt: skip
        numbers = _array(indices).astype(np.int64) if indices else np.arange(len(rows))
        fits = len(numbers) == count and (not len(numbers) or 0 <= numbers.min() <= numbers.max() < len(rows))
        if not fits or not len(rows) or not np.isfinite(rows).all():
            self._notes.add(
                f"{self.pointer}.{name}",
                f"its {len(numbers)} values do not fit a mesh of {self.face_count} faces and {len(self.points)} "
                f"points as {interpolation[:20]}, or are not finite; they are ignored",
            )
            return None
        if interpolation == "constant":
            return Values(rows[numbers], of_point=np.zeros(len(self.points), np.int64))
        if interpolation in ("vertex", "varying"):
            return Values(rows, of_point=numbers)
        if interpolation == "uniform":
            return Values(rows, of_corner=numbers[self._face_of_corner])
        if not indices:  # equal values of neighbouring corners make one vertex
            rows, numbers = np.unique(rows, axis=0, return_inverse=True)
        return Values(rows, of_corner=numbers.reshape(-1))


def _welded(keys: list[Longs]) -> tuple[Longs, Longs]:
    """One corner for each vertex, and the vertex of each corner: corners with equal keys are one vertex."""
    key = keys[0]
    for more in keys[1:]:
        _, key = np.unique(key, return_inverse=True)
        key = key.reshape(-1) * (int(more.max(initial=0)) + 1) + more
    _, first, vertex = np.unique(key, return_index=True, return_inverse=True)
    return first, vertex.reshape(-1)


def _array(values: Any, width: int = 0) -> Array:
    """An array of the library as one of numpy: (n,), or (n, width)."""
    rows = np.array(values if values is not None else [])
    if rows.dtype.kind not in "fiu":
        rows = np.empty(0)
    if not width:
        return rows.reshape(-1)
    if width == 1:
        return rows.reshape(-1, 1).astype(np.float64)
    if rows.ndim != 2 or rows.shape[1] < width:
        return np.empty((0, width))
    return rows[:, :width]


def _is_list(values: Any) -> bool:
    return hasattr(values, "__len__") and (not len(values) or hasattr(values[0], "__len__"))
