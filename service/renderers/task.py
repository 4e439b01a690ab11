"""One task as the server has it, with all that any renderer needs in order to go on with it."""

from __future__ import annotations

from dataclasses import dataclass

from service.renderers.protocol import Listener
from service.renderers.replay_log import ReplayLog
from service.renderers.statistics import Kind


@dataclass
class Task:
    listener: Listener
    kind: Kind
    client: str
    record: ReplayLog
    resident: bool = True  # the renderer has it, or is being told
    strikes: int = 0  # renderers that it brought down
    struck_at: float = 0.0

    @property
    def active(self) -> bool:
        """True if it takes a renderer's time, as an attended stream does, and a render until it has ended."""
        return self.record.saved is None and not self.record.away
