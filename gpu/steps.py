"""Work that is done in steps, between which others have their turn."""

from __future__ import annotations

from collections.abc import Generator
from typing import Generic, TypeVar

T = TypeVar("T")


class Steps(Generic[T]):
    """Drives a generator, a step for each of its yields, to the value that it returns."""

    def __init__(self, generator: Generator[None, None, T]) -> None:
        self._generator = generator

    def step(self) -> T | None:
        """Do one step: the value with the last one, None before. Raises what the work raises."""
        try:
            next(self._generator)
        except StopIteration as end:
            value: T = end.value
            return value
        return None

    def finish(self) -> T:
        """Do all steps that are left. For work whose value is not None."""
        while (value := self.step()) is None:
            pass
        return value

    def close(self) -> None:
        """Give up; the generator's `finally` clauses run."""
        self._generator.close()
