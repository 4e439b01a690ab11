"""Plain counters of the renderer and its clients since the server began, for /metrics.

Everything is changed on the event loop and read there. A `Counter` is by label.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter, defaultdict
from dataclasses import dataclass, field
from itertools import accumulate
from typing import Literal

from service.system.shares import key_label

Kind = Literal["stream", "render", "bsdf", "server"]  # whose work: a stream's, a render's, a lobe's, the server's own

SECONDS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 30.0)


@dataclass
class Distribution:
    """A histogram: how many values were at most each of `bounds` or above them all, their number and their sum."""

    bounds: tuple[float, ...] = SECONDS
    counts: list[int] = field(default_factory=list)
    count: int = 0
    total: float = 0.0

    def __post_init__(self) -> None:
        self.counts = [0] * (len(self.bounds) + 1)

    def add(self, value: float) -> None:
        self.counts[bisect_left(self.bounds, value)] += 1
        self.count += 1
        self.total += value

    def cumulative(self) -> list[tuple[float, int]]:
        """(bound, how many values are at most that), as Prometheus has its buckets."""
        return list(zip(self.bounds, accumulate(self.counts), strict=False))


@dataclass
class ClientStatistics:
    """Counters of frames and errors, whichever renderer they came from."""

    first_frame_s: Distribution = field(default_factory=Distribution)  # from an update to its first frame
    frames: int = 0
    frame_bytes: int = 0
    errors: Counter[str] = field(default_factory=Counter)  # told on streams and of failed renders, by problem type


@dataclass(frozen=True)
class RendererLoad:
    """The renderer's tasks and memory now."""

    tasks: int = 0
    bytes: int = 0  # of theirs, on the device
    resting_bytes: int = 0  # more of the machine's memory, that is kept for a moment
    kernels: int = 0  # compiled ones


@dataclass
class Statistics(ClientStatistics):
    """One renderer's, which may be the only one, and then its clients' too."""

    restarts: Counter[str] = field(default_factory=Counter)  # of the renderer: by process.Cause
    recovery_s: Distribution = field(default_factory=Distribution)  # from a renderer's loss to the next one ready
    checkpoints: int = 0  # of renders, against such losses
    leases: Counter[str] = field(default_factory=Counter)  # it traced for other renderers: given, done, failed, wrong
    gpu_s: dict[Kind, float] = field(default_factory=lambda: defaultdict(float))
    gpu_s_by_key: dict[str, float] = field(default_factory=lambda: defaultdict(float))  # by `key_label`
    gpu_s_of: dict[int, float] = field(default_factory=lambda: defaultdict(float))  # by task, while it is there
    samples: int = 0  # of pixels, traced
    compile_s: Distribution = field(default_factory=Distribution)  # kernels that were not in memory
    kernels_found: int = 0  # ... and loads that found theirs there
    setup_s: Distribution = field(default_factory=Distribution)  # uploading and compiling, a load
    load: RendererLoad = field(default_factory=RendererLoad)
    kernels_evicted: int = 0

    def worked(self, kind: Kind, client: str, seconds: float) -> None:
        """Count GPU time that a task of this kind and client has used."""
        self.gpu_s[kind] += seconds
        if key := key_label(client):
            self.gpu_s_by_key[key] += seconds
