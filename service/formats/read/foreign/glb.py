"""A GLB whose JSON and bytes are changed before it is read: images are put into it, what no reader can use goes."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from service.formats.read.other_images import as_png
from service.formats.types import AssetLimits

JSON_CHUNK, BINARY_CHUNK = b"JSON", b"BIN\0"
AS_THEY_ARE = (b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff")  # PNG and JPEG, which glTF has; others become PNG
NOTHING = "data:image/png;base64,"
TEXTURE = "Texture"  # names of references to textures end so

Find = Callable[[str], bytes | None]  # a file by the name that the model has for it


@dataclass
class Glb:
    """`root` is the JSON, `data` the bytes of its one buffer."""

    root: dict[str, Any]
    data: bytearray
    warnings: list[str] = field(default_factory=list)

    @classmethod
    def read(cls, file: bytes) -> Glb:
        """The parts of a GLB that a library wrote."""
        (size,) = struct.unpack_from("<I", file, 12)
        root = json.loads(file[20 : 20 + size])
        return cls(root, bytearray(file[28 + size :]))

    def written(self) -> bytes:
        """The bytes of the file."""
        self.root["buffers"] = [{"byteLength": len(self.data)}] if self.data else []
        text = json.dumps(self.root, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        data = bytes(self.data) + b"\0" * (-len(self.data) % 4)
        chunks = struct.pack("<I4s", len(text), JSON_CHUNK) + text
        if data:
            chunks += struct.pack("<I4s", len(data), BINARY_CHUNK) + data
        return b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks

    def _view(self, number: int) -> bytes:
        view = self.root["bufferViews"][number]
        start = view.get("byteOffset", 0)
        return bytes(self.data[start : start + view["byteLength"]])

    def items(self, kind: str) -> list[dict[str, Any]]:
        """The items of a kind, which may be added to."""
        found: list[dict[str, Any]] = self.root.setdefault(kind, [])
        return found

    def embed(self, find: Find) -> None:
        """Put the images into the file that it names; the textures of those that are not there are left out."""
        lost = set[int]()
        for index, image in enumerate(self.root.get("images", [])):
            name = image.pop("uri", "")
            found = find(name) if name else self._view(image["bufferView"])
            picture = None if found is None else _as_glTF_has_it(found)
            if picture is None:
                why = "is not there" if found is None else "is no image that can be read"
                name = name or image.get("name", "")
                self.warnings.append(f"the texture {name[-100:]!r} {why}; its surface is shown without it")
                lost.add(index)
                continue
            if not name and picture == found:
                continue
            views = self.items("bufferViews")
            views.append({"buffer": 0, "byteOffset": len(self.data), "byteLength": len(picture)})
            self.data += picture + b"\0" * (-len(picture) % 4)
            kind = "image/png" if picture.startswith(AS_THEY_ARE[0]) else "image/jpeg"
            image |= {"mimeType": kind, "bufferView": len(views) - 1}
        for index in lost:  # nothing shows them any more
            self.root["images"][index] = {"uri": NOTHING}
        textures = self.root.get("textures", [])
        gone = {index for index, texture in enumerate(textures) if texture.get("source") in lost}
        if gone:
            for material in self.root.get("materials", []):
                _without(material, gone)

    def turn_z_up(self, name: str, scale: float = 1.0) -> None:
        """Put everything under a node of that name, which scales it and turns +Z to +Y."""
        nodes = self.items("nodes")
        for scene in self.root["scenes"]:
            matrix = [scale, 0, 0, 0, 0, 0, -scale, 0, 0, scale, 0, 0, 0, 0, 0, 1]
            nodes.append({"name": name, "matrix": matrix, "children": scene["nodes"]})
            scene["nodes"] = [len(nodes) - 1]

    def mend_accessors(self) -> None:
        """Coordinates of three numbers, which COLLADA may have, become those of two, as glTF has them."""
        wanted = {
            number
            for mesh in self.root.get("meshes", [])
            for primitive in mesh["primitives"]
            for name, number in primitive["attributes"].items()
            if name.startswith("TEXCOORD_")
        }
        for number in wanted:
            accessor = self.root["accessors"][number]
            if accessor["type"] == "VEC3":
                accessor["type"] = "VEC2"
                accessor.pop("min", None)
                accessor.pop("max", None)
                views = self.items("bufferViews")
                views.append(views[accessor["bufferView"]] | {"byteStride": 12})
                accessor["bufferView"] = len(views) - 1

    def drop_extension(self, name: str) -> None:
        """Forget an extension that no reader needs to know of."""
        for key in ("extensionsUsed", "extensionsRequired"):
            if name in self.root.get(key, ()):
                self.root[key].remove(name)
        for mesh in self.root.get("meshes", []):
            for primitive in mesh["primitives"]:
                primitive.get("extensions", {}).pop(name, None)


def _as_glTF_has_it(data: bytes) -> bytes | None:
    """A PNG or a JPEG; None for what is no image."""
    if data.startswith(AS_THEY_ARE):
        return data
    return as_png(data, AssetLimits.max_texels)


def _without(place: dict[str, Any], gone: set[int]) -> None:
    """Remove references to these textures."""
    for name, value in list(place.items()):
        if not isinstance(value, dict):
            continue
        if name.endswith(TEXTURE) and value.get("index") in gone:
            del place[name]
        else:
            _without(value, gone)
