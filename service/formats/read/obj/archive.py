"""The files of a zip. The sizes that they claim are bounded before any is unpacked, and unpacking ends at those
sizes."""

from __future__ import annotations

import io
import posixpath
import stat
import zipfile
import zlib

from service.formats.errors import ParseError
from service.formats.read.obj.paths import DRIVE

MOST_ENTRIES = 10_000
# A text of numbers is compressed to a third, that of a grid to a tenth, a zip bomb to a thousandth. The slack is for
# small files.
MOST_RATIO, SLACK = 32, 16 << 20
METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
ENCRYPTED = 0x1
UNUSED = ("__MACOSX/", ".DS_Store")  # files that programs add to a folder


class Archive:
    """The files of a zip. Raises ParseError when it is opened if an entry's name, kind or size is not allowed."""

    def __init__(self, data: bytes | memoryview, max_bytes: int) -> None:
        """`max_bytes` bounds the size of all its files together when they are unpacked."""
        try:
            self._zip = zipfile.ZipFile(io.BytesIO(data))
        except (zipfile.BadZipFile, NotImplementedError, ValueError, OverflowError) as error:
            raise ParseError(f"it can't be read as a zip ({str(error)[:200].lower()})") from None
        entries = self._zip.infolist()
        if len(entries) > MOST_ENTRIES:
            raise ParseError(f"the zip has {len(entries)} entries; {MOST_ENTRIES} are allowed")
        self._files: dict[str, zipfile.ZipInfo] = {}
        for entry in entries:
            _check(entry)
            name = posixpath.normpath(entry.filename)
            if entry.is_dir() or entry.filename.startswith(UNUSED[0]) or posixpath.basename(name) == UNUSED[1]:
                continue
            if name in self._files:
                raise ParseError(f"the zip has two files named {name[:100]!r}")
            self._files[name] = entry
        total = sum(entry.file_size for entry in self._files.values())
        most = min(max_bytes, MOST_RATIO * len(data) + SLACK)
        if total > most:
            raise ParseError(f"its files hold {total} bytes; {most} are allowed, for a zip of {len(data)}")

    @property
    def names(self) -> list[str]:
        """The paths of the files, relative to the zip's root."""
        return list(self._files)

    def __contains__(self, name: str) -> bool:
        return name in self._files

    def size(self, name: str) -> int:
        return self._files[name].file_size

    def read(self, name: str) -> bytes:
        """The bytes of a file, as many as its entry claims."""
        entry = self._files[name]
        try:
            with self._zip.open(entry) as file:
                data = file.read(entry.file_size + 1)
        except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError, OSError) as error:
            raise ParseError(f"it can't be unpacked ({str(error)[:200].lower()})", name[:100]) from None
        if len(data) != entry.file_size:
            raise ParseError(f"its entry promises {entry.file_size} bytes, it has {len(data)}", name[:100])
        return data


def _check(entry: zipfile.ZipInfo) -> None:
    """Raise ParseError for an entry that could lead out of a folder, or that cannot simply be inflated."""
    name = entry.orig_filename
    shown = repr(name[:100])
    if "\0" in name or "\\" in name:
        raise ParseError(f"the zip's entry {shown} has a character in its name that no path has")
    if name.startswith("/") or DRIVE.match(name) or ".." in name.split("/"):
        raise ParseError(f"the zip's entry {shown} leads out of its folder")
    kind = stat.S_IFMT(entry.external_attr >> 16)
    if kind not in (0, stat.S_IFREG, stat.S_IFDIR):
        raise ParseError(f"the zip's entry {shown} is {'a link' if kind == stat.S_IFLNK else 'no ordinary file'}")
    if entry.flag_bits & ENCRYPTED:
        raise ParseError(f"the zip's entry {shown} is encrypted")
    if entry.compress_type not in METHODS:
        raise ParseError(f"the zip's entry {shown} is compressed in a way that is not supported; deflate is")
