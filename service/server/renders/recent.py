"""What each client had of the slots within the last minute, and which owners had any."""

from __future__ import annotations

import time
from collections import Counter, deque
from collections.abc import Callable
from dataclasses import dataclass

from service.server.renders.preemption import Render

RECENT_S = 60.0  # for which a turn at a slot counts after its end


@dataclass(frozen=True)
class _Turn:
    ended: float
    owner: str
    client: str
    ms: int  # for which it was rendered; whole ones, whose sums lose nothing


class Recent:
    """For the event loop."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._began: dict[Render, float] = {}  # of those that run: for how long each had been rendered before
        self._turns: deque[_Turn] = deque()  # those that ended within the last minute, the first one first
        self._counts: Counter[str] = Counter()  # of these, by owner
        self._ms: Counter[str] = Counter()  # of these, by client

    def begins(self, render: Render) -> None:
        """A render has a slot from now on."""
        self._began[render] = render.elapsed_s

    def ends(self, render: Render) -> None:
        """A render has given its slot back."""
        ms = max(0, round(1000 * (render.elapsed_s - self._began.pop(render))))
        turn = _Turn(self._clock(), render.owner, render.client, ms)
        self._turns.append(turn)
        self._counts[turn.owner] += 1
        self._ms[turn.client] += ms

    @property
    def owners(self) -> set[str]:
        """Those whose turns ended within the last minute."""
        self._expire()
        return set(self._counts)

    def seconds(self, client: str) -> float:
        """For how long the renders of a client were rendered in turns that ended within the last minute."""
        self._expire()
        return self._ms[client] / 1000

    def _expire(self) -> None:
        while self._turns and self._turns[0].ended <= self._clock() - RECENT_S:
            turn = self._turns.popleft()
            self._counts[turn.owner] -= 1
            if not self._counts[turn.owner]:
                del self._counts[turn.owner]
            self._ms[turn.client] -= turn.ms
            if not self._ms[turn.client]:
                del self._ms[turn.client]
