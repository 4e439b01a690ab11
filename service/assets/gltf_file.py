"""A glTF file as JSON and buffers, every length checked against the bytes that are there."""

import base64
import binascii
import json
import struct
from typing import Any

import numpy as np
import numpy.typing as npt

from service.assets.data import AssetLimits
from service.assets.errors import ParseError

JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942
COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
# Required extensions that this reader knows, or that don't touch the geometry.
KNOWN = {"KHR_draco_mesh_compression", "KHR_mesh_quantization", "KHR_lights_punctual", "EXT_texture_webp"}
KNOWN_PREFIXES = ("KHR_materials_", "KHR_texture_")

Array = npt.NDArray[Any]


class GltfFile:
    """`tree` is the JSON. Raises ParseError wherever the file refers to what it does not hold."""

    def __init__(self, data: bytes, limits: AssetLimits) -> None:
        self.limits = limits
        text, self._binary = _chunks(data) if data.startswith(b"glTF") else (data, b"")
        try:
            self.tree: dict[str, Any] = json.loads(text)
        except (ValueError, RecursionError) as error:
            what = "its JSON" if data.startswith(b"glTF") else "neither a GLB, which begins with `glTF`, nor JSON"
            raise ParseError(f"not a glTF file: {what}: {str(error)[:200]}") from None
        if not isinstance(self.tree, dict) or not isinstance(self.tree.get("asset"), dict):
            raise ParseError("not a glTF file: its JSON has no `asset`")
        version = self.tree["asset"].get("version")
        if not str(version).startswith("2."):
            raise ParseError(f"glTF 2.0 is read, this is version {version}")
        for name in self.tree.get("extensionsRequired", []):
            if name not in KNOWN and not str(name).startswith(KNOWN_PREFIXES):
                raise ParseError(f"it requires the extension {name}, which is not supported")
        self._buffers: dict[int, bytes] = {}

    def item(self, kind: str, index: Any) -> dict[str, Any]:
        items = self.tree.get(kind, [])
        if type(index) is not int or not 0 <= index < len(items) or not isinstance(items[index], dict):
            raise ParseError(f"{kind}[{index}] is referred to and does not exist")
        found: dict[str, Any] = items[index]
        return found

    def view(self, index: int) -> npt.NDArray[np.uint8]:
        """The bytes of a buffer view."""
        view = self.item("bufferViews", index)
        buffer = self._buffer(view.get("buffer"))
        start, length = _whole(view, "byteOffset", 0), _whole(view, "byteLength")
        if start + length > len(buffer):
            raise ParseError(f"bufferViews[{index}] ends at byte {start + length} of a buffer of {len(buffer)}")
        return np.frombuffer(buffer, np.uint8, length, start)

    def accessor(self, index: int, type: str) -> Array:
        """(count, width) as stored, or float64 where normalised."""
        accessor = self.item("accessors", index)
        where = f"accessors[{index}]"
        component, count = accessor.get("componentType"), _whole(accessor, "count")
        if component not in COMPONENTS or accessor.get("type") != type:
            raise ParseError(f"{where} should be {type}, is {accessor.get('type')} of component type {component}")
        dtype, width = np.dtype(COMPONENTS[component]), WIDTHS[type]
        if "bufferView" in accessor:
            values = self._strided(accessor, dtype, count, width, where)
        elif count > 3 * self.limits.max_triangles:
            raise ParseError(f"{where} asks for {count} items, more than any mesh allowed has")
        elif "sparse" not in accessor:
            raise ParseError(f"{where} has no data")
        else:
            values = np.zeros((count, width), dtype)
        if "sparse" in accessor:
            values = self._replace(values, accessor["sparse"], where)
        if accessor.get("normalized") and dtype.kind in "iu":
            return np.maximum(values / np.iinfo(dtype).max, -1.0)
        return values

    def _replace(self, values: Array, sparse: dict[str, Any], where: str) -> Array:
        count, where = _whole(sparse, "count"), f"{where}.sparse"
        component = sparse["indices"].get("componentType")
        if component not in COMPONENTS:
            raise ParseError(f"{where} has indices of component type {component}")
        places = self._strided(sparse["indices"], np.dtype(COMPONENTS[component]), count, 1, where)[:, 0]
        if count and int(places.max()) >= len(values):
            raise ParseError(f"{where} replaces item {places.max()} of {len(values)}")
        values = values.copy()
        values[places] = self._strided(sparse["values"], values.dtype, count, values.shape[1], where)
        return values

    def _strided(self, source: dict[str, Any], dtype: np.dtype[Any], count: int, width: int, where: str) -> Array:
        data, start, row = self.view(source["bufferView"]), _whole(source, "byteOffset", 0), dtype.itemsize * width
        stride = _whole(self.item("bufferViews", source["bufferView"]), "byteStride", row)
        if count and start + (count - 1) * stride + row > len(data):
            raise ParseError(f"{where} asks for {count} items of {row} bytes; its view has {len(data)} bytes")
        return np.ndarray((count, width), dtype, data.data, start, (stride, dtype.itemsize))

    def _buffer(self, index: Any) -> bytes:
        if index not in self._buffers:
            buffer = self.item("buffers", index)
            length, uri = _whole(buffer, "byteLength"), buffer.get("uri")
            data = self._binary if uri is None and index == 0 else _embedded(uri)
            if length > len(data):
                raise ParseError(f"buffers[{index}] promises {length} bytes and has {len(data)}: the file is cut off")
            self._buffers[index] = data
        return self._buffers[index]


def _chunks(data: bytes) -> tuple[bytes, bytes]:
    """The JSON and the binary chunk of a GLB."""
    if len(data) < 20:
        raise ParseError("the file is cut off: it is shorter than a GLB's header")
    version, length, at = *struct.unpack_from("<II", data, 4), 12
    if version != 2:
        raise ParseError(f"glTF 2.0 is read, this GLB is version {version}")
    if length > len(data):
        raise ParseError(f"the file is cut off: its header promises {length} bytes, there are {len(data)}")
    chunks: dict[int, bytes] = {}
    while at + 8 <= length:
        size, kind = struct.unpack_from("<II", data, at)
        if at + 8 + size > length:
            raise ParseError(f"the chunk at byte {at} promises {size} bytes, {length - at - 8} are left")
        chunks.setdefault(kind, data[at + 8 : at + 8 + size])
        at += 8 + size
    if JSON_CHUNK not in chunks:
        raise ParseError("this GLB has no JSON chunk")
    return chunks[JSON_CHUNK], chunks.get(BINARY_CHUNK, b"")


def _embedded(uri: Any) -> bytes:
    head, comma, body = str(uri).partition(",")
    if not head.startswith("data:") or not comma or not head.endswith(";base64"):
        what = f"its buffer is another file, {str(uri)[:80]!r}" if uri else "its buffer is missing"
        raise ParseError(f"{what}; only what the file itself holds is read: save it as GLB")
    try:
        return base64.b64decode(body)
    except (ValueError, binascii.Error) as error:
        raise ParseError(f"its embedded buffer is not base64: {error}") from None


def _whole(source: dict[str, Any], name: str, default: int | None = None) -> int:
    value = source.get(name, default)
    if type(value) is not int or value < 0:
        raise ParseError(f"`{name}` must be a whole number of at least 0, not {str(value)[:40]}")
    return value
