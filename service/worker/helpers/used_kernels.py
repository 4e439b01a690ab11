"""A record of the kernels that pictures were made with on this machine, the latest last.

A new version of Sunbox or of the driver needs all of them anew: those that were used here are compiled first.
"""

from __future__ import annotations

import json
import logging
import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

from gpu import CompileError, KernelKey

MOST = 32  # kernels: a minute of LLVM's time

log = logging.getLogger(__name__)


class UsedKernels:
    """The record in a file, which other renderers of this user's may write as well: the last one has the last
    word."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._noted = set[KernelKey]()

    def note(self, key: KernelKey) -> None:
        """Put a kernel at the record's end, at its first use by this process."""
        if key in self._noted:
            return
        self._noted.add(key)
        kept = [each for each in self._read() if each != key][1 - MOST :]
        temporary = self._path.with_name(f"{self._path.name}.{os.getpid()}")
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            temporary.write_text(json.dumps([_plain(each) for each in [*kept, key]]))
            temporary.replace(self._path)
        except OSError as error:
            log.info("could not record a kernel that is used", {"error": error})

    def latest_first(self) -> Iterator[KernelKey]:
        """Those that this version of the shaders still has. To look at one takes some milliseconds."""
        return filter(_is_known, reversed(self._read()))

    def _read(self) -> list[KernelKey]:
        with suppress(OSError, ValueError, TypeError, KeyError):  # nothing is there yet, or another version wrote it
            return [_key(each) for each in json.loads(self._path.read_text())]
        return []


def _plain(key: KernelKey) -> dict[str, Any]:
    return {"entry": key.entry, "defines": dict(key.defines), "textures": key.textures}


def _key(plain: dict[str, Any]) -> KernelKey:
    textures = tuple((unit, channels, dtype, w, h) for unit, channels, dtype, w, h in plain["textures"])
    return KernelKey(tuple(plain["defines"].items()), textures, plain["entry"])


def _is_known(key: KernelKey) -> bool:
    try:
        return bool(key.text)
    except CompileError:  # the shaders have another flag now, or the file is gone
        return False
