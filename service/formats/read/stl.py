"""STL, binary and text -> triangles. Runs in the parsing child."""

from __future__ import annotations

import re
from itertools import chain

import numpy as np
import numpy.typing as npt

from service.colorimetry import decode_srgb
from service.formats.errors import ParseError
from service.formats.formats import STL_TEXT, text
from service.formats.read.bad_elements import are_places, left_out
from service.formats.read.numbers import parsed
from service.formats.read.raw_mesh import Numbers, RawMesh
from service.formats.types import AssetLimits, Floats

HEADER_BYTES = 84  # 80 of anything, and the number of facets
FACET = np.dtype([("normal", "<f4", 3), ("vertices", "<f4", (3, 3)), ("attributes", "<u2")])
VERTEX = rb"vertex\s++(\S++\s++\S++\s++\S++)\s++"
NORMAL = rb"[^v]{0,200}?"  # what stands before the first vertex; bounded, or a file of nothing else takes hours
TEXT_FACET = re.compile(
    rb"\bfacet\b" + NORMAL + rb"\bouter\s++loop\s++" + 3 * VERTEX + rb"end ?loop\b", re.IGNORECASE
)
BEGUN = re.compile(rb"^[^\S\n]*+facet\b", re.IGNORECASE | re.MULTILINE)
ENDED = re.compile(rb"\bendsolid\b[^\n]*+", re.IGNORECASE)
UNKNOWN = (0, 2**32 - 1)  # what a program writes for the number of facets that it doesn't know yet
# Of a facet's 16 bits, Magics and VisCAM take five for each channel, in opposite orders, and one to say whose colour
# it is. Magics has the whole body's colour in the header.
MAGICS = re.compile(rb"COLOR=(.{4})", re.DOTALL)
SIGN, CHANNEL, SHIFTS = 1 << 15, 31, (0, 5, 10)


def read_stl(view: memoryview, limits: AssetLimits) -> RawMesh:
    """The facets of a file, each with vertices of its own; their normals are not read. Raises ParseError."""
    told: list[str] = []
    colors = None
    if _is_text(view):
        vertices = _read_text(text(bytes(view)), told)
    else:
        vertices, colors = _read_binary(view, told)
    faces = np.arange(len(vertices)).reshape(-1, 3)
    facets = np.zeros(len(faces), np.int32)  # the file has a normal for each facet, and none for vertices
    return RawMesh(vertices, faces, colors=colors, warnings=told, groups=facets)


def _is_text(view: memoryview) -> bool:
    """True if the file is a text: many binary files begin with `solid`, too, but none goes on like one."""
    if len(view) >= HEADER_BYTES and len(view) == _promised(view):
        return False
    return STL_TEXT.match(text(bytes(view[:65536]))) is not None


def _promised(view: memoryview) -> int:
    return HEADER_BYTES + FACET.itemsize * int.from_bytes(view[80:HEADER_BYTES], "little")


def _read_binary(view: memoryview, told: list[str]) -> tuple[Numbers, Floats | None]:
    """Three rows for each facet that the header counts, and their colours."""
    count, promised = int.from_bytes(view[80:HEADER_BYTES], "little"), _promised(view)
    there, rest = divmod(max(len(view) - HEADER_BYTES, 0), FACET.itemsize)
    if count in UNKNOWN and there and not rest:
        told.append(f"the header promises {count} triangles; all {there} that follow it are read")
        count, promised = there, len(view)
    elif len(view) < promised and _holds_facets(view, there):
        told.append(f"the file is cut off: of {count} triangles that its header promises, {there} are whole and read")
        count, promised = there, len(view)
    elif len(view) < promised or (not count and len(view) > promised):
        raise ParseError(
            f"not an STL file: {len(view)} bytes; its header promises {promised}, and it is no text of solids"
        )
    if len(view) > promised:
        told.append(
            f"{_bytes(len(view) - promised)} after the {count} triangles that the header promises are not read"
        )
    rows = np.frombuffer(view, FACET, count, HEADER_BYTES)
    return rows["vertices"].reshape(-1, 3), _colors(bytes(view[:80]), rows["attributes"], told)


def _holds_facets(view: memoryview, count: int) -> bool:
    """True if whole facets follow the header, where their number in it is wrong: a file of another kind is no text
    with zero bytes, and most of its nines of numbers are out of range."""
    if not count or b"\0" not in bytes(view[HEADER_BYTES : HEADER_BYTES + FACET.itemsize * count]):
        return False
    vertices = np.frombuffer(view, FACET, count, HEADER_BYTES)["vertices"].reshape(-1, 9)
    return bool(np.count_nonzero(are_places(vertices)) * 2 > count)


def _bytes(count: int) -> str:
    return "1 byte" if count == 1 else f"{count} bytes"


def _colors(header: bytes, attributes: npt.NDArray[np.uint16], told: list[str]) -> Floats | None:
    """The colours of the facets, as Magics or VisCAM write them, for each of their vertices; sRGB -> linear."""
    body = MAGICS.search(header)
    is_signed = (attributes & SIGN) > 0
    if body is None and not is_signed.any():
        if attributes.any():
            told.append(
                f"the attributes of {np.count_nonzero(attributes)} triangles are no colours that are known, and are "
                "not read"
            )
        return None
    if body is None:
        owns, shifts, shared = is_signed, SHIFTS[::-1], np.ones(3)
        if not owns.all():
            told.append(f"{np.count_nonzero(~owns)} triangles have no colour; they are shown white")
    else:
        # All attributes are 0 where nobody wrote any: black facets alone would be a strange use of colours.
        owns, shifts = ~is_signed & bool(attributes.any()), SHIFTS
        shared = np.frombuffer(body[1], np.uint8)[:3] / 255
        if body[1][3] != 255:
            told.append("the transparency of the header's colour is not supported; it is shown opaque")
    channels = np.stack([attributes >> shift & CHANNEL for shift in shifts], axis=1) / CHANNEL
    colors = decode_srgb(np.where(owns[:, None], channels, shared)).astype(np.float32)
    return np.repeat(colors, 3, axis=0)


def _read_text(data: bytes, told: list[str]) -> Numbers:
    """Three rows for each facet of all solids that has three vertices."""
    data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    begun = [match.start() for match in BEGUN.finditer(data)]
    end = next(reversed([*ENDED.finditer(data, begun[-1] if begun else 0)]), None)
    if end is None:
        told.append("the file is cut off: it does not end with `endsolid`")
    elif junk := data[end.end() :].strip(b"\0\x1a \n\t\v\f"):
        told.append(f"{_bytes(len(junk))} after the last `endsolid` are not read: {_shown(junk)}")
    found = [(match.start(), match.groups()) for match in TEXT_FACET.finditer(data)]
    words = b" ".join(chain.from_iterable(groups for _, groups in found))
    vertices = parsed(words).reshape(-1, 3)
    if len(found) < len(begun):
        read = {at for at, _ in found}
        lines = [at for at in begun if at + _indent(data, at) not in read]
        line = data.count(b"\n", 0, lines[0]) + 1 if lines else 1
        reason = f"the facet of line {line} does not have three vertices"
        if not found:
            reason = "; ".join([*told, reason])
            raise ParseError(reason if len(begun) == 1 else f"none of its {len(begun)} facets can be read; {reason}")
        told.append(left_out(len(begun) - len(found), "facet", reason))
    return vertices


def _indent(data: bytes, at: int) -> int:
    return len(data[at : at + 256]) - len(data[at : at + 256].lstrip())


def _shown(junk: bytes) -> str:
    return repr(junk[:40].decode("utf-8", "replace")) + ("…" if len(junk) > 40 else "")
