"""The states of a task that its renderer may go back to: the last one that was seen to work, and those after it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Generic, TypeVar

MOST = 4  # states; while a renderer compiles for one, dragging a slider makes hundreds

State = TypeVar("State")


class WorkingStates(Generic[State]):
    """States by the generations with which they began, in order."""

    def __init__(self, discard: Callable[[State], None] = lambda state: None) -> None:
        """`discard` is called with each state that is forgotten."""
        self._states: list[tuple[int, State]] = []
        self._discard = discard

    def items(self) -> Iterator[tuple[int, State]]:
        """The generations and the states, the oldest first."""
        yield from self._states

    @property
    def newest(self) -> State | None:
        return self._states[-1][1] if self._states else None

    def at(self, generation: int) -> State | None:
        """The state that began with this generation, unless it was forgotten."""
        return next((state for began, state in self._states if began == generation), None)

    def push(self, generation: int, state: State) -> None:
        """Add a newer state. Of more than MOST, the first after the one that works is forgotten."""
        self._states.append((generation, state))
        if len(self._states) > MOST:
            self._forget(1)

    def works(self, generation: int) -> None:
        """The renderer was seen to work at this generation: it goes back to no state before that."""
        while len(self._states) > 1 and self._states[1][0] <= generation:
            self._forget(0)

    def keep(self, wanted: Callable[[int], bool] = lambda generation: False) -> None:
        """Forget all states but those that began with a wanted generation."""
        for at in reversed(range(len(self._states))):
            if not wanted(self._states[at][0]):
                self._forget(at)

    def _forget(self, at: int) -> None:
        self._discard(self._states.pop(at)[1])
