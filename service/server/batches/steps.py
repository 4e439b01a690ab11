"""What a batch knows of each of its renders, a byte each, whether that is in memory or a row of the store."""

from __future__ import annotations

from collections.abc import Iterator

from service.server.renders.store.record import ENDED, End

_NOT_MADE, _UNDER_WAY, _FIRST_END = 0, 1, 2  # codes; from the last one on how it ended


class Steps:
    """For the event loop, but for `copy`, which is its caller's."""

    def __init__(self, codes: bytes) -> None:
        self._codes = bytearray(codes)
        self.made = self.ended = 0  # how many
        self.last_end = 0.0  # by the monotonic clock
        self.busy_s, self.measured = 0.0, 0  # seconds that renders took which ended here, setup included

    @classmethod
    def of(cls, count: int) -> Steps:
        """So many renders, none of which is made."""
        return cls(bytes(count))

    def copy(self) -> Steps:
        """As they are now."""
        return Steps(bytes(self._codes))

    def make(self, step: int) -> None:
        """A render waits, or runs."""
        self._codes[step] = _UNDER_WAY
        self.made += 1

    def end(self, step: int, how: End, ended_at: float) -> None:
        """A render that was made has ended."""
        self._codes[step] = _FIRST_END + ENDED.index(how)
        self.ended += 1
        self.last_end = max(self.last_end, ended_at)

    def is_made(self, step: int) -> bool:
        return self._codes[step] != _NOT_MADE

    def is_under_way(self, step: int) -> bool:
        return self._codes[step] == _UNDER_WAY

    def how(self, step: int) -> End:
        """How a render that has ended did so."""
        return ENDED[self._codes[step] - _FIRST_END]

    def that(self, how: End) -> list[int]:
        """Those that ended so, in order."""
        code = _FIRST_END + ENDED.index(how)
        return [step for step, each in enumerate(self._codes) if each == code]

    def that_are_made(self) -> Iterator[int]:
        return (step for step, each in enumerate(self._codes) if each != _NOT_MADE)
