"""The document's meshes as primitives: their attributes without the material."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from service.document.shape import MeshShape
from service.exports.gltf.builder import Builder, Tree
from service.exports.gltf.tessellated import Tessellated
from service.exports.losses import Losses
from service.exports.writing import Files, Limits
from service.formats import MeshData
from service.formats.read.raw_mesh import ROUNDING
from service.formats.types import Floats
from service.pack.geometry.meshes import PlacedMesh, place
from service.pack.geometry.vertex_normals import corner_normals, encode, split
from service.problems import AssetError, FieldError, InvalidDocument

COMPUTED = {"extras": {"sunbox": {"normals": "computed"}}}  # our importer computes them again, to the bit
CHECKED = 200_000  # vertices up to which it is tried whether rounding them changes the picture
UNIT = 5e-4  # by which the length of a written direction may differ from 1


@dataclass(frozen=True)
class Part:
    """A primitive without its material; `fades`: its colours have an alpha."""

    primitive: Tree
    uv_sets: int = 1
    fades: bool = False
    is_rounded: bool = False  # its texture coordinates are
    extent: float = 1.0  # m, the longest side of its box, in its own space


@dataclass
class Meshes:
    """Parts by what they are made of, each written once. `triangles` counts them."""

    builder: Builder
    files: Files
    limits: Limits
    losses: Losses
    triangles: int = 0
    _parts: dict[tuple[Any, ...], Part] = field(default_factory=dict)
    _files: dict[str, MeshData] = field(default_factory=dict)

    def of_mesh(self, shape: MeshShape, number: int) -> Part:
        """Raises InvalidDocument."""
        source = ("written", number) if shape.asset is None else (shape.asset,)
        key = (*source, shape.smooth)
        if key not in self._parts:
            data = self._data(shape, number)
            self._count(len(data.faces), number)
            smooth = data.smoothing if shape.smooth is None else shape.smooth
            self._parts[key] = self._mesh(data, smooth, source, f"/shapes/{number}")
        self._check_rounding(shape, self._data(shape, number), f"/shapes/{number}")
        return self._parts[key]

    def of_solid(self, solid: Tessellated, number: int) -> Part:
        """Raises InvalidDocument."""
        if solid.key not in self._parts:
            self._count(len(solid.faces), number)
            attributes = {
                "POSITION": self.builder.vertices(solid.vertices, bounded=True),
                "TEXCOORD_0": self.builder.vertices(_flipped(solid.uvs.astype(np.float32))),
            }
            if solid.normals is not None:
                attributes["NORMAL"] = self.builder.vertices(solid.normals)
            indices = self.builder.indices(solid.faces, len(solid.vertices))
            self._parts[solid.key] = Part({"attributes": attributes, "indices": indices})
        return self._parts[solid.key]

    def _count(self, triangles: int, number: int) -> None:
        self.triangles += triangles
        most = self.limits.max_triangles
        if self.triangles > most:
            detail = f"brings the file to {self.triangles} triangles; {most} are allowed (SUNBOX_MAX_TRIANGLES)"
            raise InvalidDocument([FieldError(f"/shapes/{number}", detail)])

    def _data(self, shape: MeshShape, number: int) -> MeshData:
        if shape.asset is None:
            assert shape.vertices is not None and shape.faces is not None
            return MeshData(shape.vertices, shape.faces, shape.normals, shape.uvs, None, shape.colors)
        try:
            if shape.asset not in self._files:
                self._files[shape.asset] = self.files.mesh(shape.asset)
            return self._files[shape.asset]
        except AssetError as error:
            raise InvalidDocument([FieldError(f"/shapes/{number}/asset", error.detail)]) from None

    def _mesh(self, data: MeshData, smooth: np.ndarray | bool, source: tuple[Any, ...], pointer: str) -> Part:
        vertices, faces, normals = data.vertices, data.faces, data.normals
        more: Tree = {}
        which: np.ndarray | slice = slice(None)
        if not np.any(smooth):
            normals = None
        elif normals is None and isinstance(smooth, np.ndarray) and np.any(smooth):
            which, group, faces = split(faces, smooth)
            vertices = vertices[which]
            normals = _spread(corner_normals(vertices, faces, group), faces, len(vertices))
            source = (*source, "grouped")
            self.losses.add(pointer, "the normals of its smoothing groups are rounded to single precision")
        elif normals is None:
            normals, more = _spread(corner_normals(vertices, faces), faces, len(vertices)), COMPUTED
        normals = None if normals is None else _unit(normals)
        write = self.builder.vertices
        attributes = {"POSITION": write(vertices, (*source, "POSITION"), bounded=True)}
        if normals is not None:
            attributes["NORMAL"] = write(normals, (*source, "NORMAL"))
            if data.tangents is not None:
                tangents = self._tangents(data.tangents[which], normals, pointer)
                attributes["TANGENT"] = write(tangents, (*source, "TANGENT"))
        first = data.uvs_1 if data.uvs is None else data.uvs  # glTF has no second set without a first one
        charts = [rows for rows in (first, data.uvs_1) if rows is not None]
        is_rounded = False
        for k, rows in enumerate(charts):
            flipped = _flipped(rows[which])
            is_rounded |= bool((_flipped(flipped) != rows[which]).any())
            attributes[f"TEXCOORD_{k}"] = write(flipped, (*source, f"TEXCOORD_{k}"))
        fades = False
        if data.colors is not None and (data.colors != 1).any():
            fades = data.colors.shape[1] == 4 and bool((data.colors[:, 3] != 1).any())
            colors = data.colors if fades else data.colors[:, :3]
            attributes["COLOR_0"] = write(colors[which], (*source, "COLOR_0"))
        indices = self.builder.indices(faces, len(vertices), (*source, "indices"))
        low, high = data.bounds
        made = {"attributes": attributes, "indices": indices, **more}
        return Part(made, len(charts), fades, is_rounded, float((high - low).max()))

    def _check_rounding(self, shape: MeshShape, data: MeshData, pointer: str) -> None:
        """Tell of positions and normals that single precision rounds, where that changes what is rendered."""
        smooth = data.smoothing if shape.smooth is None else shape.smooth
        given = data.normals if np.any(smooth) else None
        normals = None if given is None else _unit(given)
        rounded = data.vertices.astype(np.float32).astype(np.float64)
        is_same = normals is None or given is None or np.array_equal(normals, given)
        if is_same and np.array_equal(rounded, data.vertices):
            return
        matrix = None if shape.transform is None else shape.transform.matrix4()
        if len(rounded) <= CHECKED and not isinstance(smooth, np.ndarray):
            exact = place(data.vertices, data.faces, given, smooth, matrix, False, (0, 0))
            near = place(rounded, data.faces, normals, smooth, matrix, False, (0, 0))
            if _same(exact, near):
                return
        self.losses.add(pointer, "its positions and normals are rounded to single precision")

    def _tangents(self, tangents: Floats, normals: Floats, pointer: str) -> Floats:
        """Tangents of length 1 with a sign, as the specification demands."""
        length = np.linalg.norm(tangents[:, :3].astype(np.float64), axis=1)
        odd = np.abs(length - 1) > UNIT
        signs = np.where(tangents[:, 3] < 0, np.float32(-1), np.float32(1))
        written = np.column_stack([tangents[:, :3], signs]).astype(np.float32)
        if odd.any():
            n = normals[odd].astype(np.float64)
            across = np.cross(n, np.eye(3)[np.abs(n).argmin(axis=1)])
            rows = np.where(length[odd, None] > 0, tangents[odd, :3], across).astype(np.float64)
            written[odd, :3] = rows / np.linalg.norm(rows, axis=1, keepdims=True)
            if (length[odd] == 0).any():
                self.losses.add(pointer, "vertices without a tangent get one across their normal")
        return written


def _same(a: PlacedMesh, b: PlacedMesh) -> bool:
    """True if two meshes render the same where the scene's origin is 0, as in most."""
    if not np.array_equal(a.vertices.astype(np.float32), b.vertices.astype(np.float32)):
        return False
    if a.normals is None or b.normals is None:
        return True
    return np.array_equal(encode(a.normals)[a.normal_faces], encode(b.normals)[b.normal_faces])


def _spread(found: tuple[np.ndarray, np.ndarray], faces: np.ndarray, count: int) -> Floats:
    """Normals of corners as those of vertices."""
    rows, places = found
    normals = np.zeros((count, 3))
    normals[faces] = rows[places]
    return normals.astype(np.float32)


def _unit(normals: np.ndarray) -> Floats:
    """The normals at length 1, as the specification demands; +Y in place of those without a length."""
    length = np.linalg.norm(normals.astype(np.float64), axis=1, keepdims=True)
    unit = np.where(np.abs(length - 1) < ROUNDING, normals, normals / np.where(length > 0, length, 1))
    return np.where(length > 0, unit, (0.0, 1.0, 0.0)).astype(np.float32)


def _flipped(uvs: np.ndarray) -> Floats:
    """Coordinates with v counted from the other end, as the importer has it."""
    return np.column_stack([uvs[:, 0], 1 - uvs[:, 1]]).astype(np.float32)
