"""Room on the disk: assets that were unused longest make room, never those that a saved document refers to."""

from __future__ import annotations

import logging
import os
import threading
from collections import Counter
from collections.abc import Callable, Collection, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

from service.assets.folder import AssetFolder
from service.problems import TooLarge, Unavailable

log = logging.getLogger(__name__)

RETRY_S = 60


class Quota:
    """Bounds the assets in `folder` together with `others` bytes beside them.

    `in_use` gives the ids of the assets that must stay; while its context lasts no other asset becomes one of them.
    """

    def __init__(
        self,
        folder: Path,
        limit: int,
        in_use: Callable[[], AbstractContextManager[set[str]]],
        others: Callable[[], int] = lambda: 0,
    ) -> None:
        self._files = AssetFolder(folder / "assets")
        self._limit = limit
        self._in_use = in_use
        self._others = others
        self._lock = threading.Lock()
        self._promised = 0  # bytes that are being stored
        self._pinned: Counter[str] = Counter()  # how many contexts keep each id

    @contextmanager
    def room(self, size: int) -> Iterator[None]:
        """Room for `size` more bytes, which are to be stored while the context lasts. Deletes assets for it.

        Raises TooLarge for what could never be, Unavailable where too much must stay; nothing is deleted then.
        """
        if size > self._limit:
            raise TooLarge(f"{size} bytes are more than all assets may take: {self._limit} (SUNBOX_DATA_QUOTA)")
        with self._lock:
            try:
                self._make_room(size)
            except OSError as error:
                log.error("could not make room error=%s", error)
                raise Unavailable(f"room could not be made: {os.strerror(error.errno or 0)}", RETRY_S) from None
            self._promised += size
        try:
            yield
        finally:
            with self._lock:
                self._promised -= size

    @contextmanager
    def pinned(self, ids: Collection[str]) -> Iterator[None]:
        """Keep these assets, as far as they are there, while the context lasts."""
        with self._lock:
            self._pinned.update(ids)
        try:
            yield
        finally:
            with self._lock:
                self._pinned -= Counter(ids)

    def used(self) -> int:
        """The bytes that are used."""
        return self._others() + self._files.bytes()

    def clear(self) -> None:
        """Delete what a crash left."""
        self._files.clear()

    def _make_room(self, size: int) -> None:
        most = self._limit - self._promised - size
        if self.used() <= most:
            return
        self.clear()
        with self._in_use() as in_use, self._files.alone():
            held = self._files.held()
            over = self._others() + sum(one.bytes for one in held.values()) - most
            stays = {id.removeprefix("sha256:") for id in (*in_use, *self._pinned)}
            goes = []
            for hash in sorted(held.keys() - stays, key=lambda hash: held[hash].used):
                if over <= 0:
                    break
                over -= held[hash].bytes
                goes.append(hash)
            if over > 0:
                detail = "The disk quota is used up by saved documents and what they refer to (SUNBOX_DATA_QUOTA)."
                raise Unavailable(detail, RETRY_S)
            for hash in goes:
                self._files.delete(hash)
                log.info("asset evicted id=sha256:%s bytes=%d", hash, held[hash].bytes)
