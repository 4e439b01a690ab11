"""glTF files put together by hand, value by value."""

from __future__ import annotations

from typing import Any

import numpy as np

from tests import asset_files as make

QUAD = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], "<f4")
QUAD_FACES = np.array([0, 1, 2, 0, 2, 3], "<u2")
QUAD_UVS = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], "<f4")  # upright: v points down

COMPONENTS = {"int8": 5120, "uint8": 5121, "int16": 5122, "uint16": 5123, "uint32": 5125, "float32": 5126}
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


class Gltf:
    """`tree` is the JSON, to be changed at will; buffers grow as accessors and images are added."""

    def __init__(self) -> None:
        self.binary = b""
        self.tree: dict[str, Any] = {"asset": {"version": "2.0"}, "scenes": [{"nodes": []}], "nodes": []}

    def add(self, kind: str, item: dict[str, Any]) -> int:
        self.tree.setdefault(kind, []).append(item)
        return len(self.tree[kind]) - 1

    def view(self, data: bytes, **more: Any) -> int:
        self.binary += b"\0" * (-len(self.binary) % 4)
        at = len(self.binary)
        self.binary += data
        return self.add("bufferViews", {"buffer": 0, "byteOffset": at, "byteLength": len(data), **more})

    def accessor(self, rows: Any, **more: Any) -> int:
        """Of an array whose dtype is the component type, (n,) or (n, width)."""
        array = np.asarray(rows)
        width = 1 if array.ndim == 1 else array.shape[1]
        described = {"componentType": COMPONENTS[array.dtype.name], "count": len(array), "type": TYPES[width]}
        return self.add("accessors", {"bufferView": self.view(array.tobytes()), **described, **more})

    def image(self, pixels: np.ndarray) -> int:
        return self.add("images", {"bufferView": self.view(make.png(pixels)), "mimeType": "image/png"})

    def texture(self, pixels: np.ndarray, **more: Any) -> int:
        return self.add("textures", {"source": self.image(pixels), **more})

    def primitive(self, rows: dict[str, Any] | None = None, indices: Any = QUAD_FACES, **more: Any) -> dict[str, Any]:
        given = {"POSITION": QUAD, "TEXCOORD_0": QUAD_UVS} if rows is None else rows
        attributes = {name: self.accessor(array) for name, array in given.items()}
        made: dict[str, Any] = {"attributes": attributes, **more}
        return made if indices is None else made | {"indices": self.accessor(indices)}

    def mesh(self, *primitives: dict[str, Any], **more: Any) -> int:
        return self.add("meshes", {"primitives": list(primitives or [self.primitive()]), **more})

    def node(self, shown: bool = True, **node: Any) -> int:
        index = self.add("nodes", node)
        if shown:
            self.tree["scenes"][0]["nodes"].append(index)
        return index

    def animation(self, name: str, *channels: tuple[int, str, str, Any, Any]) -> int:
        """Of channels `(node, path, interpolation, times, values)`."""
        samplers = [
            {
                "input": self.accessor(np.asarray(times, "<f4")),
                "interpolation": how,
                "output": self.accessor(np.asarray(values, "<f4")),
            }
            for _, _, how, times, values in channels
        ]
        targets = [
            {"sampler": k, "target": {"node": node, "path": path}} for k, (node, path, *_) in enumerate(channels)
        ]
        return self.add("animations", {"name": name, "samplers": samplers, "channels": targets})

    def of(self, material: dict[str, Any]) -> Gltf:
        """This, with a quad of the material."""
        self.node(mesh=self.mesh(self.primitive(material=self.add("materials", material))))
        return self

    def glb(self) -> bytes:
        binary = self.binary + b"\0" * (-len(self.binary) % 4)
        return make.glb({**self.tree, "buffers": [{"byteLength": len(binary)}]}, binary)
