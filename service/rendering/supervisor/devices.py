"""Which renderers the configuration asks for, and what each of them gets of the machine."""

from __future__ import annotations

from service.config import Config
from service.rendering.renderers import Place
from service.rendering.supervisor.pool import Seat
from service.rendering.supervisor.process import Options


def seats(config: Config, host_memory: int) -> list[Seat]:
    """A seat for each renderer. `host_memory`: bytes of the machine's memory that all together may hold."""
    options = Options(config.device, config.hang_s, config.gpu_memory, host_memory, config.checkpoint_s)
    return [Seat(Place("0", str(config.device or 0)), options)]
