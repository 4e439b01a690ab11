"""The limits of a queue of renders, for tests that change one of them."""

from __future__ import annotations

from service.server.renders.queue import QueueLimits
from service.server.renders.retention import Retention

LIMITS = QueueLimits(
    running=8,
    waiting=256,
    each=64,
    retention=Retention(most_renders=64, most_bytes=1 << 30, longest_s=3600.0),
    disk_bytes=None,
)
