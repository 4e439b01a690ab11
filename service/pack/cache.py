"""A cache of packed parts by their sources, so that an edit packs only the parts that it changes; and the large
meshes that an editor has moved, which get trees of their own when they are first moved.
"""

from __future__ import annotations

import hashlib
import threading
import weakref
from collections import OrderedDict
from collections.abc import Callable, Hashable, Sequence
from typing import Any, TypeVar

import numpy as np

from gpu.arrays import HEAVY
from service.document.shape import MeshShape, Shape

T = TypeVar("T")

# The fields of a mesh that its triangles depend on.
MESH_FIELDS = tuple(name for name in MeshShape.model_fields if name not in ("name", "medium", "priority"))
TRANSFORM = MESH_FIELDS.index("transform")
STILL = [i for i, name in enumerate(MESH_FIELDS) if name not in ("transform", "material", "visible_to_camera")]


class MovedMeshes:
    """The large meshes that one stream has moved. It serves one call at a time."""

    def __init__(self) -> None:
        self._before: Sequence[Hashable] = ()
        self._moved: set[Hashable] = set()

    def apart(
        self, shapes: Sequence[Shape], contents: Sequence[Hashable], triangles: Callable[[MeshShape], int]
    ) -> bool:
        """True if the scene has a mesh that was moved, now or before. `contents` are the shapes' `cache.content`."""
        here = {_still(each) for each in contents}
        for shape, old, new in zip(shapes, self._before, contents, strict=False):
            still = _still(new)
            if isinstance(shape, MeshShape) and still not in self._moved and _still(old) == still:
                elsewhere = isinstance(old, tuple) and isinstance(new, tuple) and old[TRANSFORM] != new[TRANSFORM]
                if elsewhere and triangles(shape) >= HEAVY:
                    self._moved.add(still)
        self._before = contents
        self._moved &= here
        return bool(self._moved)


def _still(content: Hashable) -> Hashable:
    """The part of a mesh's content that a move does not change; None for another shape."""
    return tuple(content[i] for i in STILL) if isinstance(content, tuple) else None


class CacheBudget:
    """A bound on the bytes of several caches together. For any thread."""

    def __init__(self, most: int = 1 << 30) -> None:
        self._most = most
        self._caches: weakref.WeakSet[PackCache] = weakref.WeakSet()
        self._lock = threading.Lock()

    def join(self, cache: PackCache) -> None:
        with self._lock:
            self._caches.add(cache)

    @property
    def bytes(self) -> int:
        with self._lock:
            return sum(cache.bytes for cache in self._caches)

    @property
    def exceeded(self) -> bool:
        return self.bytes > self._most

    def shrink(self, size: int) -> None:
        """Free bytes from the largest caches first; the newest part of each cache stays."""
        with self._lock:
            caches = sorted(self._caches, key=lambda cache: cache.bytes, reverse=True)
        for cache in caches:
            while size > 0 and (freed := cache.drop_oldest()):
                size -= freed


class PackCache:
    """The last used geometries and environments within `budget`; the newest always stays. For any thread."""

    def __init__(self, entries: int = 4, budget: CacheBudget | None = None) -> None:
        self.bytes = 0
        self._entries = entries
        self._budget = budget or CacheBudget()
        self._values: OrderedDict[Hashable, tuple[Any, int]] = OrderedDict()
        self._lock = threading.Lock()
        self.moves = MovedMeshes()
        self._budget.join(self)  # last: from now on other threads shrink it

    def get(self, key: Hashable, make: Callable[[], T]) -> T:
        """The part of an equal key, or else `make()`, which runs outside the lock."""
        with self._lock:
            if key in self._values:
                self._values.move_to_end(key)
                value: T = self._values[key][0]
                return value
        value = make()
        with self._lock:
            replaced = self._values.pop(key, (None, 0))[1]
            self._values[key] = value, _freeze(value)
            self.bytes += self._values[key][1] - replaced
            while len(self._values) > 1 and (len(self._values) > self._entries or self._budget.exceeded):
                self.bytes -= self._values.popitem(last=False)[1][1]
        return value

    def find(self, key: Hashable) -> Any:
        """The part of an equal key, or None."""
        with self._lock:
            return self._values.get(key, (None, 0))[0]

    def drop_oldest(self) -> int:
        """Drop the least recently used part, unless it is the only one. Returns its bytes."""
        with self._lock:
            if len(self._values) < 2:
                return 0
            size = self._values.popitem(last=False)[1][1]
            self.bytes -= size
            return size

    def gather(self, kind: type[T]) -> list[T]:
        """All parts of that kind, the newest last."""
        with self._lock:
            return [value for value, _ in self._values.values() if isinstance(value, kind)]


def _freeze(value: object) -> int:
    """Make the arrays in a dataclass read-only, as they will be shared. Returns their bytes."""
    size = 0
    for member in vars(value).values():
        for array in member.values() if isinstance(member, dict) else [member]:
            if isinstance(array, np.ndarray):
                array.flags.writeable = False
                size += array.nbytes
    return size


def content(shape: Shape) -> Hashable:
    """A key that is equal for shapes whose surfaces look the same, arrays by their bytes."""
    if not isinstance(shape, MeshShape):
        filled = getattr(shape, "medium", None) is not None or getattr(shape, "priority", 0) != 0
        return shape.model_copy(update={"medium": None, "priority": 0}) if filled else shape
    return tuple(digest(getattr(shape, name)) for name in MESH_FIELDS)


def digest(value: Any) -> Hashable:
    if not isinstance(value, np.ndarray):
        return value  # type: ignore[no-any-return]
    data = np.ascontiguousarray(value).data
    return value.shape, value.dtype.str, hashlib.blake2b(data, digest_size=16).digest()


def lasting(reference: str | None) -> bool:
    """True if a reference always names the same bytes: an asset's id does, a path does not."""
    return reference is None or reference.startswith("sha256:")
