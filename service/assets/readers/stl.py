"""STL through trimesh, with its triangles counted."""

import io
import re
import warnings

import numpy as np

from service.assets.errors import ParseError
from service.assets.formats import text
from service.assets.readers.raw_mesh import RawMesh
from service.assets.types import AssetLimits


def read_stl(view: memoryview, limits: AssetLimits) -> RawMesh:
    """Through trimesh, whose text reader stops in silence where a number or an `endsolid` is missing: we count."""
    from trimesh.exchange.stl import load_stl

    data = bytes(view)
    promised = int.from_bytes(data[80:84], "little")
    if len(data) < 84 or len(data) != 84 + 50 * promised:
        data = text(data).replace(b"\r\n", b"\n").replace(b"\r", b"\n")
        if not re.match(rb"\s*+solid\b", data, re.IGNORECASE):
            raise ParseError(
                f"not an STL file: {len(data)} bytes; its header promises {84 + 50 * promised}, and it is no text"
            )
        promised = len(re.findall(rb"^\s*facet\b", data, re.IGNORECASE | re.MULTILINE))
        if not re.search(rb"^\s*endsolid\b[^\n]*\s*\Z", data[-65536:], re.IGNORECASE | re.MULTILINE):
            raise ParseError("the file is cut off: it does not end with `endsolid`")
        data = data.decode("utf-8", "replace").encode()  # a name in another encoding: trimesh would have to guess
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        loaded = load_stl(io.BytesIO(data))
    solids = list(loaded["geometry"].values()) if "geometry" in loaded else [loaded]
    vertices = np.concatenate([solid["vertices"] for solid in solids] or [np.empty((0, 3))])
    if len(vertices) != 3 * promised:
        raise ParseError(f"{promised} facets were begun, {len(vertices) / 3:g} triangles can be read")
    faces = np.arange(len(vertices)).reshape(-1, 3)
    facets = np.zeros(len(faces), np.int32)  # the file has a normal for each facet, and none for vertices
    return RawMesh(vertices, faces, groups=facets)
