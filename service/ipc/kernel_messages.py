"""What is asked and answered about the kernel of a render."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class MeasureKernel:
    """Asks what the kernel of a render saves, to be measured when there is nothing else to do."""

    task: int


@dataclass(frozen=True)
class KernelMeasured:
    """How long a sample takes with a render's own kernel and with every feature on; or `detail` says why not."""

    task: int
    detail: str = ""
    full_compile_ms: float | None = None
    sample_s: float | None = None  # and pixel
    full_sample_s: float | None = None

    @property
    def kernel(self) -> dict[str, Any]:
        """What a render's status says of it."""
        known = self.sample_s is not None and self.full_sample_s is not None and self.full_sample_s > 0
        return {
            "saving": 1 - (self.sample_s or 0.0) / (self.full_sample_s or 1.0) if known else None,
            "saving_unknown": self.detail or None,
            "sample_s": self.sample_s,
            "full_sample_s": self.full_sample_s,
            "full_compile_ms": self.full_compile_ms,
        }
