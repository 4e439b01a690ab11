"""PLY, text or binary -> triangles. Runs in the parsing child.

Our own, and not trimesh's: that one cannot read a binary file whose faces differ in length, and gives what a header
promises its memory before looking at the file.
"""

import warnings
from collections.abc import Collection
from dataclasses import dataclass, field
from struct import Struct
from typing import Any

import numpy as np
import numpy.typing as npt

from service.colorimetry import decode_srgb
from service.formats.errors import ParseError
from service.formats.read.polygons import Longs, triangulate
from service.formats.read.raw_mesh import RawMesh
from service.formats.types import Doubles, Floats

TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
    **{"float": "f4", "float32": "f4", "double": "f8", "float64": "f8"},
}
HEADER_BYTES = 1 << 20
CODES = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "f4": "f", "f8": "d"}
FACE_LISTS = ("vertex_indices", "vertex_index")
STRIPS = "tristrips"  # an element whose lists are strips of triangles, as Stanford's scans have them
RESTART = -1  # between two strips of one list
# As Blender, pbrt, MeshLab and others write them; the second set, tangents, the alpha and a face's smoothing group
# are our own: what others call alpha is seldom meant.
UVS = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))
UVS_1 = (("s1", "t1"),)
TANGENTS = (("tx", "ty", "tz", "tw"),)
ALPHA = "vertex_alpha"
GROUP = "smoothing_group"
COLORS = (("red", "green", "blue"), ("r", "g", "b"), ("diffuse_red", "diffuse_green", "diffuse_blue"))


Columns = dict[str, npt.NDArray[Any]]
Corners = npt.NDArray[np.signedinteger]


@dataclass
class Property:
    name: str
    dtype: str
    count: str | None = None  # the type of a list's length
    declared: str = ""  # the header's type: the text's numbers are read as another


@dataclass
class Element:
    name: str
    length: int
    properties: list[Property] = field(default_factory=list)

    def lists(self) -> list[Property]:
        return [p for p in self.properties if p.count is not None]

    def row(self, lengths: dict[str, int]) -> np.dtype[np.void]:
        """A row's layout, where each list has the given length."""
        fields: list[tuple[str, str] | tuple[str, str, tuple[int]]] = []
        for p in self.properties:
            if p.count is None:
                fields.append((p.name, p.dtype))
            else:
                fields += [(_count_of(p), p.count), (p.name, p.dtype, (lengths[p.name],))]
        return np.dtype(fields)


def _count_of(p: Property) -> str:
    return f"count of {p.name}"


