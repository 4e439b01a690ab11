"""The JSON and the binary part of a glTF file."""

from __future__ import annotations

import base64
import json
import struct
from collections.abc import Hashable
from importlib import metadata
from typing import Any

import numpy as np

from service.exports.writing import Limits, check_size

Tree = dict[str, Any]
COMPONENTS = {"uint16": 5123, "uint32": 5125, "float32": 5126}
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
VERTICES, INDICES = 34962, 34963  # targets of buffer views: what a GPU takes them for
RESERVED = 65535  # as a 16-bit index it would restart a primitive
JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942
ALIGNMENT = 4  # bytes, of views and chunks [glTF 2.0, sections 3.6.2.4 and 4.4.3]


class Builder:
    """`tree` is the file's JSON. Raises TooLarge as soon as the file grows beyond its limit."""

    def __init__(self, limits: Limits) -> None:
        self.limits = limits
        generator = f"Sunbox {metadata.version('sunbox-server')}"
        self.tree: Tree = {"asset": {"version": "2.0", "generator": generator}}
        self._pieces: list[bytes | memoryview] = []
        self._size = 0
        self._extensions: set[str] = set()
        self._accessors: dict[Hashable, int] = {}

    def add(self, kind: str, item: Tree) -> int:
        """The index of a new item."""
        items = self.tree.setdefault(kind, [])
        items.append(item)
        return len(items) - 1

    def extension(self, name: str, value: Tree) -> dict[str, Tree]:
        """The member of an object's `extensions`."""
        self._extensions.add(name)
        return {name: value}

    def view(self, data: bytes | memoryview, target: int | None = None) -> int:
        """The index of a buffer view with these bytes."""
        check_size(self._size + len(data), self.limits)
        at, pad = self._size, -len(data) % ALIGNMENT
        self._pieces += [data, bytes(pad)] if pad else [data]
        self._size += len(data) + pad
        more = {} if target is None else {"target": target}
        return self.add("bufferViews", {"buffer": 0, "byteOffset": at, "byteLength": len(data), **more})

    def vertices(self, rows: np.ndarray, key: Hashable = None, bounded: bool = False) -> int:
        """The index of an accessor of float32 rows (n, width); the one that `key` names already, if any. `bounded`:
        with the least and the greatest values, which positions must have."""
        if key is not None and key in self._accessors:
            return self._accessors[key]
        rows = np.ascontiguousarray(rows, np.float32)
        ends = {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()} if bounded else {}
        return self._accessor(rows, TYPES[rows.shape[1]], VERTICES, key, ends)

    def indices(self, faces: np.ndarray, vertices: int, key: Hashable = None) -> int:
        """The index of an accessor of the corners of triangles (m, 3)."""
        if key is not None and key in self._accessors:
            return self._accessors[key]
        flat = np.ascontiguousarray(faces.reshape(-1), np.uint16 if vertices <= RESERVED else np.uint32)
        return self._accessor(flat, "SCALAR", INDICES, key, {})

    def _accessor(self, rows: np.ndarray, type_: str, target: int, key: Hashable, more: Tree) -> int:
        view = self.view(rows.data.cast("B"), target)
        described = {"bufferView": view, "componentType": COMPONENTS[rows.dtype.name], "count": len(rows)}
        index = self.add("accessors", {**described, "type": type_, **more})
        if key is not None:
            self._accessors[key] = index
        return index

    def glb(self) -> list[bytes | memoryview]:
        """The file as GLB, in pieces."""
        text = self._text({"byteLength": self._size})
        text += b" " * (-len(text) % ALIGNMENT)
        chunks: list[bytes | memoryview] = [struct.pack("<II", len(text), JSON_CHUNK), text]
        size = 12 + 8 + len(text)
        if self._size:
            chunks += [struct.pack("<II", self._size, BINARY_CHUNK), *self._pieces]
            size += 8 + self._size
        check_size(size, self.limits)
        return [struct.pack("<4sII", b"glTF", 2, size), *chunks]

    def gltf(self) -> list[bytes | memoryview]:
        """The file as JSON, with its binary part in it."""
        data = base64.b64encode(b"".join(self._pieces)).decode()
        text = self._text({"byteLength": self._size, "uri": f"data:application/octet-stream;base64,{data}"})
        check_size(len(text), self.limits)
        return [text]

    def _text(self, buffer: Tree) -> bytes:
        used = {"extensionsUsed": sorted(self._extensions)} if self._extensions else {}
        buffers = {"buffers": [buffer]} if self._size else {}
        return json.dumps({**self.tree, **used, **buffers}, separators=(",", ":"), allow_nan=False).encode()
