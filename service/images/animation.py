"""Pictures one after the other: APNG, WebP, GIF and AVIF by Pillow, MP4 by the system's ffmpeg.

No wheel with an encoder for MP4 is a dependency: those that there are hold code under the GPL.
"""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterable, Iterator
from itertools import chain
from pathlib import Path
from typing import Any, Literal, get_args

from PIL import Image

AnimationFormat = Literal["apng", "webp", "gif", "avif", "mp4"]
FORMATS: tuple[AnimationFormat, ...] = get_args(AnimationFormat)
MIME: dict[AnimationFormat, str] = {
    "apng": "image/apng",
    "webp": "image/webp",
    "gif": "image/gif",
    "avif": "image/avif",
    "mp4": "video/mp4",
}
QUALITY = 90
_PILLOW: dict[AnimationFormat, tuple[str, dict[str, Any]]] = {
    "apng": ("PNG", {"compress_level": 6}),
    "webp": ("WEBP", {"quality": QUALITY, "method": 4, "minimize_size": False}),
    "gif": ("GIF", {"optimize": False, "disposal": 1}),
    "avif": ("AVIF", {"quality": QUALITY, "speed": 8}),
}


class NoEncoder(Exception):
    """The system has no program that writes this format."""


def encoder() -> str:
    """ffmpeg's path. Raises NoEncoder."""
    found = shutil.which("ffmpeg")
    if found is None:
        raise NoEncoder(
            "There is no ffmpeg on the server, which writes mp4: install it, or ask for webp, avif, apng or gif."
        )
    return found


def write(path: Path, frames: Iterable[Image.Image], format: AnimationFormat, fps: float) -> None:
    """Write frames of one size, RGB, which repeat for ever (MP4: as the player likes). Raises NoEncoder, OSError."""
    if format == "mp4":
        return _write_mp4(path, iter(frames), fps)
    name, options = _PILLOW[format]
    rest = iter(frames)
    first = next(rest)
    others = list(rest) if format == "apng" else rest  # Pillow goes through these twice
    shown_ms = 1000.0 / fps
    duration = (
        max(round(shown_ms / 10) * 10, 20) if format == "gif" else round(shown_ms)
    )  # browsers slow down shorter ones
    first.save(path, name, save_all=True, append_images=others, duration=duration, loop=0, **options)
    return None


def _write_mp4(path: Path, frames: Iterator[Image.Image], fps: float) -> None:
    """H.264 with 4:2:0, which every browser plays; an odd width or height gets a black line more."""
    first = next(frames)
    source = [
        "-f",
        "rawvideo",
        "-pix_fmt",
        "rgb24",
        "-s",
        f"{first.width}x{first.height}",
        "-r",
        f"{fps:g}",
        "-i",
        "-",
    ]
    coded = ["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-c:v", "libx264", "-crf", "16", "-pix_fmt", "yuv420p"]
    command = [
        encoder(),
        "-v",
        "error",
        "-nostdin",
        "-y",
        *source,
        *coded,
        "-movflags",
        "+faststart",
        "-f",
        "mp4",
        str(path),
    ]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdin is not None and process.stderr is not None
        try:
            for frame in chain([first], frames):
                process.stdin.write(frame.tobytes())
            process.stdin.close()
        except BrokenPipeError:
            pass  # what it says tells why
        said = process.stderr.read().decode(errors="replace").strip()
        if process.wait():
            raise OSError(
                f"ffmpeg could not write the animation: {said.splitlines()[-1] if said else 'no reason given'}"
            )
