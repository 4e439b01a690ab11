"""The header of a PLY file: its elements, and what lies where."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, field
from posixpath import basename, splitext

import numpy as np

from service.formats.errors import ParseError

TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
    **{"int64": "i8", "uint64": "u8"},  # which are none of the format's own, and are written all the same
    **{"float": "f4", "float32": "f4", "double": "f8", "float64": "f8"},
}
HEADER_BYTES = 1 << 20
ENCODINGS = {"ascii": "ascii", "binary_little_endian": "<", "binary_big_endian": ">"}
FIRST_LINE = re.compile(rb"(?:\xef\xbb\xbf)?ply[ \t]*+(\r\n|\n|\r)")
LAYOUT = ("format", "element", "property")  # keywords of lines without which the data can't be found
THIS = "<this>"
AGAIN = " (again)"  # after the name of a property that has one's name


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

    def declared(self) -> dict[str, str]:
        """The types of its numbers by name."""
        return {p.name: p.declared for p in self.properties if p.count is None}

    def row(self, lengths: dict[str, int]) -> np.dtype[np.void]:
        """A row's layout, where each list has the given length."""
        fields: list[tuple[str, str] | tuple[str, str, tuple[int]]] = []
        for p in self.properties:
            if p.count is None:
                fields.append((p.name, p.dtype))
            else:
                fields += [(count_of(p), p.count), (p.name, p.dtype, (lengths[p.name],))]
        return np.dtype(fields)


@dataclass
class Header:
    elements: list[Element] = field(default_factory=list)
    encoding: str = ""  # the byte order (`<`, `>`), or `ascii`
    start: int = 0  # of the data
    textures: list[str] = field(default_factory=list)  # files that comments name
    warnings: list[str] = field(default_factory=list)

    def textures_of(self, path: str) -> list[str]:
        """The textures of a file at this path, for whose name MeshLab writes THIS."""
        return [name.replace(THIS, splitext(basename(path))[0]) for name in self.textures]


def count_of(p: Property) -> str:
    return f"count of {p.name}"


def read_header(view: memoryview) -> Header:
    """The header; names are in lower case. Raises ParseError."""
    data = bytes(view[:HEADER_BYTES])
    first = FIRST_LINE.match(data)
    if first is None:
        raise ParseError("not a PLY file: it does not begin with `ply`")
    end_of_line = b"\r" if first[1] == b"\r" else b"\n"
    header = Header(start=first.end())
    while (end := data.find(end_of_line, header.start)) >= 0:
        line, header.start = data[header.start : end].decode("utf-8", "replace").strip(), end + 1
        if line == "end_header":
            break
        _read_line(header, line)
    else:
        raise ParseError("the header is cut off: no `end_header`")
    if not header.encoding:
        raise ParseError("the header names no format")
    for element in header.elements:
        _tell_apart(element, header.warnings)
    if header.encoding != "ascii":
        for p in (p for element in header.elements for p in element.properties):
            p.dtype, p.count = header.encoding + p.dtype, p.count and header.encoding + p.count
    return header


def _read_line(header: Header, line: str) -> None:
    elements = header.elements
    match line.split():
        case ["format", kind, *_] if kind in ENCODINGS:
            header.encoding = ENCODINGS[kind]
        case ["element", name, length] if length.isascii() and length.isdigit() and len(length) < 16:
            elements.append(Element(name.lower(), int(length)))
        case ["property", "list", count, dtype, name] if elements and count in TYPES and dtype in TYPES:
            elements[-1].properties.append(Property(name.lower(), TYPES[dtype], TYPES[count], TYPES[dtype]))
        case ["property", dtype, name] if elements and dtype in TYPES:
            elements[-1].properties.append(Property(name.lower(), TYPES[dtype], declared=TYPES[dtype]))
        case ["comment", keyword, _, *_] if keyword.lower() == "texturefile":
            header.textures.append(line.split(None, 2)[2])
        case [] | ["comment", *_] | ["obj_info", *_]:
            pass
        case [keyword, *_] if keyword in LAYOUT:
            raise ParseError(f"the header has a line that is not understood: {line[:80]!r}")
        case _:
            header.warnings.append(f"the header has a line that is not understood and passed over: {line[:80]!r}")


def _tell_apart(element: Element, warnings: list[str]) -> None:
    """Give each property a name of its own; the first keeps it, and is the one that is read."""
    seen: Counter[str] = Counter()
    for p in element.properties:
        seen[p.name] += 1
        if seen[p.name] == 2:
            warnings.append(f"element {element.name} has several properties named {p.name!r}; the first is read")
        p.name += AGAIN * (seen[p.name] - 1)
