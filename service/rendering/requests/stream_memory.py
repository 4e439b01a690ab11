"""What the scenes of all streams take as JSON values, within one bound: merge patches can add to them for ever."""

from __future__ import annotations

import threading
import weakref

from service.config import MIB
from service.memory import MemoryBudget
from service.problems import TooLarge, Unavailable

EACH = 8  # one stream may take an eighth of it
RETRY_S = 5


class StreamMemory:
    """Counts the bytes of each holder for as long as it lives. For any thread."""

    def __init__(self, most: int, budget: MemoryBudget | None = None) -> None:
        self.each = most // EACH
        self._budget = budget or MemoryBudget()
        self._most = most
        self._held: weakref.WeakKeyDictionary[object, int] = weakref.WeakKeyDictionary()
        self._lock = threading.Lock()

    def hold(self, holder: object, size: int) -> None:
        """Count `holder` with that many bytes from now on; as before where it raises TooLarge or Unavailable."""
        if size > self.each:
            allowed = f"the {self.each / MIB:g} MiB of memory allowed (SUNBOX_MAX_STREAM_MEMORY)"
            raise TooLarge(f"This scene takes more than {allowed}: big geometry goes through assets.")
        with self._lock:
            before = self._held.get(holder, 0)
            if size > before and sum(self._held.values()) - before + size > self._most:
                raise Unavailable("There is no room for this scene just now (SUNBOX_MAX_STREAM_MEMORY).", RETRY_S)
            self._held[holder] = size
        try:
            self._budget.hold("documents", holder, size)
        except BaseException:
            with self._lock:
                self._held[holder] = before
            raise

    def release(self, holder: object) -> None:
        with self._lock:
            self._held.pop(holder, None)
        self._budget.release(holder)
