"""Long work in steps, between which the caller may do something else."""

from __future__ import annotations

from collections.abc import Generator
from typing import Generic, TypeVar

T = TypeVar("T")


class Steps(Generic[T]):
    """Drives a generator to the value that it returns, one yield at a step."""

    def __init__(self, generator: Generator[None, None, T]) -> None:
        self._generator = generator

    def step(self) -> T | None:
        """Do one step. The last one returns the value, all before it None. Raises what the work raises."""
        try:
            next(self._generator)
        except StopIteration as end:
            value: T = end.value
            return value
        return None

    def finish(self) -> T:
        """Do all steps that are left, for work whose value is not None."""
        while (value := self.step()) is None:
            pass
        return value

    def close(self) -> None:
        """Abandon the work; the generator's `finally` clauses run."""
        self._generator.close()
