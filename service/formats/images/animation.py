"""Pictures one after the other: APNG, WebP, GIF and AVIF by Pillow, MP4 by the system's ffmpeg.

Whatever their number, one picture is in memory at a time, and compressed ones. Pillow writes WebP and AVIF so from an
image that has all pictures as its frames. For APNG and GIF it would collect all of them; there each picture is
compressed by Pillow as a file of its own, whose parts are put into the animation's.

No wheel with an encoder for MP4 is a dependency: those that there are hold code under the GPL.
"""

from __future__ import annotations

import io
import shutil
import struct
import subprocess
import sys
import threading
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO, Literal, get_args

from PIL import Image

from service.system.child_processes import ROOT, inherited_environment

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
_OPTIONS: dict[AnimationFormat, dict[str, Any]] = {
    "webp": {"quality": QUALITY, "method": 4, "minimize_size": False},
    "avif": {"quality": QUALITY, "speed": 8},
}
PNG_HEAD, GIF_HEAD = 8, 13  # bytes before the first chunk; before the table of colours
FOR_EVER = b"\x21\xff\x0bNETSCAPE2.0\x03\x01\x00\x00\x00"  # GIF's extension that repeats it


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


class Frames(Image.Image):
    """Pictures of one size, RGB, one after the other in a file without a head; one of them is in memory."""

    def __init__(self, path: Path, size: tuple[int, int]) -> None:
        super().__init__()
        self._file = path.open("rb")
        self._bytes = 3 * size[0] * size[1]
        self._at = -1
        self.n_frames = path.stat().st_size // self._bytes
        self.is_animated = self.n_frames > 1
        self.im = Image.new("RGB", size).im
        self._mode, self._size = "RGB", size
        self.seek(0)

    def seek(self, frame: int) -> None:
        """Raises EOFError behind the last one, as Pillow's images do."""
        if frame >= self.n_frames:
            raise EOFError
        if frame != self._at:
            self._file.seek(frame * self._bytes)
            self.frombytes(self._file.read(self._bytes))
            self._at = frame

    def tell(self) -> int:
        return self._at

    def __iter__(self) -> Iterator[Image.Image]:
        for frame in range(self.n_frames):
            self.seek(frame)
            yield self

    def close(self) -> None:
        self._file.close()


def write(path: Path, frames: Frames, format: AnimationFormat, fps: float) -> None:
    """Write frames that repeat for ever (MP4: as the player likes). Raises NoEncoder, OSError."""
    if format == "mp4":
        _write_mp4(path, frames, fps)
    elif format in _OPTIONS:
        options = _OPTIONS[format]
        frames.save(path, format, save_all=True, duration=round(1000 / fps), loop=0, **options)
    else:
        with path.open("wb") as file:
            (_write_apng if format == "apng" else _write_gif)(file, frames, fps)


def _write_apng(file: BinaryIO, frames: Frames, fps: float) -> None:
    """A PNG file with more pictures in chunks of their own [PNG 3rd edition, 2025, 11.3.6]."""
    number = 0  # of the next chunk that is counted
    for at, frame in enumerate(frames):
        chunks = list(_png_chunks(_alone(frame, "PNG", compress_level=6)))
        if at == 0:
            file.write(b"\x89PNG\r\n\x1a\n" + _chunk(*chunks[0]))
            file.write(_chunk(b"acTL", struct.pack(">II", frames.n_frames, 0)))
        shown = struct.pack(">IIIIIHHBB", number, *frames.size, 0, 0, round(1000 / fps), 1000, 0, 0)
        file.write(_chunk(b"fcTL", shown))
        number += 1
        for kind, data in chunks:
            if kind == b"IDAT" and at == 0:
                file.write(_chunk(kind, data))
            elif kind == b"IDAT":
                file.write(_chunk(b"fdAT", struct.pack(">I", number) + data))
                number += 1
    file.write(_chunk(b"IEND", b""))


def _png_chunks(png: bytes) -> Iterator[tuple[bytes, bytes]]:
    at = PNG_HEAD
    while at < len(png):
        size, kind = struct.unpack_from(">I4s", png, at)
        yield kind, png[at + 8 : at + 8 + size]
        at += 12 + size


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _write_gif(file: BinaryIO, frames: Frames, fps: float) -> None:
    """Each picture has a table of colours of its own [GIF89a, 1990, 20 and 23]."""
    shown = max(round(100 / fps), 2)  # hundredths of a second: browsers slow down shorter ones
    for at, frame in enumerate(frames):
        gif = _alone(frame, "GIF", optimize=False, interlace=0)
        table = 3 << ((gif[10] & 7) + 1)  # bytes of its colours
        image = gif.index(b"\x2c", GIF_HEAD + table)  # its descriptor; no extension is before it
        if at == 0:
            file.write(b"GIF89a" + gif[6:10] + b"\x70\x00\x00" + FOR_EVER)
        file.write(struct.pack("<4sHxx", b"\x21\xf9\x04\x04", shown))
        file.write(gif[image : image + 9] + bytes([0x80 | gif[10] & 7]) + gif[GIF_HEAD : GIF_HEAD + table])
        file.write(gif[image + 10 : -1])
    file.write(b"\x3b")


def _alone(frame: Image.Image, format: str, **options: Any) -> bytes:
    """A file with this picture alone."""
    with io.BytesIO() as file:
        frame.save(file, format, **options)
        return file.getvalue()


def _write_mp4(path: Path, frames: Frames, fps: float) -> None:
    """H.264 with 4:2:0, which every browser plays; an odd width or height gets a black line more."""
    source = [
        "-f",
        "rawvideo",
        "-pix_fmt",
        "rgb24",
        "-s",
        f"{frames.width}x{frames.height}",
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
    # The file may be a descriptor's, which ffmpeg needs, too.
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE, close_fds=False) as process:
        assert process.stdin is not None and process.stderr is not None
        try:
            for frame in frames:
                process.stdin.write(frame.tobytes())
            process.stdin.close()
        except BrokenPipeError:
            pass  # what it says tells why
        said = process.stderr.read().decode(errors="replace").strip()
        if process.wait():
            raise OSError(
                f"ffmpeg could not write the animation: {said.splitlines()[-1] if said else 'no reason given'}"
            )


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
    """Writes one animation in a process of its own, which may take minutes and is ended when nobody waits for it:
    from pictures that lie one after the other in the file `spool`, as `Frames` reads them."""

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
