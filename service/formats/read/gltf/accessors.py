"""Accessors -> arrays: strides, sparse ones, normalised integers [glTF 2.0, section 3.6.2]."""

from __future__ import annotations

from typing import Any

import numpy as np

from service.formats.errors import ParseError
from service.formats.read.gltf.document import Array, GltfDocument
from service.formats.read.gltf.json_view import JsonView, shown

COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WHOLE = (5121, 5123, 5125)
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


def read(file: GltfDocument, source: JsonView, name: str, *types: str) -> Array:
    """(count, width) of the accessor that `source` refers to as `name`: as stored, or float32 where normalised."""
    place = file.follow(source, name, "accessors")
    type_, component = place.text("type"), place.whole("componentType")
    if type_ not in types:
        raise place.error("type", f"must be {' or '.join(types)} for {source.at(name)}, not {shown(type_)}")
    if component not in COMPONENTS:
        raise place.error("componentType", f"must be one of {', '.join(map(str, COMPONENTS))}, not {component}")
    dtype, width, count = np.dtype(COMPONENTS[component]), WIDTHS[type_], place.whole("count", low=1)
    if "bufferView" in place:
        values = _strided(file, place, dtype, count, width)
    elif count > 3 * file.limits.max_triangles:
        raise place.error("count", f"is {count}; a mesh has at most {3 * file.limits.max_triangles}")
    elif "sparse" not in place and place.value.get("extensions"):
        names = sorted(place.need("extensions").value)
        raise place.error("extensions", f"its data are there in compressed form only ({', '.join(names)[:80]})")
    else:  # zeros, says section 5.1.1; one row stands for all until somebody changes them
        values = np.broadcast_to(np.zeros((1, width), dtype), (count, width))
    if "sparse" in place:
        values = _replaced(file, values, place.need("sparse"))
    return normalised(values) if place.flag("normalized") else values


def indices(file: GltfDocument, source: JsonView, name: str = "indices") -> Array:
    """(count,) whole numbers: the accessor as indices."""
    place = file.follow(source, name, "accessors")
    if place.value.get("componentType") not in WHOLE:
        raise place.error("componentType", f"must be one of {', '.join(map(str, WHOLE))} for indices")
    return read(file, source, name, "SCALAR")[:, 0]


def normalised(values: Array) -> Array:
    """Integers as fractions of the type's greatest; the least value of a signed type counts as -1 as well."""
    if values.dtype.kind not in "iu":
        return values
    fractions: Array = np.maximum(values / np.float32(np.iinfo(values.dtype).max), np.float32(-1), dtype=np.float32)
    return fractions


def _replaced(file: GltfDocument, values: Array, sparse: JsonView) -> Array:
    count, place = sparse.whole("count", low=1), sparse.need("indices")
    component = place.whole("componentType")
    if component not in WHOLE:
        raise place.error("componentType", f"must be one of {', '.join(map(str, WHOLE))}, not {component}")
    where = _strided(file, place, np.dtype(COMPONENTS[component]), count, 1)[:, 0]
    if int(where.max()) >= len(values):
        raise place.error("bufferView", f"replaces item {where.max()} of {len(values)}")
    values = values.copy()
    values[where] = _strided(file, sparse.need("values"), values.dtype, count, values.shape[1])
    return values


def _strided(file: GltfDocument, source: JsonView, dtype: np.dtype[Any], count: int, width: int) -> Array:
    data, view = file.view(source)
    start, row = source.whole("byteOffset", 0), dtype.itemsize * width
    stride = view.whole("byteStride", row)
    if stride < row:
        raise view.error("byteStride", f"must be at least the {row} bytes of an item, not {stride}")
    if start + (count - 1) * stride + row > len(data):
        raise ParseError(
            f"asks for {count} items of {row} bytes, {stride} apart, from byte {start} on; its view has {len(data)}",
            source.at("bufferView"),
        )
    return np.ndarray((count, width), dtype, data.data, start, (stride, dtype.itemsize))
