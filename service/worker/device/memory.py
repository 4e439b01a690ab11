"""The memory of all tasks on the device; where it is too much, those that have rested longest make room."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Protocol

from gpu import OutOfMemory
from service.system.memory import MemoryBudget

GPU_SHARE = 0.8  # of a GPU's free memory: compilers, the denoiser, drivers and desktops need some more
UNLIMITED = 1 << 62

log = logging.getLogger(__name__)


class Evictable(Protocol):
    @property
    def rested_since(self) -> float: ...

    @property
    def bytes(self) -> int: ...

    @property
    def idle(self) -> bool:
        """True if its memory on the device can be taken, and restored later."""

    def evict(self) -> None: ...


class DeviceMemory:
    """Counts the bytes that were requested from the driver, which does not say what it really takes."""

    def __init__(
        self, limit: int, holders: Callable[[], Iterable[Evictable]], shared: Callable[[], int] = lambda: 0
    ) -> None:
        """`shared`: the bytes of what several holders have together."""
        self.limit = limit
        self._holders, self._shared = holders, shared

    @property
    def used(self) -> int:
        return self._shared() + sum(holder.bytes for holder in self._holders())

    def make_room(self, needed: int, asking: Evictable) -> None:
        """Evict idle tasks, the longest at rest first, until that many bytes fit. Raises OutOfMemory."""
        while self.used + needed > self.limit and self.evict_one(asking):
            pass
        if self.used + needed > self.limit:
            raise OutOfMemory(
                f"this needs {_mib(needed)} MiB on the device; of {_mib(self.limit)} MiB (SUNBOX_GPU_MEMORY) "
                f"{_mib(self.used)} are in use"
            )

    def evict_one(self, asking: Evictable) -> bool:
        idle = [holder for holder in self._holders() if holder.idle and holder.bytes and holder is not asking]
        if not idle:
            return False
        oldest = min(idle, key=lambda holder: holder.rested_since)
        log.info("evicted", {"bytes": oldest.bytes, "used": self.used})
        oldest.evict()
        return True


def default_limit(info: Mapping[str, Any], free: int | None, host_memory: int | None) -> int:
    """Bytes, by what `gpu.Renderer.info` says and the bytes that the device has `free` as the renderer starts.

    Where the device's memory is the machine's, the kernel would kill somebody; there it is `host_memory`, by default
    half of the machine's. On a GPU it is 80 % of what others leave free, of the whole memory where the driver says
    no more than that, and there is no limit where it says neither: then its refusals are the limit.
    """
    if info["software"]:
        return host_memory or MemoryBudget().limit
    known = free or info["memory"]
    return int(GPU_SHARE * known) if known else UNLIMITED


def _mib(size: int) -> int:
    return -(-size // 2**20)
