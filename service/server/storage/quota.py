"""Bounds the data folder by its quota: the longest unused assets are deleted, never those in use.

Pictures of renders that the database does not know are deleted before them.
"""

from __future__ import annotations

import asyncio
import logging
import os
import threading
import time
from collections import Counter
from collections.abc import AsyncIterator, Callable, Collection, Iterable, Iterator
from contextlib import AbstractContextManager, asynccontextmanager, contextmanager
from functools import partial
from pathlib import Path

from service.problems import TooLarge, Unavailable
from service.server.assets.folder import AssetFolder, total
from service.server.storage.lost_pictures import LostPictures
from service.system.disk_usage import Usage
from service.system.executors import opening

log = logging.getLogger(__name__)

RETRY_S = 60
RESERVE_BYTES = 64 << 20  # reserved for small renders, where the quota is full otherwise
RESERVE_PART = 16  # the share of a small quota that is reserved: a sixteenth
FRESH_S = 3600.0  # how long an upload may wait for the render or the document that refers to it


class QuotaUsedUp(Unavailable):
    """There is no room, and no asset may be deleted."""


def reserve_bytes(limit: int) -> int:
    """The bytes of a quota that are reserved, in whole MiB."""
    return min(RESERVE_BYTES, limit // RESERVE_PART >> 20 << 20)


class Quota:
    """Bounds the assets in `folder` together with what `others` take, `lost` included.

    `in_use` is a context with the ids of the assets that must stay; no other asset comes into use while it lasts.
    """

    def __init__(
        self,
        folder: Path,
        limit: Usage,
        in_use: Callable[[], AbstractContextManager[set[str]]],
        others: Callable[[], Usage] = Usage,
        lost: LostPictures | None = None,
        gone: Callable[[list[str]], None] = lambda ids: None,
        owned: Callable[[], Iterable[tuple[str, str, int]]] = tuple,
        reserve: int = 0,
    ) -> None:
        """`gone` is called with the ids of deleted assets, after all locks are released. `owned` lists uploads:
        owner, id and bytes. `reserve`: bytes that only `room(reserved=True)` gives away."""
        self._files = AssetFolder(folder / "assets")
        self._limit = limit
        self._in_use = in_use
        self._others = others
        self._lost = lost
        self._gone = gone
        self._owned = owned
        self._reserve = Usage(reserve)
        self._lock = threading.Lock()
        self._pending = Usage()  # what is about to be stored
        self._pinned: Counter[str] = Counter()  # how many contexts keep each id

    @contextmanager
    def room(self, size: Usage, reserved: bool = False) -> Iterator[None]:
        """A context in which `size` more can be stored; assets are deleted for it. With `reserved` the reserve
        counts.

        Raises TooLarge for what never fits, QuotaUsedUp where too many assets are in use, Unavailable where the disk
        fails; nothing is deleted then.
        """
        if size.bytes > self._limit.bytes:
            most = self._limit.bytes
            raise TooLarge(f"{size.bytes} bytes are more than all assets may take: {most} (SUNBOX_DATA_QUOTA)")
        if size.files > self._limit.files:
            most = self._limit.files
            raise TooLarge(f"{size.files} files are more than there may be: {most} (SUNBOX_DATA_FILES)")
        with self._lock:
            try:
                self._make_room(size, Usage() if reserved else self._reserve)
            except OSError as error:
                log.error("could not make room", {"error": error})
                raise Unavailable(f"room could not be made: {os.strerror(error.errno or 0)}", RETRY_S) from None
            self._pending += size
        try:
            yield
        finally:
            with self._lock:
                self._pending -= size

    @asynccontextmanager
    async def making(self, size: Usage) -> AsyncIterator[None]:
        """A context in which `size` more is on the disk for a while, as `room` has it, for the event loop."""
        room = self.room(size)
        entering = asyncio.ensure_future(opening(room.__enter__))
        try:
            await asyncio.shield(entering)
            yield
        finally:  # also where the caller was cancelled while a thread made room
            await asyncio.wait({entering})
            if entering.exception() is None:
                await opening(partial(room.__exit__, None, None, None))

    @contextmanager
    def pinned(self, ids: Collection[str]) -> Iterator[None]:
        """A context in which these assets are not deleted."""
        with self._lock:
            self._pinned.update(ids)
        try:
            yield
        finally:
            with self._lock:
                self._pinned -= Counter(ids)

    def sizes(self, ids: Collection[str]) -> dict[str, int]:
        """The bytes of each of these assets that exists."""
        return {f"sha256:{hash}": asset.usage.bytes for hash, asset in self._files.assets_of(ids).items()}

    def evict(self, ids: Collection[str], size: int) -> list[str]:
        """Delete those of these assets that are not in use, those unused longest first, until `size` bytes are free.
        Returns the ids of the deleted ones."""
        goes = []
        with self._lock, self._in_use() as in_use, self._files.locked():
            assets = self._files.assets_of(set(ids) - set(in_use) - self._pinned.keys())
            for hash in sorted(assets, key=lambda hash: assets[hash].used):
                if size <= 0:
                    break
                size -= assets[hash].usage.bytes
                self._files.delete(hash)
                log.info("asset evicted", {"id": f"sha256:{hash}", "bytes": assets[hash].usage.bytes})
                goes.append(f"sha256:{hash}")
        self._say_gone(goes)
        return goes

    def used(self) -> Usage:
        return self._others() + self._files.usage()

    def clear(self) -> None:
        """Delete the leftovers of a crash, and count the assets."""
        self._files.clear()
        try:
            self._files.recount()
        except OSError as error:
            log.warning("could not count the assets", {"error": error})

    def _make_room(self, size: Usage, reserve: Usage) -> None:
        most = self._limit - reserve - self._pending - size
        if not self.used().exceeds(most):
            return
        self._files.clear()
        owned = list(self._owned())
        with self._in_use() as in_use, self._files.locked():
            assets = self._files.count()
            left = self._others() + total(assets)
            lost = []
            for name, takes in (self._lost.spare() if self._lost else {}).items():
                if not left.exceeds(most):
                    break
                left -= takes
                lost.append(name)
            stays = {id.removeprefix("sha256:") for id in (*in_use, *self._pinned)}
            fresh = {hash for hash, asset in assets.items() if time.time_ns() - asset.used < FRESH_S * 1e9}
            stays |= fresh & {id.removeprefix("sha256:") for id in self._within_share(owned)}
            goes = []
            for hash in sorted(assets.keys() - stays, key=lambda hash: assets[hash].used):
                if not left.exceeds(most):
                    break
                left -= assets[hash].usage
                goes.append(hash)
            if left.exceeds(most):
                name = "SUNBOX_DATA_QUOTA" if left.bytes > most.bytes else "SUNBOX_DATA_FILES"
                detail = (
                    f"The disk quota is used up by documents, renders, what they refer to, and new uploads ({name})."
                )
                raise QuotaUsedUp(detail, RETRY_S)
            for name in lost:
                assert self._lost is not None
                self._lost.delete(name)
                log.info("a picture that no render has made room", {"name": name})
            for hash in goes:
                self._files.delete(hash)
                log.info("asset evicted", {"id": f"sha256:{hash}", "bytes": assets[hash].usage.bytes})
        self._say_gone([f"sha256:{hash}" for hash in goes])

    def _within_share(self, owned: Collection[tuple[str, str, int]]) -> set[str]:
        """The ids of the uploads of owners that take no more than their share of the quota."""
        sizes = Counter[str]()
        for owner, _, size in owned:
            sizes[owner] += size
        share = self._limit.bytes // (len(sizes) + 1)
        return {id for owner, id, _ in owned if sizes[owner] <= share}

    def _say_gone(self, ids: list[str]) -> None:
        if ids:
            try:
                self._gone(ids)
            except Unavailable as error:  # they are deleted all the same
                log.warning("could not note which assets were deleted", {"error": error})
