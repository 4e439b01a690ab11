"""The services that all tasks of a process share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf
from typing import TYPE_CHECKING

from service.ipc.messages import FromRenderer
from service.worker.device.memory import UNLIMITED, DeviceMemory
from service.worker.helpers.compile_client import CompileClient
from service.worker.helpers.denoise_client import DenoiseClient
from service.worker.helpers.first_look_client import FirstLookClient

if TYPE_CHECKING:
    from gpu import Renderer


def _unlimited() -> DeviceMemory:
    return DeviceMemory(UNLIMITED, list)


@dataclass(frozen=True)
class WorkerContext:
    """With only what has no default it is the command line's: one task, whose kernels are compiled where they are
    used, and whose picture nobody else keeps."""

    renderer: Renderer
    send: Callable[[FromRenderer], None]
    denoiser: DenoiseClient
    compiler: CompileClient | None = None  # None: kernels are compiled in the task's own turn
    first_looks: FirstLookClient | None = None  # None: what waits for its kernel is shown by superset kernels alone
    memory: DeviceMemory = field(default_factory=_unlimited)
    # Lets go of a task, by its number: the server keeps the pictures of renders and can bring them back. With it Done
    # and a Checkpoint every `checkpoint_s` seconds bring the picture of a render to the server.
    forget: Callable[[int], None] | None = None
    checkpoint_s: float = inf
    # The number of equal shares that the device is parted into for a task of a client.
    sharers: Callable[[str], int] = lambda client: 1
