"""A line while a render goes on: in a terminal, or in a notebook."""

from __future__ import annotations

import sys
from typing import Any


class Line:
    """`shown`: None shows it where a person looks: a terminal, or a notebook's kernel."""

    def __init__(self, shown: bool | None) -> None:
        self._shown = _somebody_looks() if shown is None else shown
        self._bar: Any = None

    def show(self, status: dict[str, Any]) -> None:
        """Show a render's status. Where no number of samples ends it the line counts."""
        if not self._shown:
            return
        if self._bar is None:
            from tqdm.auto import tqdm

            self._bar = tqdm(total=status["settings"].get("max_samples"), unit="sample", leave=False, file=sys.stderr)
        self._bar.update(status["samples"] - self._bar.n)
        noise = status["noise"]
        self._bar.set_postfix_str(status["state"] if noise is None else f"{noise:.1%} noise")

    def show_batch(self, status: dict[str, Any]) -> None:
        """Show a batch's status."""
        if not self._shown:
            return
        if self._bar is None:
            from tqdm.auto import tqdm

            self._bar = tqdm(total=len(status["renders"]), unit="picture", leave=False, file=sys.stderr)
        counts = status["counts"]
        self._bar.update(counts["done"] + counts["failed"] + counts["cancelled"] - self._bar.n)

    def close(self) -> None:
        if self._bar is not None:
            self._bar.close()


def _somebody_looks() -> bool:
    return sys.stderr.isatty() or "ipykernel" in sys.modules
