"""Has animations written by a process of their own, which may take minutes and is ended when nobody waits for it."""

from __future__ import annotations

import subprocess
import sys
import threading
from pathlib import Path
from typing import BinaryIO

from service.formats.images.animation import AnimationFormat
from service.system.child_processes import ROOT, inherited_environment

MIB = 1 << 20
# What the process takes, in bytes: itself; for each pixel of one picture, which AVIF's encoder has several times; and
# for each pixel of all pictures, which the encoders of WebP and AVIF have compressed, twice at the end.
PROCESS_BYTES, PICTURE_PIXEL_BYTES, PIXEL_BYTES = 40 * MIB, 48, 1
# Its bound is so much higher: address space that is no memory, as the stacks of an encoder's threads.
SLACK = 1024 * MIB


def most_memory(size: tuple[int, int], pictures: int) -> int:
    """About the bytes of memory that writing an animation takes."""
    pixels = size[0] * size[1]
    return PROCESS_BYTES + pixels * (PICTURE_PIXEL_BYTES + pictures * PIXEL_BYTES)


class Animator:
    """Writes one animation from pictures that lie one after the other in the file `spool`, as `Frames` reads them."""

    def __init__(
        self, spool: Path, size: tuple[int, int], pictures: int, format: AnimationFormat, fps: float
    ) -> None:
        self._spool, self._size, self._format, self._fps = spool, size, format, fps
        self._memory = SLACK + most_memory(size, pictures)
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._stopped = False

    def write(self, file: BinaryIO) -> None:
        """Waits for the process. Raises OSError where that failed, or was stopped."""
        into = file.fileno()
        numbers = (*self._size, self._format, self._fps, into, self._memory)
        with self._lock:
            if self._stopped:
                raise OSError("nobody waits for this animation any more")
            self._process = subprocess.Popen(
                [sys.executable, "-m", "service.formats.images.animation_main", str(self._spool), *map(str, numbers)],
                cwd=ROOT, env=inherited_environment(), pass_fds=[into],
                stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
            )  # fmt: skip
        with self._process as process:
            assert process.stderr is not None
            said = process.stderr.read().decode(errors="replace").strip()
            if process.wait():
                raise OSError(f"the animation could not be written: {said.splitlines()[-1] if said else 'ended'}")

    def stop(self) -> None:
        """End it, if it is not done. For any thread."""
        with self._lock:
            self._stopped = True
            if self._process is not None:
                self._process.kill()
