"""A glTF file as JSON and bytes. Every length is checked against the bytes that are there."""

from __future__ import annotations

import base64
import binascii
import json
import math
import re
import struct
from typing import Any
from urllib.parse import unquote_to_bytes

import numpy as np
import numpy.typing as npt

from service.formats.errors import MissingExtra, ParseError
from service.formats.read.gltf import meshopt_views
from service.formats.read.gltf.beside import Beside
from service.formats.read.gltf.extensions import check_required
from service.formats.read.gltf.json_view import JsonView, shown, whole
from service.formats.types import AssetLimits
from service.problems import escaped

JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942
DATA = re.compile(r"\s*data:", re.IGNORECASE)  # schemes have no case
MOST_ITEMS = 1 << 20  # items of one kind, which bounds the time to read an untrusted file

Array = npt.NDArray[Any]
Bytes = npt.NDArray[np.uint8]


class OtherFile(ParseError):
    """A file that came alone names another."""


REFUSALS = (OtherFile, MissingExtra)  # with which no part of a file is left out


class GltfDocument:
    """A glTF file; `root` is its JSON. Methods raise ParseError where the file refers to something that it lacks."""

    def __init__(self, data: bytes | memoryview, limits: AssetLimits, beside: Beside | None = None) -> None:
        """`beside`: the files around it, to which it may refer."""
        self.limits, self._beside = limits, beside
        view = memoryview(data)
        binary = bytes(view[:4]) == b"glTF"
        text, self._binary = _chunks(view) if binary else (view, None)
        self.root = _root(bytes(text), binary)
        self._buffers: dict[int, Bytes] = {}
        self._decoded: dict[str, Bytes] = {}  # compressed views, by their place
        asset = self.root.need("asset")
        version, least = asset.text("version"), asset.text("minVersion", "2.0")
        if not version.startswith("2."):
            raise ParseError(f"glTF 2.0 is supported; this is version {shown(version)}", "/asset/version")
        if least != "2.0":
            raise ParseError(f"glTF 2.0 is supported; the file needs {shown(least)}", "/asset/minVersion")
        check_required(self.root)
        if beside is not None:
            items = (item for kind in ("buffers", "images") for item in self.root.objects(kind))
            beside.take(uri for item in items if (uri := item.text("uri", "")) and not DATA.match(uri))

    def count(self, kind: str) -> int:
        return len(self.root.array(kind))

    def item(self, kind: str, index: Any, pointer: str) -> JsonView:
        """The item that the value at `pointer` refers to."""
        items = self.root.array(kind)
        k = whole(index, pointer)
        if k >= len(items):
            raise ParseError(f"refers to /{kind}/{k}; there are {len(items)}", pointer)
        return JsonView(items[k], f"/{kind}/{k}")

    def follow(self, place: JsonView, name: str, kind: str) -> JsonView:
        """The item that a place's member refers to."""
        return self.item(kind, place.value.get(name), place.at(name))

    def view(self, place: JsonView, name: str = "bufferView") -> tuple[Bytes, JsonView]:
        """The bytes of the buffer view that a place refers to, decompressed."""
        view = self.follow(place, name, "bufferViews")
        compressed = meshopt_views.extension(view)
        if compressed is None:
            return self.range(view, view), view
        if view.pointer not in self._decoded:
            packed = self.range(compressed, compressed)
            self._decoded[view.pointer] = meshopt_views.decoded(compressed, packed, self.limits)
        return self._decoded[view.pointer], view

    def range(self, source: JsonView, named: JsonView) -> Bytes:
        """The bytes from `byteOffset` on, `byteLength` of them, of the buffer that `source` names."""
        buffer = self._buffer(source)
        start, length = source.whole("byteOffset", 0), source.whole("byteLength")
        if start + length > len(buffer):
            raise named.error("byteLength", f"ends at byte {start + length} of a buffer of {len(buffer)}")
        return buffer[start : start + length]

    def image(self, place: JsonView) -> bytes:
        """The bytes of an image as it is stored."""
        if "bufferView" in place:
            return self.view(place)[0].tobytes()
        return self._named(place).tobytes()

    def lacks(self, place: JsonView) -> str:
        """The reference of an image to a file that is not there, among the files around this one; else nothing."""
        uri = place.text("uri", "")
        is_lost = self._beside is not None and uri and not DATA.match(uri) and self._beside.find(uri) is None
        return uri if is_lost else ""

    def _buffer(self, source: JsonView) -> Bytes:
        place = self.follow(source, "buffer", "buffers")
        index = source.whole("buffer")
        if index not in self._buffers:
            length = place.whole("byteLength")
            binary = self._binary if index == 0 and "uri" not in place else None
            data = self._named(place) if binary is None else np.frombuffer(binary, np.uint8)
            if length > len(data):
                raise place.error("byteLength", f"promises {length} bytes and has {len(data)}: the file is cut off")
            self._buffers[index] = data
        return self._buffers[index]

    def _named(self, place: JsonView) -> Bytes:
        """The bytes of a `data:` URI, or of the file that a URI leads to."""
        uri = place.text("uri")
        if not uri:
            extensions = place.object("extensions")
            names = sorted(extensions.value) if extensions else []
            which = f": its data are there in compressed form only ({names[0][:60]})" if names else ""
            raise place.error("uri", f"is missing{which}")
        start = DATA.match(uri)
        if start is not None:
            return _embedded(uri[start.end() :], place)
        if self._beside is None:
            how = "upload a zip of the model and its files, or save the model as a GLB"
            detail = f"refers to another file, {shown(uri)}, which is not part of this one; {how}"
            raise OtherFile(detail, place.at("uri"))
        found = self._beside.find(uri)
        if found is None:
            raise place.error("uri", f"refers to {shown(uri)}, which is not there: {self._beside.shown}")
        return np.frombuffer(self._beside.read(found, place.at("uri")), np.uint8)


