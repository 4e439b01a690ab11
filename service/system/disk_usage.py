"""Disk usage of files: whole blocks and inodes, and not only the bytes that are in them.

A file of 70 bytes takes a block of 4 KiB: what a million of them take is not 70 MB.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

ST_BLOCK = 512  # bytes; the unit of st_blocks on Linux, whatever the file system's own blocks are
FULL_BYTES = 1 << 16  # a disk with less is full: SQLite needs some blocks to write one
FULL = "the server's disk is full"
NO_ROOM = {errno.ENOSPC, errno.EDQUOT}
BLOCK = 4096  # bytes; the blocks of ext4, XFS, Btrfs and tmpfs, unless they were made otherwise


@dataclass(frozen=True)
class Usage:
    """Bytes of blocks, and a number of files. Differences may be negative."""

    bytes: int = 0
    files: int = 0

    def __add__(self, other: Usage) -> Usage:
        return Usage(self.bytes + other.bytes, self.files + other.files)

    def __sub__(self, other: Usage) -> Usage:
        return Usage(self.bytes - other.bytes, self.files - other.files)

    def exceeds(self, limit: Usage) -> bool:
        return self.bytes > limit.bytes or self.files > limit.files


def usage(found: os.stat_result) -> Usage:
    """The usage of a file that is there."""
    return Usage(found.st_blocks * ST_BLOCK, 1)


def expected(sizes: Iterable[int]) -> Usage:
    """The usage of files that are to be written, by their sizes in bytes."""
    total = Usage()
    for size in sizes:
        total += Usage(-(-size // BLOCK) * BLOCK, 1)
    return total


def trouble(error: BaseException, folder: Path) -> str:
    """The words for callers about an error of the disk that `folder` is on, which may be full without saying so."""
    if getattr(error, "errno", None) in NO_ROOM or free(folder) < FULL_BYTES:
        return FULL
    return "the server's disk has a problem"


def free(folder: Path) -> int:
    """The bytes that are left on a folder's disk for this process; where there is no such folder, above it."""
    for each in (folder, *folder.absolute().parents):
        try:
            found = os.statvfs(each)
        except OSError:
            continue
        return found.f_bavail * found.f_frsize
    return 0
