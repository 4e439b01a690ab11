"""What the scenes of all streams take as JSON values, within one bound: merge patches can add to them for ever."""

from __future__ import annotations

import threading
import weakref

from service.config import MIB
from service.problems import TooLarge
from service.system.memory import MemoryBudget
from service.system.shares import Shares
from service.system.turns import CALLER

EACH = 8  # one stream may take an eighth of it


class StreamMemory:
    """Counts the bytes of each holder for as long as it lives, in shares of the callers. For any thread."""

    def __init__(self, most: int, budget: MemoryBudget | None = None) -> None:
        self.each = most // EACH
        self._budget = budget or MemoryBudget()
        self._most = most
        self._held: weakref.WeakKeyDictionary[object, tuple[str, int]] = weakref.WeakKeyDictionary()
        self._lock = threading.Lock()

    def hold(self, holder: object, size: int) -> None:
        """Count `holder` with that many bytes of the present caller's from now on.

        As before where it raises TooLarge, TooManyRequests or Unavailable.
        """
        if size > self.each:
            allowed = f"the {self.each / MIB:g} MiB of memory allowed (SUNBOX_MAX_STREAM_MEMORY)"
            raise TooLarge(f"This scene takes more than {allowed}: big geometry goes through assets.")
        with self._lock:
            caller, before = self._held.get(holder, (CALLER.get(), 0))
            shares = Shares(self._most, "scenes of streams (SUNBOX_MAX_STREAM_MEMORY)")
            for other, bytes in self._held.values():
                shares.count(other, bytes)
            if size > before:
                shares.check(caller, size - before)
            self._held[holder] = caller, size
        try:
            self._budget.hold("documents", holder, size)
        except BaseException:
            with self._lock:
                self._held[holder] = caller, before
            raise

    def release(self, holder: object) -> None:
        with self._lock:
            self._held.pop(holder, None)
        self._budget.release(holder)