def external(data: bytes) -> list[tuple[str, str]]:
    """The URIs of a file that lead to others, with their places; [] for one that is broken."""
    try:
        root = GltfDocument(data, AssetLimits()).root
        items = [item for kind in ("buffers", "images") for item in root.objects(kind)]
        named = [(item.at("uri"), item.text("uri", "")) for item in items]
    except ParseError:
        return []  # the importer says where
    return [(pointer, uri) for pointer, uri in named if uri and not DATA.match(uri)]


def _embedded(text: str, place: JsonView) -> Bytes:
    """The bytes of a `data:` URI, from what follows its scheme."""
    head, comma, body = text.partition(",")
    if not comma:
        raise place.error("uri", "is a `data:` URI without a comma, which stands before the data")
    encoded = unquote_to_bytes(body)
    if not head.lower().endswith(";base64"):
        return np.frombuffer(encoded, np.uint8)
    try:
        # The check is strict: else characters outside base64 would be skipped and the bytes behind them shifted.
        # Blanks are harmless.
        return np.frombuffer(base64.b64decode(b"".join(encoded.split()), validate=True), np.uint8)
    except (ValueError, binascii.Error) as error:
        raise place.error("uri", f"is not valid base64: {str(error).lower()}") from None


def load(text: bytes) -> Any:
    """The value of a JSON text in UTF-8. Raises ParseError with the line and the column of a mistake."""
    try:
        decoded = text.rstrip(b"\0").decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ParseError(f"byte {error.start} is not UTF-8") from None
    try:
        return json.loads(decoded, parse_constant=_refuse_constant)
    except json.JSONDecodeError as error:
        raise ParseError(f"line {error.lineno}, column {error.colno}: {error.msg.lower()}") from None
    except RecursionError:
        raise ParseError("its arrays and objects are nested too deeply") from None
    except _Constant as error:
        raise ParseError(f"must be a finite number, not {error}", _first_constant(json.loads(decoded))) from None
    except ValueError as error:  # a whole number of more than 4300 digits
        raise ParseError(str(error)[:200]) from None


class _Constant(Exception):
    """NaN or Infinity, which Python's reader accepts although JSON has neither."""


def _refuse_constant(name: str) -> None:
    raise _Constant(name)


def _first_constant(tree: Any) -> str:
    """The pointer to the first number of a tree that is not finite."""
    stack = [(tree, "")]
    while stack:
        value, pointer = stack.pop()
        if type(value) is float and not math.isfinite(value):
            return pointer
        pairs = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
        stack += reversed([(inner, f"{pointer}/{escaped(name)}") for name, inner in pairs])
    return ""


def _root(text: bytes, is_binary: bool) -> JsonView:
    try:
        tree = load(text)
    except ParseError as error:
        where = (
            "the JSON in this GLB: " if is_binary else "this is neither a GLB, which begins with `glTF`, nor JSON: "
        )
        raise ParseError(error.detail if error.pointer else where + error.detail, error.pointer) from None
    if not isinstance(tree, dict) or not isinstance(tree.get("asset"), dict):
        raise ParseError("this is not glTF: its JSON has no object `asset`")
    for kind, items in tree.items():
        if isinstance(items, list) and len(items) > MOST_ITEMS:
            raise ParseError(f"has {len(items)} items; {MOST_ITEMS} are allowed", f"/{kind[:60]}")
    return JsonView(tree, "")


def _chunks(data: memoryview) -> tuple[memoryview, memoryview | None]:
    """The JSON and the binary chunk of a GLB."""
    if len(data) < 20:
        raise ParseError("the file is cut off: it is shorter than a GLB's header")
    version, length, at = *struct.unpack_from("<II", data, 4), 12
    if version != 2:
        raise ParseError(f"glTF 2.0 is supported; this GLB is version {version}")
    chunks: dict[int, memoryview] = {}
    while at + 8 <= min(length, len(data)):  # some exporters write a length that is a little too large or too small
        size, kind = struct.unpack_from("<II", data, at)
        if at + 8 + size > len(data):
            cut = f"its header promises {length} bytes, there are {len(data)}; " if length > len(data) else ""
            left = f"the chunk at byte {at} promises {size} bytes, {len(data) - at - 8} are left"
            raise ParseError(f"the file is cut off: {cut}{left}")
        chunks.setdefault(kind, data[at + 8 : at + 8 + size])
        at += 8 + size
    if JSON_CHUNK not in chunks:
        raise ParseError("this GLB has no JSON chunk")
    return chunks[JSON_CHUNK], chunks.get(BINARY_CHUNK)
