"""Files that the commands read and write: under its final name a file is never half-written."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from service.cli import BadInput, Failed
from service.views import LOSSLESS_FORMATS, LosslessFormat


def read(path: Path) -> bytes:
    """The file's bytes. Raises BadInput, which names the file, where it cannot be read."""
    try:
        return path.read_bytes()
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        raise BadInput(f"{str(path)!r}: cannot be read: {_reason(error)}") from None


def writable(path: Path) -> Path:
    """The path to write to, with links resolved. Raises BadInput now rather than after an hour of rendering."""
    try:
        target = Path(os.path.realpath(path))
        if target.is_dir():
            raise BadInput(f"{str(path)!r}: is a folder; name a file to write")
        if not target.parent.is_dir():
            raise BadInput(f"{str(path)!r}: its folder does not exist")
    except ValueError as error:
        raise BadInput(f"{str(path)!r}: {_reason(error)}") from None
    if not os.access(target.parent, os.W_OK):
        raise BadInput(f"{str(path)!r}: its folder cannot be written to")
    return target


def picture_format(output: str) -> LosslessFormat:
    """The format that the ending of `-o` names. Raises BadInput for any other ending."""
    format = next((name for name in LOSSLESS_FORMATS if Path(output).suffix.lower() == "." + name), None)
    if format is None:
        raise BadInput(f"-o {output!r}: must end in one of {', '.join('.' + f for f in LOSSLESS_FORMATS)}")
    return format


def write(path: Path, data: bytes, lasting: bool = True) -> None:
    """Write beside `path` and rename: readers see the old file or the whole new one. Raises Failed.

    With `lasting=False` the disk is not waited for (15 ms): after a loss of power the file may be empty.
    """
    beside = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        try:
            with beside.open("wb") as file:
                file.write(data)
                file.flush()
                if lasting:
                    os.fsync(file.fileno())
            os.replace(beside, path)
        finally:
            with suppress(OSError):
                beside.unlink(missing_ok=True)
    except OSError as error:
        raise Failed(f"{str(path)!r}: cannot be written: {_reason(error)}") from None


def make_folder(path: Path) -> None:
    """Raises Failed."""
    try:
        path.mkdir(exist_ok=True)
    except OSError as error:
        raise Failed(f"{str(path)!r}: cannot be made: {_reason(error)}") from None


def _reason(error: Exception) -> str:
    return (getattr(error, "strerror", None) or str(error)).lower()
