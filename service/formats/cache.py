"""A cache of parsed assets, and the description of one. A file that several threads load at once is parsed once."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable
from concurrent.futures import Future
from typing import Protocol

from service.formats.errors import LAYER, MissingExtra, ParseError
from service.formats.formats import KINDS
from service.formats.sandbox.sandbox import Sandbox
from service.formats.types import (
    AssetInfo,
    AssetLimits,
    Assets,
    ImageData,
    LutData,
    MeasuredData,
    MeshData,
    array_bytes,
)
from service.problems import AssetError, NotProvided

Parsed = MeshData | ImageData | LutData | MeasuredData
NOUNS = {
    MeshData: "a mesh",
    ImageData: "an image",
    LutData: "a table of colours",
    MeasuredData: "measured reflection",
}


class ParsedCache:
    """Parsed assets by key, as many as fit, and one larger than that which was parsed ahead of its use.

    It may be used by any number of threads.
    """

    def __init__(self, limits: AssetLimits) -> None:
        self.sandbox = Sandbox(limits)
        self._lock = threading.Lock()
        self._cached: OrderedDict[str, Parsed] = OrderedDict()
        self._large: tuple[str, Parsed] | None = None  # dropped at its first use
        self._pending: dict[str, Future[Parsed]] = {}

    def load(self, key: str, parse: Callable[[], Parsed], ahead: bool = False) -> Parsed:
        """The result of `parse` for this key, now or earlier. Raises its exceptions; failures are not cached.

        `ahead`: the next call with this key will use it; until then it stays, however large it is.
        """
        with self._lock:
            if self._large is not None and self._large[0] == key:
                parsed = self._large[1]
                if not ahead:
                    self._large = None
                return parsed
            if key in self._cached:
                self._cached.move_to_end(key)
                return self._cached[key]
            future = self._pending.get(key)
            if future is None:
                mine = self._pending[key] = Future()
        if future is not None:
            return future.result()
        try:
            parsed = parse()
        except BaseException as error:
            with self._lock:
                del self._pending[key]
            mine.set_exception(error)
            raise
        with self._lock:
            self._cache(key, parsed, ahead)
            del self._pending[key]
        mine.set_result(parsed)
        return parsed

    def _cache(self, key: str, parsed: Parsed, ahead: bool) -> None:
        if array_bytes(parsed) > self.sandbox.limits.cache_bytes:
            self._large = (key, parsed) if ahead else self._large
            return
        self._cached[key] = parsed
        room = self.sandbox.limits.cache_bytes - sum(map(array_bytes, self._cached.values()))
        while room < 0:
            room += array_bytes(self._cached.popitem(last=False)[1])

    @property
    def bytes(self) -> int:
        with self._lock:
            return sum(map(array_bytes, self._cached.values())) + (array_bytes(self._large[1]) if self._large else 0)

    def shrink(self, size: int) -> None:
        """Free that many bytes, or all, beginning with the asset that was loaded longest ago."""
        with self._lock:
            while size > 0 and self._cached:
                size -= array_bytes(self._cached.popitem(last=False)[1])
            if size > 0:
                self._large = None

    def close(self) -> None:
        self.sandbox.close()


def as_mesh(parsed: Parsed, name: str) -> MeshData:
    if not isinstance(parsed, MeshData):
        raise AssetError(f"{name} is {NOUNS[type(parsed)]}; a mesh is needed here")
    return parsed


def as_image(parsed: Parsed, name: str) -> ImageData:
    if not isinstance(parsed, ImageData):
        raise AssetError(f"{name} is {NOUNS[type(parsed)]}; an image is needed here")
    return parsed


def as_measured(parsed: Parsed, name: str) -> MeasuredData:
    if not isinstance(parsed, MeasuredData):
        raise AssetError(f"{name} is {NOUNS[type(parsed)]}; measured reflection (.binary, .bsdf) is needed here")
    return parsed


class AnyAssets(Assets, Protocol):
    """Assets of every kind, those that views refer to as well."""

    def load(self, ref: str) -> Parsed:
        """Raises AssetError."""


def as_lut(parsed: Parsed, name: str) -> LutData:
    if not isinstance(parsed, LutData):
        raise AssetError(f"{name} is {NOUNS[type(parsed)]}; a table of colours (.cube) is needed here")
    return parsed


def layered(key: str, layer: str) -> str:
    """The key of a layer of an image."""
    return f"{key} layer {layer}" if layer else key


def refused(name: str, error: ParseError) -> AssetError | NotProvided:
    """The error for a caller whose file is not read."""
    detail = f"{name}: {error.detail if error.pointer == LAYER else error}"
    if isinstance(error, MissingExtra):
        return NotProvided(detail)
    return AssetError(detail, error.pointer, error.choices)


def describe(id: str, format: str, size: int, parsed: Parsed) -> AssetInfo:
    warnings = [{"pointer": "", "detail": text} for text in parsed.warnings] or None
    if isinstance(parsed, ImageData):
        height, width, channels = parsed.pixels.shape
        layers = list(parsed.layers) or None
        return AssetInfo(id, KINDS[format], format, size, width, height, channels, warnings=warnings, layers=layers)
    if isinstance(parsed, LutData | MeasuredData):
        return AssetInfo(id, KINDS[format], format, size, warnings=warnings)
    bounds = [corner.tolist() for corner in parsed.bounds]
    vertices, triangles = len(parsed.vertices), len(parsed.faces)
    return AssetInfo(
        id, KINDS[format], format, size, vertices=vertices, triangles=triangles, bounds=bounds, warnings=warnings
    )
