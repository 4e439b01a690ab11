"""Data that several scenes read on the device, uploaded once: images, measurements, environments, tables of energy
and of displays."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Generic, Protocol, TypeVar


class Upload(Protocol):
    @property
    def bytes(self) -> int:
        """Bytes on the device."""

    def release(self) -> None: ...


class Textures(dict[int, Any]):
    """Textures by unit."""

    @property
    def bytes(self) -> int:
        return sum(_texture_bytes(texture) for texture in self.values())

    def release(self) -> None:
        for texture in self.values():
            texture.release()


class Buffer:
    """A buffer of the device, which belongs to the upload."""

    def __init__(self, buffer: Any) -> None:
        self.buffer = buffer

    @property
    def bytes(self) -> int:
        return int(self.buffer.size)

    def release(self) -> None:
        self.buffer.release()


def _texture_bytes(texture: Any) -> int:
    width, height, *depth = texture.size
    return int(width * height * (depth[0] if depth else 1) * texture.components * int(texture.dtype[1:]))


T = TypeVar("T", bound=Upload)
UNUSED_S = 1.0  # for which an upload stays that nobody uses


@dataclass(frozen=True)
class Taken(Generic[T]):
    """One use of an upload, which ends with `release`."""

    upload: T
    release: Callable[[], None]


@dataclass
class _Shared(Generic[T]):
    upload: T
    bytes: int
    users: int = 0
    left_at: float = 0.0  # when the last user left


class UploadCache(Generic[T]):
    """Uploads by a key that is equal where they are. The one that was released last stays for a moment, so that an
    edit which packs the scene anew, or the next picture of a batch, does not upload it again."""

    def __init__(self) -> None:
        self._shared: dict[str, _Shared[T]] = {}

    @property
    def bytes(self) -> int:
        """Bytes of those that are in use."""
        return sum(shared.bytes for shared in self._shared.values() if shared.users)

    @property
    def resting_bytes(self) -> int:
        """Bytes of what is kept and not in use."""
        return sum(shared.bytes for shared in self._shared.values() if not shared.users)

    def tidy(self, now: float) -> float | None:
        """Release what has not been used for long. Returns the seconds until the next call is due, or None."""
        resting = {key: now - shared.left_at for key, shared in self._shared.items() if not shared.users}
        for key in [key for key, age in resting.items() if age >= UNUSED_S]:
            self._shared.pop(key).upload.release()
            del resting[key]
        return UNUSED_S - max(resting.values()) if resting else None

    def take(self, key: str, make: Callable[[], T]) -> Taken[T]:
        """The upload of that key; without a key, one that nobody else has. Raises what `make` raises."""
        if not key:
            alone = make()
            return Taken(alone, alone.release)
        shared = self._shared.get(key)
        if shared is None:
            upload = make()
            shared = self._shared[key] = _Shared(upload, upload.bytes)
        shared.users += 1
        return Taken(shared.upload, partial(self._give_back, key))

    def release(self) -> None:
        for shared in self._shared.values():
            shared.upload.release()
        self._shared.clear()

    def _give_back(self, key: str) -> None:
        if key not in self._shared:  # the context is closed
            return
        self._shared[key].users -= 1
        if self._shared[key].users == 0:
            self._shared[key].left_at = time.monotonic()
            for other in [k for k, shared in self._shared.items() if shared.users == 0 and k != key]:
                self._shared.pop(other).upload.release()


@dataclass(frozen=True)
class SharedUploads:
    """The uploads that the scenes of one context share."""

    images: UploadCache[Textures] = field(default_factory=UploadCache)
    measured: UploadCache[Textures] = field(default_factory=UploadCache)
    environments: UploadCache[Any] = field(default_factory=UploadCache)
    tables: UploadCache[Textures] = field(default_factory=UploadCache)
    looks: UploadCache[Buffer] = field(default_factory=UploadCache)

    @property
    def bytes(self) -> int:
        return sum(cache.bytes for cache in vars(self).values())

    @property
    def resting_bytes(self) -> int:
        return sum(cache.resting_bytes for cache in vars(self).values())

    def tidy(self) -> float | None:
        """Release what has not been used for long. Returns the seconds until the next call is due, or None."""
        now = time.monotonic()
        return min((left for cache in vars(self).values() if (left := cache.tidy(now)) is not None), default=None)

    def release(self) -> None:
        for cache in vars(self).values():
            cache.release()
