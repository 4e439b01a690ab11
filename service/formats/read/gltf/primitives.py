"""A primitive's triangles, whatever its mode, with the attributes of its vertices."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from service.formats.read.bad_elements import left_out
from service.formats.read.gltf import accessors, draco
from service.formats.read.gltf.document import Array, GltfDocument
from service.formats.read.gltf.json_view import JsonView
from service.formats.read.polygons import Longs
from service.formats.read.scenes.warnings import Warnings
from service.formats.types import Doubles, Floats, Indices

MODES = ("POINTS", "LINES", "LINE_LOOP", "LINE_STRIP", "TRIANGLES", "TRIANGLE_STRIP", "TRIANGLE_FAN")
TRIANGLES, STRIP, FAN = 4, 5, 6
UV_SETS = 2
MOST_SETS = 16  # of four joints each


@dataclass(frozen=True)
class Primitive:
    """Rows of its vertices (n, ...) and its triangles (m, 3). v of `uvs` points down, as in the file."""

    vertices: Array  # (n, 3) floating
    faces: Indices
    normals: Array | None = None
    uvs: tuple[Floats | None, ...] = (None,) * UV_SETS
    colors: Floats | None = None  # (n, 3 or 4)
    joints: tuple[Array, ...] = ()  # (n, 4) each
    weights: tuple[Floats, ...] = ()
    tangents: Array | None = None  # (n, 4)
    numbers: Longs | None = None  # the file's numbers of these vertices; None: all
    is_smooth: bool = False  # without normals: they are computed, as they were when our exporter wrote the file

    def detail(self) -> Iterator[tuple[str, Array]]:
        """The attributes of its vertices besides the position, by name."""
        sets = {f"TEXCOORD_{k}": rows for k, rows in enumerate(self.uvs)}
        named = {"NORMAL": self.normals, "TANGENT": self.tangents, "COLOR_0": self.colors, **sets}
        yield from ((name, rows) for name, rows in named.items() if rows is not None)

    def moved(self, world: Doubles) -> Primitive:
        """The primitive under a 4x4 matrix. Under a mirroring one the order of vertices is reversed, so that outward
        stays outward."""
        linear = world[:3, :3]
        mirrored = np.linalg.det(linear) < 0
        normals = self.normals
        if normals is not None:
            normals = normals @ (-cofactors(linear) if mirrored else cofactors(linear)).T
        tangents = None if self.tangents is None else turned(self.tangents, linear, mirrored)
        return replace(
            self,
            vertices=self.vertices @ linear.T + world[:3, 3],
            faces=self.faces[:, ::-1] if mirrored else self.faces,
            normals=normals,
            tangents=tangents,
        )

    def compact(self) -> Primitive:
        """The primitive without unused vertices, as files share one buffer among many primitives."""
        used = np.zeros(len(self.vertices), bool)
        used[self.faces.reshape(-1)] = True
        if used.all():
            return self
        number = np.cumsum(used, dtype=np.int32) - np.int32(1)

        def some(rows: Array | None) -> Array | None:
            return None if rows is None else rows[used]

        return replace(
            self,
            vertices=self.vertices[used],
            faces=number[self.faces],
            normals=some(self.normals),
            uvs=tuple(map(some, self.uvs)),
            colors=some(self.colors),
            tangents=some(self.tangents),
            joints=tuple(rows[used] for rows in self.joints),
            weights=tuple(rows[used] for rows in self.weights),
            numbers=np.flatnonzero(used) if self.numbers is None else self.numbers[used],
        )


def cofactors(linear: Doubles) -> Doubles:
    """(..., 3, 3): the map of normals, up to a factor whose sign is the determinant's."""
    columns = [np.cross(linear[..., k - 2], linear[..., k - 1]) for k in range(3)]
    return np.stack(columns, axis=-1)


def turned(tangents: Array, linear: Doubles, mirrored: bool | np.bool_) -> Array:
    """(n, 4): directions along the surface go as its points do. The bitangent, w cross(n, t), does, too: as outward
    stays outward, w changes its sign under a mirroring matrix."""
    along = tangents[:, :3].astype(np.float64) @ linear.T
    return np.concatenate([along, tangents[:, 3:] * (-1.0 if mirrored else 1.0)], axis=1)


