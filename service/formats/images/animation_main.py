"""The process that writes an animation:
`python -m service.formats.images.animation_main SPOOL WIDTH HEIGHT FORMAT FPS INTO MEMORY`.

SPOOL has the pictures, as `Frames` reads them. INTO is the descriptor of the file that is written, MEMORY how many
bytes the process may take beside what it has. Its standard input is a pipe whose other end the server holds: it ends
with the server, and is as nice as the thread that starts it.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import get_args

from service.formats.images import animation
from service.formats.images.animation import AnimationFormat, Frames
from service.system.confined import bound
from service.system.lifeline import end_with_pipe

SECONDS = 24 * 3600.0  # of processor time: the server ends it when nobody waits for it any more


def main() -> int:
    spool, width, height, format, fps, into, memory = sys.argv[1:]
    if not end_with_pipe(0):
        return 1
    formats: dict[str, AnimationFormat] = {each: each for each in get_args(AnimationFormat)}
    frames = Frames(Path(spool), (int(width), int(height)))
    if format != "mp4":  # ffmpeg's threads would count as well
        bound(int(memory), SECONDS)
    try:
        animation.write(Path(f"/dev/fd/{into}"), frames, formats[format], float(fps))
    except (OSError, MemoryError, animation.NoEncoder) as error:
        sys.stderr.write(f"{type(error).__name__}: {error}")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
