"""Pauses Python's cyclic garbage collector for work that makes many objects and keeps them.

While the number of objects grows it looks through all of them again and again, and stops all threads meanwhile for
tenths of a second: a third of the time of an import of 60 000 nodes.
"""

from __future__ import annotations

import gc
import threading
from collections.abc import Iterator
from contextlib import contextmanager

_lock = threading.Lock()
_pauses = 0  # under way, in any thread
_was_enabled = False


def loaded() -> None:
    """Begin to collect where a program began without the collector: it has loaded what it works with.

    Those objects stay to the end, and are taken out of the collector's sight: each collection of all objects would go
    through them. Nothing happens where the collector works already.
    """
    if not gc.isenabled():
        gc.freeze()
        gc.enable()


@contextmanager
def collector_paused() -> Iterator[None]:
    """Pause the collector while the context lasts; several threads may do so at once."""
    global _pauses, _was_enabled
    with _lock:
        if _pauses == 0:
            _was_enabled = gc.isenabled()
            gc.disable()
        _pauses += 1
    try:
        yield
    finally:
        with _lock:
            _pauses -= 1
            if _pauses == 0 and _was_enabled:
                gc.enable()