def read_primitive(file: GltfDocument, place: JsonView, notes: Warnings) -> Primitive | None:
    """The primitive; None, with a warning, where it has no area: points and lines."""
    mode, attributes = place.whole("mode", TRIANGLES), place.need("attributes")
    if mode >= len(MODES):
        raise place.error("mode", f"must be from 0 to {len(MODES) - 1}, not {mode}")
    if mode < TRIANGLES:
        notes.leave_out(place.pointer, f"{MODES[mode]} have no area and are left out; only triangles are rendered")
        return None
    if "POSITION" not in attributes:
        notes.leave_out(place.pointer, "the primitive has no POSITION and is left out")
        return None
    used = [(attributes, "POSITION"), *([(place, "indices")] if "indices" in place else [])]
    if any(file.follow(owner, name, "accessors").value.get("count") == 0 for owner, name in used):
        notes.leave_out(place.pointer, "the primitive has no triangles and is left out")
        return None
    compressed = place.extension("KHR_draco_mesh_compression")
    packed, faces = draco.decode(file, compressed, attributes) if compressed else ({}, None)
    rows = _rows(file, attributes, packed, notes)
    vertices = _floating(rows["POSITION"])
    for name, row in rows.items():
        if len(row) != len(vertices):
            raise attributes.error(name, f"has {len(row)} items for {len(vertices)} vertices")
    if faces is not None:
        mode, indices = TRIANGLES, faces.reshape(-1)
    elif "indices" in place:
        indices = accessors.indices(file, place).astype(np.int64)
    else:
        indices = np.arange(len(vertices))
    triangles = _triangles(mode, indices, len(vertices), place, notes).astype(np.int32)
    if not len(triangles):
        notes.leave_out(place.pointer, "the primitive has no triangles and is left out")
        return None
    is_smooth = exporter_notes(place).get("normals") == "computed" and "TANGENT" not in rows and "NORMAL" in rows
    if is_smooth:
        del rows["NORMAL"]
    sets = sum(f"JOINTS_{k}" in rows and f"WEIGHTS_{k}" in rows for k in range(len(rows)))
    return Primitive(
        vertices,
        triangles,
        _floating(rows["NORMAL"]) if "NORMAL" in rows else None,
        tuple(_texcoord(rows.get(f"TEXCOORD_{k}")) for k in range(UV_SETS)),
        _unit(rows["COLOR_0"]) if "COLOR_0" in rows else None,
        tuple(rows[f"JOINTS_{k}"] for k in range(sets)),
        tuple(_unit(rows[f"WEIGHTS_{k}"]) for k in range(sets)),
        _unit(rows["TANGENT"]) if "TANGENT" in rows and "NORMAL" in rows else None,  # else ignored, says the standard
        is_smooth=is_smooth,
    ).compact()


def exporter_notes(place: JsonView) -> dict[str, Any]:
    """Our exporter's notes in an object's `extras`; empty where something else stands there."""
    extras = place.value.get("extras")
    noted = extras.get("sunbox") if isinstance(extras, dict) else None
    return noted if isinstance(noted, dict) else {}


TYPES = {"POSITION": ("VEC3",), "NORMAL": ("VEC3",), "TANGENT": ("VEC4",), "TEXCOORD": ("VEC2",),
         "COLOR": ("VEC3", "VEC4"), "JOINTS": ("VEC4",), "WEIGHTS": ("VEC4",)}  # fmt: skip


def _rows(file: GltfDocument, attributes: JsonView, packed: dict[str, Array], notes: Warnings) -> dict[str, Array]:
    """The attributes that are used; those in `packed` are taken from there."""
    found = {}
    for name in attributes.value:
        kind, _, number = name.partition("_")
        if kind not in TYPES or (number and not (number.isascii() and number.isdigit())):
            continue  # an attribute for a program's own use
        if number and int(number[:4]) >= {"TEXCOORD": UV_SETS, "COLOR": 1}.get(kind, MOST_SETS):
            notes.add(
                attributes.at(name),
                "this set is not supported; two sets of texture coordinates and one of colours are",
            )
            continue
        if name not in packed:
            found[name] = accessors.read(file, attributes, name, *TYPES[kind])
        elif packed[name].shape[1] in [accessors.WIDTHS[one] for one in TYPES[kind]]:
            found[name] = packed[name]
        else:
            raise attributes.error(name, f"has {packed[name].shape[1]} numbers for each vertex in the Draco data")
    return found


def _texcoord(rows: Array | None) -> Floats | None:
    """Texture coordinates as they are: with KHR_mesh_quantization they may be integers that are no fractions."""
    return None if rows is None else rows.astype(np.float32, copy=False)


def _floating(rows: Array) -> Array:
    return rows if rows.dtype.kind == "f" else rows.astype(np.float32)


def _unit(rows: Array) -> Floats:
    """Directions as float32; integers are normalised, as the specification demands."""
    return accessors.normalised(rows).astype(np.float32, copy=False)


def _triangles(mode: int, indices: Longs, vertices: int, place: JsonView, notes: Warnings) -> Longs:
    """(m, 3) the triangles whose vertices exist."""
    k = np.arange(max(len(indices) - 2, 0))
    if mode == STRIP:
        found = indices[np.stack([k, k + 1 + k % 2, k + 2 - k % 2], axis=1)]
    elif mode == FAN:
        found = indices[np.stack([k + 1, k + 2, 0 * k], axis=1)]
    else:
        if len(indices) % 3:
            notes.add(
                place.pointer, f"{len(indices)} indices do not make whole triangles; the last ones are left out"
            )
        found = indices[: len(indices) // 3 * 3].reshape(-1, 3)
    beyond = (found < 0) | (found >= vertices)
    if not beyond.any():
        return found
    lost = beyond.any(axis=1)
    reason = f"refer to vertex {found[beyond][0]}; there are {vertices}"
    notes.leave_out(place.at("indices"), left_out(int(lost.sum()), "triangle", reason))
    return found[~lost]
