"""STL, binary and text -> triangles. Runs in the parsing child."""

import re
import warnings
from itertools import chain

import numpy as np

from service.formats.errors import ParseError
from service.formats.formats import text
from service.formats.read.raw_mesh import Numbers, RawMesh
from service.formats.types import AssetLimits

HEADER_BYTES = 84  # 80 of anything, and the number of facets
FACET = np.dtype([("normal", "<f4", 3), ("vertices", "<f4", (3, 3)), ("attributes", "<u2")])
VERTEX = rb"vertex\s++(\S++\s++\S++\s++\S++)\s++"
NORMAL = rb"[^v]{0,200}?"  # what stands before the first vertex; bounded, or a file of nothing else takes hours
TEXT_FACET = re.compile(
    rb"\bfacet\b" + NORMAL + rb"\bouter\s++loop\s++" + 3 * VERTEX + rb"end ?loop\b", re.IGNORECASE
)
TAIL = 65536  # bytes in which the last line of a text is looked for


def read_stl(view: memoryview, limits: AssetLimits) -> RawMesh:
    """The facets of a file, each with vertices of its own; their normals are not read. Raises ParseError."""
    promised = HEADER_BYTES + FACET.itemsize * int.from_bytes(view[80:HEADER_BYTES], "little")
    if len(view) == promised:
        vertices: Numbers = np.frombuffer(view, FACET, offset=HEADER_BYTES)["vertices"].reshape(-1, 3)
    else:
        vertices = _read_text(text(bytes(view)), promised)
    faces = np.arange(len(vertices)).reshape(-1, 3)
    facets = np.zeros(len(faces), np.int32)  # the file has a normal for each facet, and none for vertices
    return RawMesh(vertices, faces, groups=facets)


def _read_text(data: bytes, promised: int) -> Numbers:
    """Three rows for each facet of all solids."""
    if not re.match(rb"\s*+solid\b", data, re.IGNORECASE):
        raise ParseError(f"not an STL file: {len(data)} bytes; its header promises {promised}, and it is no text")
    data = data.replace(b"\r", b"\n")
    if not re.search(rb"^[^\S\n]*+endsolid\b[^\n]*\s*\Z", data[-TAIL:], re.IGNORECASE | re.MULTILINE):
        raise ParseError("the file is cut off: it does not end with `endsolid`")
    begun = len(re.findall(rb"^[^\S\n]*+facet\b", data, re.IGNORECASE | re.MULTILINE))
    read = TEXT_FACET.findall(data)
    if len(read) != begun:
        raise ParseError(f"{begun} facets were begun, {len(read)} triangles can be read")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # numpy warns where it stops short of the end
            return np.fromstring(b" ".join(chain.from_iterable(read)), sep=" ").reshape(3 * begun, 3)
    except (ValueError, DeprecationWarning):
        raise ParseError("a coordinate of an STL vertex is not a number") from None
