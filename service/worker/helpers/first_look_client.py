"""The renderer's side of the process that shows first looks while kernels are compiled.

LLVM's unoptimised code is there in about half the time, and traces two to three times slower: too slow for a picture,
and quick enough for a small first look. The driver reads that choice from the environment, once a process, and keeps
such code apart from the other in its disk cache. So it takes a process that traces, and not only one that compiles.
"""

from __future__ import annotations

import logging
import os
import socket
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from service.ipc import channel
from service.ipc.messages import Frame, Want
from service.worker.helpers.process import HelperProcess

if TYPE_CHECKING:
    from gpu import RenderSettings, SceneArrays

UNOPTIMISED = "nopt"  # of GALLIVM_PERF, a list of words with commas [Mesa's docs, "Environment variables"]
TRIES = 3  # processes in a row that ended without a frame; then there are no first looks any more

OnFrame = Callable[[Frame], None]

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Look:
    """Asks for first looks at a scene, in place of those that the task had asked for before."""

    task: int
    generation: int
    arrays: SceneArrays
    settings: RenderSettings  # of `fallback.settings_for`


@dataclass(frozen=True)
class Wanted:
    """The frame that a task wants next."""

    task: int
    want: Want


@dataclass(frozen=True)
class Leave:
    """The task needs no first look any more."""

    task: int


class FirstLookClient:
    """Asks a process for first looks, which starts at the first request and ends when idle for a while."""

    def __init__(self, device: int | None, memory: int) -> None:
        """`memory`: bytes that the process may take beside its context."""
        words = [word for word in (os.environ.get("GALLIVM_PERF", ""), UNOPTIMISED) if word]
        given = ["--memory", str(memory), *([] if device is None else ["--device", str(device)])]
        module = "service.worker.view.first_look_main"
        self._helper = HelperProcess(module, *given, environment={"GALLIVM_PERF": ",".join(words)})
        # By task: the generation that it waits for, and what to call with its frames.
        self._on_frames: dict[int, tuple[int, OnFrame]] = {}
        self._failures = 0

    @property
    def ends(self) -> list[socket.socket]:
        """The sockets to wait on."""
        return self._helper.ends

    @property
    def process_id(self) -> int | None:
        return self._helper.process_id

    @property
    def able(self) -> bool:
        return self._failures < TRIES

    def start(self) -> None:
        """Have the process there before it is needed, as its start takes as long as half a kernel."""
        if self.able:
            try:
                self._helper.start()
            except OSError as error:
                self._lose(str(error))

    def begin(self, look: Look, on_frame: OnFrame) -> None:
        """Ask for first looks; `on_frame` gets the frames that `want` asks for."""
        self._on_frames[look.task] = look.generation, on_frame
        self._send(look)

    def want(self, task: int, want: Want) -> None:
        self._send(Wanted(task, want))

    def leave(self, task: int) -> None:
        """The task is on_frame of no frame any more."""
        if self._on_frames.pop(task, None) is not None:
            self._send(Leave(task))

    def hear(self) -> None:
        """Pass on the frames that have come."""
        while True:
            try:
                frame: Frame = self._helper.hear()
            except BlockingIOError:
                return
            except channel.Closed:
                self._ended()
                return
            self._failures = 0
            generation, on_frame = self._on_frames.get(frame.task, (None, None))
            if on_frame is not None and frame.generation == generation:
                on_frame(frame)

    def close(self) -> None:
        self._helper.close()

    def _send(self, message: Look | Wanted | Leave) -> None:
        if not self.able or (isinstance(message, Leave) and not self._helper.ends):
            return
        try:
            self._helper.ask(message)
        except (channel.Closed, OSError) as error:
            self._lose(str(error))

    def _ended(self) -> None:
        """The process has ended: because it was idle, or at a scene that it could not show."""
        code = self._helper.close()
        if self._on_frames:
            self._lose(f"its process ended with code {code}")

    def _lose(self, detail: str) -> None:
        self._helper.close()
        self._failures += 1
        self._on_frames.clear()
        log.info("no first looks at what is compiled", {"error": detail, "tries_left": TRIES - self._failures})
