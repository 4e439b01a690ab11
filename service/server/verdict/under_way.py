"""How far comparisons are, while they are made."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from service.server.verdict.comparison import Told


class UnderWay:
    """The comparisons that are made, by owner and by the name that each was given. For the event loop alone."""

    def __init__(self) -> None:
        self._samples: dict[tuple[str, str], tuple[int, int]] = {}

    @contextmanager
    def told(self, owner: str, name: str | None) -> Iterator[Told]:
        """What a comparison calls as it goes on. Without a name nobody asks; of two with one the later counts."""
        key = (owner, name or "")

        def tell(taken: int, most: int) -> None:
            if name is not None:
                self._samples[key] = taken, most

        try:
            yield tell
        finally:
            self._samples.pop(key, None)

    def samples(self, owner: str, name: str) -> tuple[int, int] | None:
        """Those of each pixel that are taken, and those that may be taken at most; None where none is under way."""
        return self._samples.get((owner, name))
