"""The bytes of an asset: in memory, or in a file, which need not be read into the service's memory."""

from __future__ import annotations

import hashlib
import mmap
import os
import shutil
from typing import BinaryIO

from service.formats.formats import advice, sniff

Source = bytes | memoryview | BinaryIO  # a file has been written in full


def length(source: Source) -> int:
    return len(source) if isinstance(source, bytes | memoryview) else os.fstat(source.fileno()).st_size


def digest(source: Source) -> str:
    """SHA-256, in hexadecimal digits."""
    if isinstance(source, bytes | memoryview):
        return hashlib.sha256(source).hexdigest()
    source.seek(0)
    return hashlib.file_digest(source, "sha256").hexdigest()  # type: ignore[arg-type]  # typeshed: readinto is there


def format_of(source: Source, content_type: str | None = None, filename: str | None = None) -> str | None:
    """As `sniff`."""
    if isinstance(source, bytes | memoryview):
        return sniff(bytes(source), content_type, filename)
    with mmap.mmap(source.fileno(), 0, access=mmap.ACCESS_READ) as view:
        return sniff(view, content_type, filename)


def unreadable(source: Source, filename: str | None) -> str | None:
    """As `advice`."""
    if isinstance(source, bytes | memoryview):
        return advice(bytes(source[:64]), filename)
    return advice(os.pread(source.fileno(), 64, 0), filename)


def for_sandbox(source: Source) -> bytes | int:
    """The bytes or the descriptor, for `Sandbox.parse`."""
    if isinstance(source, bytes | memoryview):
        return bytes(source)
    return source.fileno()


def write(source: Source, file: BinaryIO) -> None:
    if isinstance(source, bytes | memoryview):
        file.write(source)
    else:
        source.seek(0)
        shutil.copyfileobj(source, file, 1 << 20)