def read_ply(data: memoryview) -> RawMesh:
    elements, encoding, start = _header(data)
    body = Body(data, start) if encoding != "ascii" else _text_as_binary(data, start, elements)
    vertex: Columns = {}
    declared: dict[str, str] = {}
    counts = np.empty(0, np.int64)
    corners: Corners = np.empty(0, np.int64)
    groups: Corners | None = None
    for element in elements:
        if element.name in ("face", STRIPS) and element.lists():
            more, values, beside = body.lists(element, _indices(element), (GROUP,))
            indices = _whole(values)
            if element.name == STRIPS:
                indices = _strips(more, indices)
                more = np.full(len(indices) // 3, 3)
            elif GROUP in beside:
                groups = np.repeat(_whole(beside[GROUP]), np.maximum(more - 2, 0))
            counts = np.concatenate([counts, more]) if len(counts) else more
            corners = np.concatenate([corners, indices]) if len(corners) else indices
        else:
            columns = body.columns(element)
            if element.name == "vertex":
                vertex, declared = columns, {p.name: p.declared for p in element.properties}
    if not {"x", "y", "z"} <= vertex.keys():
        raise ParseError("its header declares no vertices with x, y and z")
    vertices = _stack(vertex, ("x", "y", "z"))
    if not len(counts):
        raise ParseError("it has no faces")
    if counts.min() < 3:
        raise ParseError(f"face {int(counts.argmin())} (counted from 0) has {counts.min()} corners; it needs three")
    if corners.min() < 0 or corners.max() >= len(vertices):
        at = int(np.flatnonzero((corners < 0) | (corners >= len(vertices)))[0])
        face = int(np.searchsorted(np.cumsum(counts), at, "right"))
        raise ParseError(f"face {face} (counted from 0) names vertex {corners[at]}; there are {len(vertices)}")
    return RawMesh(
        vertices,
        corners.reshape(-1, 3) if (counts == 3).all() else corners[triangulate(vertices, corners, counts)],
        _named(vertex, (("nx", "ny", "nz"),)),
        _named(vertex, UVS),
        _named(vertex, UVS_1),
        _colors(vertex, declared),
        tangents=_named(vertex, TANGENTS),
        groups=groups if groups is not None and len(groups) == (counts - 2).sum() else None,
    )


def _indices(element: Element) -> Property:
    """The list of vertices of a face; where none has a usual name, the only list."""
    lists = element.lists()
    named = next((p for p in lists if p.name in FACE_LISTS), lists[0] if len(lists) == 1 else None)
    if named is None:
        raise ParseError(f"element {element.name} has several lists, and none is called vertex_indices")
    return named


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


def _stack(columns: Columns, names: tuple[str, ...]) -> Doubles:
    return np.stack([columns[name] for name in names], axis=1, dtype=np.float64)


def _named(columns: Columns, choices: tuple[tuple[str, ...], ...]) -> Floats | None:
    names = next((names for names in choices if columns.keys() >= set(names)), None)
    return None if names is None else np.stack([columns[name] for name in names], axis=1, dtype=np.float32)


def _colors(columns: Columns, declared: dict[str, str]) -> Floats | None:
    """Linear: whole numbers are sRGB, as in an image of 8 bits, whatever their type; floats are taken as they are."""
    names = next((names for names in COLORS if columns.keys() >= set(names)), None)
    if names is None:
        return None
    found = _stack(columns, names)
    kind = declared[names[0]]
    most = 255 if kind[0] == "f" or found.max(initial=0) <= 255 else np.iinfo(kind).max
    colors = found.astype(np.float32) if kind[0] == "f" else decode_srgb(found / most).astype(np.float32)
    return np.column_stack([colors, columns[ALPHA].astype(np.float32)]) if ALPHA in columns else colors


def _header(view: memoryview) -> tuple[list[Element], str, int]:
    """The elements in order, the byte order (`<`, `>`, or `ascii`), and where the data begin."""
    data = bytes(view[:HEADER_BYTES])
    if not data.startswith((b"ply\n", b"ply\r")):
        raise ParseError("not a PLY file: it does not begin with `ply`")
    end = data.find(b"end_header")
    newline = data.find(b"\n" if b"\n" in data[:end] else b"\r", end)
    if end < 0 or newline < 0:
        raise ParseError("the header is cut off: no `end_header`")
    elements: list[Element] = []
    encoding = ""
    for line in data[:end].decode("latin-1").splitlines()[1:]:
        match line.split():
            case ["format", "ascii", _]:
                encoding = "ascii"
            case ["format", "binary_little_endian", _]:
                encoding = "<"
            case ["format", "binary_big_endian", _]:
                encoding = ">"
            case ["element", name, length] if length.isascii() and length.isdigit() and len(length) < 16:
                elements.append(Element(name, int(length)))
            case ["property", "list", count, dtype, name] if elements and count in TYPES and dtype in TYPES:
                elements[-1].properties.append(Property(name, TYPES[dtype], TYPES[count], TYPES[dtype]))
            case ["property", dtype, name] if elements and dtype in TYPES:
                elements[-1].properties.append(Property(name, TYPES[dtype], declared=TYPES[dtype]))
            case [] | ["comment", *_] | ["obj_info", *_]:
                pass
            case _:
                raise ParseError(f"the header has a line that is not understood: {line[:80]!r}")
    if not encoding:
        raise ParseError("the header names no format")
    for element in elements:
        if len({p.name for p in element.properties}) != len(element.properties):
            raise ParseError(f"element {element.name} has two properties of one name")
    if encoding != "ascii":
        for p in (p for element in elements for p in element.properties):
            p.dtype, p.count = encoding + p.dtype, p.count and encoding + p.count
    return elements, encoding, newline + 1


class Body:
    """The data after the header, read element by element; returns no more than the file contains."""

    def __init__(self, data: bytes | memoryview, at: int) -> None:
        self.data, self.at = data, at

    def rows(self, element: Element, lengths: dict[str, int] | None = None) -> npt.NDArray[np.void]:
        dtype = element.row(lengths or {})
        if element.length and not dtype.itemsize:
            raise ParseError(f"element {element.name} has no properties")
        self._need(element.length * dtype.itemsize, element)
        if not element.length:
            return np.empty(0, dtype)
        rows = np.frombuffer(self.data, dtype, element.length, self.at)
        self.at += rows.nbytes
        return rows

    def columns(self, element: Element) -> Columns:
        """The numbers of each property that is no list."""
        singles = [p.name for p in element.properties if p.count is None]
        if element.lists():
            return self.lists(element, element.lists()[0], singles)[2]
        rows = self.rows(element)
        return {name: rows[name] for name in singles}

    def lists(
        self, element: Element, wanted: Property, beside: Collection[str] = ()
    ) -> tuple[Longs, npt.NDArray[Any], Columns]:
        """The lengths of the wanted list, all its values, one row after the other, and the numbers of the properties
        `beside` it, of those that the element has."""
        others = [p for p in element.properties if p.name in beside and p.count is None]
        if not element.length:
            return np.empty(0, np.int64), np.empty(0, np.int64), {p.name: np.empty(0, p.dtype) for p in others}
        start = self.at
        lengths = self._walk(element, wanted, [], 1)[1]
        self.at = start
        if element.length * element.row(lengths).itemsize <= len(self.data) - start:
            rows = self.rows(element, lengths)
            if all((rows[_count_of(p)] == lengths[p.name]).all() for p in element.lists()):
                values = rows[wanted.name]
                counts = np.full(len(rows), values.shape[1])
                return counts, values.reshape(-1), {p.name: rows[p.name] for p in others}
            self.at = start
        walked, lengths, values, columns = self._walk(element, wanted, others, element.length)
        return np.array(walked), values, columns

    def _walk(
        self, element: Element, wanted: Property, others: list[Property], rows: int
    ) -> tuple[list[int], dict[str, int], npt.NDArray[Any], Columns]:
        """Row by row, for lists that differ: the wanted list's lengths, all lengths of the last row, the values, and
        the numbers of the other properties."""
        counts, pieces, lengths = [], [], {}
        beside: dict[str, list[Any]] = {p.name: [] for p in others}
        counters = [p.count and Struct(p.count[0] + CODES[p.count[1:]]) for p in element.properties]
        sizes = [int(p.dtype[-1]) for p in element.properties]
        for _ in range(rows):
            for p, count, size in zip(element.properties, counters, sizes, strict=True):
                n = 1
                if count:
                    self._need(count.size, element)
                    n = self._length(count.unpack_from(self.data, self.at)[0], element)
                    self.at += count.size
                    lengths[p.name] = n
                self._need(n * size, element)
                if p is wanted:
                    counts.append(n)
                    pieces.append(self.data[self.at : self.at + n * size])
                elif count is None and p.name in beside:
                    beside[p.name].append(self.data[self.at : self.at + size])
                self.at += n * size
        columns = {p.name: np.frombuffer(b"".join(beside[p.name]), p.dtype) for p in others}
        return counts, lengths, np.frombuffer(b"".join(pieces), wanted.dtype), columns

    def _length(self, written: float, element: Element) -> int:
        if not written >= 0 or written != written // 1:
            raise ParseError(f"element {element.name} has a list of length {written}")
        return int(written)

    def _need(self, size: int, element: Element) -> None:
        if size > len(self.data) - self.at:
            raise ParseError(
                f"the file is cut off: {element.length} rows of element {element.name} are promised, "
                f"{len(self.data) - self.at} bytes are left"
            )


def _whole(values: npt.NDArray[Any]) -> Corners:
    if values.dtype.kind == "f" and not ((np.abs(values) < 2**53) & (values == np.floor(values))).all():
        raise ParseError("its faces have an index that is no whole number")
    return values.astype(np.int32 if np.can_cast(values.dtype, np.int32) else np.int64)


def _text_as_binary(data: memoryview, start: int, elements: list[Element]) -> Body:
    """The numbers of a text file as float64, for one reader of both: float64 represents any 32-bit index exactly."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # numpy warns where it stops short of the end
        try:
            numbers = np.fromstring(bytes(data[start:]), "<f8", sep=" ")
        except (ValueError, DeprecationWarning):
            raise ParseError("its data hold something that is not a number") from None
    for p in (p for element in elements for p in element.properties):
        p.dtype, p.count = "<f8", p.count and "<f8"
    return Body(numbers.tobytes(), 0)
