"""PLY, text or binary -> triangles. Runs in the parsing child.

Our own, and not trimesh's: that one cannot read a binary file whose faces differ in length, and gives what a header
promises its memory before looking at the file.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from service.colorimetry import decode_srgb
from service.formats.errors import ParseError
from service.formats.read.bad_elements import (
    NO_INDEX,
    Mask,
    are_places,
    counted,
    finite_rows,
    left_out,
    refuse_nothing,
    unused_places,
    whole_faces,
)
from service.formats.read.corners import distinct, numbered
from service.formats.read.ply_body import Body, Column, Columns, Table
from service.formats.read.ply_header import AGAIN, Element, read_header
from service.formats.read.polygons import Longs, triangulate
from service.formats.read.raw_mesh import Numbers, RawMesh
from service.formats.types import Doubles, Floats

FACE_LISTS = ("vertex_indices", "vertex_index")
STRIPS = "tristrips"  # an element whose lists are strips of triangles, as Stanford's scans have them
RESTART = -1  # between two strips of one list
PLACE = ("x", "y", "z")
NORMAL = ("nx", "ny", "nz")
# As Blender, pbrt, MeshLab, Assimp, Houdini and others write them; the second set, tangents, the alpha and a face's
# smoothing group are our own: what others call alpha is seldom meant.
UVS = (
    ("s", "t"), ("u", "v"), ("texture_u", "texture_v"), ("texture_s", "texture_t"), ("tex_u", "tex_v"),
    ("texcoord_u", "texcoord_v"), ("texcoord_s", "texcoord_t"), ("texcoord_x", "texcoord_y"), ("tu", "tv"),
    ("uv_u", "uv_v"), ("u0", "v0"), ("s0", "t0"), ("texcoord0", "texcoord1"), ("uv0", "uv1"), ("uv1", "uv2"),
    ("u1", "v1"), ("texture_x", "texture_y"), ("tx", "ty"),
)  # fmt: skip
UVS_1 = (("s1", "t1"),)
TANGENTS = (("tx", "ty", "tz", "tw"),)
ALPHA = "vertex_alpha"
GROUP = "smoothing_group"
COLORS = (("red", "green", "blue"), ("r", "g", "b"), ("diffuse_red", "diffuse_green", "diffuse_blue"))
CORNER_UVS = (
    "texcoord",
    "texcoords",
    "texture_coordinates",
    "tex_coords",
    "uv",
    "uvs",
    "st",
)  # lists of two a corner
TEXTURE = "texnumber"  # of a face, among the files that comments name

Corners = npt.NDArray[np.signedinteger]


@dataclass
class Faces:
    """Polygons of all elements that have any, and what they or their corners carry."""

    counts: Longs
    corners: Corners
    colors: Numbers | None = None  # (m, 3), linear
    groups: Corners | None = None  # (m,)
    uvs: Numbers | None = None  # (c, 2), of corners
    textures: Corners | None = None  # (m,)

    def some(self, whole: Mask) -> Faces:
        remaining = np.repeat(whole, self.counts)
        return Faces(
            self.counts[whole], self.corners[remaining], _some(self.colors, whole), _some(self.groups, whole),
            _some(self.uvs, remaining), _some(self.textures, whole),
        )  # fmt: skip


@dataclass
class PlyMesh:
    """The mesh of a PLY file, the texture of each triangle, and the files that are these textures."""

    mesh: RawMesh
    of_triangle: npt.NDArray[np.int32]  # numbers in `textures`, -1 for none
    textures: list[str] = field(default_factory=list)


def read_ply(data: memoryview) -> RawMesh:
    """The mesh of a PLY file that came alone, without the images that it may name. Raises ParseError."""
    found = read_textured_ply(data)
    if found.textures:
        named = ", ".join(repr(name[:60]) for name in found.textures[:3])
        found.mesh.warnings.append(
            f"its texture {named} is not shown: a PLY file is a mesh alone; a zip with its images is a scene"
        )
    return found.mesh


def read_textured_ply(data: memoryview, path: str = "") -> PlyMesh:
    """The mesh of the file at this path. Raises ParseError."""
    header = read_header(data)
    body, told = Body(data, header), header.warnings
    vertex, declared = Table(), dict[str, str]()
    found: list[Faces] = []
    for element in header.elements:
        if element.name in ("face", STRIPS) and element.lists():
            found.append(_faces(element, body, told))
        elif element.name == "vertex" and not vertex.columns:
            vertex, declared = body.table(element, element.declared()), element.declared()
            _tell_unread(element, _known(vertex.columns), told)
        else:
            body.table(element, ())
            if element.length:
                told.append(f"element {element.name} is not read; it has {element.length} rows")
    if rest := body.rest():
        told.append(f"{rest} after the data that the header promises are not read")
    if not set(PLACE) <= vertex.columns.keys():
        raise ParseError("its header declares no vertices with x, y and z")
    vertices = _stack(vertex.columns, PLACE)
    faces = _together(found)
    if not len(faces.counts):
        raise ParseError("it has no faces")
    used = np.zeros(len(vertices), bool)
    if not are_places(vertices).all():
        used[faces.corners[(faces.corners >= 0) & (faces.corners < len(vertices))]] = True
    whole, reason = whole_faces(vertices, faces.corners, faces.counts, counted("face"))
    if not whole.all():
        refuse_nothing(whole, reason)
        told.append(left_out(int((~whole).sum()), "face", reason))
        faces = faces.some(whole)
    vertices = np.asarray(unused_places(vertices, counted("vertex"), used, told), np.float64)
    mesh = _mesh(vertices, faces, vertex.columns, declared, told)
    textures = np.zeros(len(faces.counts), np.int32) if faces.textures is None else faces.textures.astype(np.int32)
    textures[(textures < 0) | (textures >= len(header.textures))] = -1
    return PlyMesh(mesh, np.repeat(textures, faces.counts - 2), header.textures_of(path))


def _mesh(vertices: Doubles, faces: Faces, columns: Columns, declared: dict[str, str], told: list[str]) -> RawMesh:
    """The triangles; a vertex is there once for each set of what its corners carry."""
    rows: dict[str, Numbers | None] = {
        "normals": _named(columns, (NORMAL,)),
        "uvs": _named(columns, _uv_names(columns)),
        "uvs_1": _named(columns, UVS_1),
        "colors": _colors(columns, declared),
        "tangents": _named(columns, TANGENTS),
    }
    own: dict[str, tuple[Longs, int, Numbers]] = {}
    if faces.colors is not None and rows["colors"] is not None:
        told.append("the colours of its faces are not shown: its vertices have colours of their own")
    elif faces.colors is not None:
        key, count = numbered(faces.colors)
        own["colors"] = np.repeat(key, faces.counts), count, np.repeat(faces.colors, faces.counts, axis=0)
    if faces.uvs is not None:
        if rows["uvs"] is not None:
            told.append(
                "the texture coordinates of its vertices are not used: its faces have coordinates of their own"
            )
        name = counted("the texture coordinate of corner")
        uvs = finite_rows(faces.uvs, 0.0, name, "0 0 is used instead", told)
        own["uvs"] = *numbered(uvs), uvs
    corner, counts = faces.corners, faces.counts
    triangles = None if (counts == 3).all() else triangulate(vertices, corner, counts)
    if own:
        first, joined = distinct(corner, len(vertices), [(key, count) for key, count, _ in own.values()])
        vertices = vertices[corner[first]]
        rows = {name: None if given is None else given[corner[first]] for name, given in rows.items()}
        rows |= {name: values[first] for name, (_, _, values) in own.items()}
        corner = joined
    groups = None if faces.groups is None else np.repeat(faces.groups, counts - 2)
    return RawMesh(
        vertices,
        corner.reshape(-1, 3) if triangles is None else corner[triangles],
        rows["normals"],
        rows["uvs"],
        rows["uvs_1"],
        rows["colors"],
        told,
        tangents=rows["tangents"],
        groups=groups,
    )


def _faces(element: Element, body: Body, told: list[str]) -> Faces:
    index = _index_list(element)
    uvs = next((p.name for p in element.lists() if p.name in CORNER_UVS and p.name != index), "")
    declared = element.declared()
    colors = next((names for names in COLORS if declared.keys() >= set(names)), ())
    table = body.table(element, {index, uvs, GROUP, TEXTURE, *colors})
    _tell_unread(element, {index, uvs, GROUP, TEXTURE, *colors}, told)
    counts, values = table.lists[index]
    corners = _whole(values)
    if element.name == STRIPS:
        corners = _strips(counts, corners)
        return Faces(np.full(len(corners) // 3, 3), corners)
    groups, textures = table.columns.get(GROUP), table.columns.get(TEXTURE)
    return Faces(
        counts,
        corners,
        _colors(table.columns, declared),
        None if groups is None else _whole(groups),
        None if not uvs else _corner_uvs(counts, *table.lists[uvs], told),
        None if textures is None else _whole(textures),
    )


def _corner_uvs(counts: Longs, lengths: Longs, values: Column, told: list[str]) -> Numbers:
    """(c, 2) texture coordinates of corners; 0 where a face has not two numbers for each."""
    fits = lengths == 2 * counts
    found = np.zeros((int(counts.sum()), 2), np.float32)
    if not fits.all():
        first = int(np.flatnonzero(~fits)[0])
        count = int((~fits).sum())
        which = "1 face has" if count == 1 else f"{count} faces have"
        told.append(
            f"{which} no texture coordinates; 0 0 is used instead; the first: face {first} "
            f"(counted from 0) has {lengths[first]} numbers for {counts[first]} corners"
        )
    found[np.repeat(fits, counts)] = values[np.repeat(fits, lengths)].reshape(-1, 2)
    return found


def _together(found: list[Faces]) -> Faces:
    """The faces of all elements; where some have no colour or no texture coordinates, white and 0."""
    if len(found) == 1:
        return found[0]
    if not found:
        return Faces(np.empty(0, np.int64), np.empty(0, np.int64))

    def joined(name: str, width: int, fill: float, of_corners: bool = False) -> Numbers | None:
        given = [getattr(each, name) for each in found]
        if all(rows is None for rows in given):
            return None
        sizes = [len(each.corners if of_corners else each.counts) for each in found]
        return np.concatenate([
            np.full((size, width), fill, np.float32) if rows is None else rows
            for rows, size in zip(given, sizes, strict=True)
        ])  # fmt: skip

    textures = [np.zeros(len(each.counts), np.int64) if each.textures is None else each.textures for each in found]
    return Faces(
        np.concatenate([each.counts for each in found]),
        np.concatenate([each.corners for each in found]),
        joined("colors", 3, 1.0),
        uvs=joined("uvs", 2, 0.0, of_corners=True),
        textures=np.concatenate(textures),
    )


def _index_list(element: Element) -> str:
    """The list of vertices of a face; where none has a usual name, the only list besides texture coordinates."""
    lists = [p.name for p in element.lists() if not p.name.endswith(AGAIN)]
    named = [name for name in lists if name in FACE_LISTS]
    if not named:
        named = [name for name in lists if name not in CORNER_UVS] or lists
        if len(named) > 1:
            raise ParseError(f"element {element.name} has several lists, and none is called vertex_indices")
    return named[0]


def _strips(counts: Longs, values: Corners) -> Corners:
    """The corners of the triangles of strips, every other one turned; a list may hold several, with RESTART between
    them."""
    apart = np.insert(values, np.cumsum(counts), RESTART)
    starts = np.maximum.accumulate(np.where(apart == RESTART, np.arange(1, len(apart) + 1), 0))
    at = np.arange(max(len(apart) - 2, 0))
    a, b, c = apart[at], apart[at + 1], apart[at + 2]
    # Strips turn round corners by repeating a vertex, which makes triangles without area.
    real = (a != RESTART) & (b != RESTART) & (c != RESTART) & (a != b) & (b != c) & (c != a)
    turned = (at - starts[at]) % 2 == 1
    triangles: Corners = np.stack([np.where(turned, b, a), np.where(turned, a, b), c], axis=1)[real]
    return triangles.reshape(-1)


def _uv_names(columns: Columns) -> tuple[tuple[str, ...], ...]:
    """`tx` and `ty` are texture coordinates unless `tz` makes them a tangent."""
    return UVS[:-1] if "tz" in columns else UVS


def _known(columns: Columns) -> set[str]:
    """The properties of vertices that are read."""
    kinds = ((PLACE,), (NORMAL,), _uv_names(columns), UVS_1, COLORS, TANGENTS, ((ALPHA,),))
    return {name for choices in kinds for name in _first(columns, choices)}


def _tell_unread(element: Element, known: set[str], told: list[str]) -> None:
    unread = [p.name for p in element.properties if p.name not in known and not p.name.endswith(AGAIN)]
    if unread and element.length:
        more = f" and {len(unread) - 10} more" if len(unread) > 10 else ""
        told.append(f"of element {element.name} these properties are not read: {', '.join(unread[:10])}{more}")


def _some(rows: Column | None, mask: Mask) -> Column | None:
    return None if rows is None else rows[mask]


def _stack(columns: Columns, names: tuple[str, ...]) -> Doubles:
    return np.stack([columns[name] for name in names], axis=1, dtype=np.float64)


def _first(columns: Columns, choices: tuple[tuple[str, ...], ...]) -> tuple[str, ...]:
    return next((names for names in choices if columns.keys() >= set(names)), ())


def _named(columns: Columns, choices: tuple[tuple[str, ...], ...]) -> Floats | None:
    names = _first(columns, choices)
    return np.stack([columns[name] for name in names], axis=1, dtype=np.float32) if names else None


def _colors(columns: Columns, declared: dict[str, str]) -> Floats | None:
    """Linear: whole numbers are sRGB, as in an image of 8 bits, whatever their type; floats are taken as they are."""
    names = _first(columns, COLORS)
    if not names:
        return None
    found = _stack(columns, names)
    kind = declared[names[0]]
    most = 255 if kind[0] == "f" or np.nanmax(found, initial=0) <= 255 else np.iinfo(kind).max
    colors = found.astype(np.float32) if kind[0] == "f" else decode_srgb(found / most).astype(np.float32)
    return np.column_stack([colors, columns[ALPHA].astype(np.float32)]) if ALPHA in columns else colors


def _whole(values: Column) -> Corners:
    """Indices; NO_INDEX for numbers that are none."""
    if values.dtype.kind == "f":
        with np.errstate(invalid="ignore"):
            good = (np.abs(values) < 2**53) & (values == np.floor(values))
        values = np.where(good, values, NO_INDEX)
    return values.astype(np.int32 if np.can_cast(values.dtype, np.int32) else np.int64)
