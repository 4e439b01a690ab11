"""The files of a zip. The sizes that they claim are bounded before any is unpacked, and unpacking ends at those
sizes."""

from __future__ import annotations

import io
import posixpath
import stat
import struct
import zipfile
import zlib
from collections.abc import Iterator, Mapping, Sequence

from service.formats.errors import ParseError
from service.formats.formats import decoded
from service.formats.read.references import DRIVE, SHOWN, Finder

MOST_ENTRIES = 10_000
# A text of numbers is compressed to a third, that of a grid to a tenth, a zip bomb to a thousandth. The slack is for
# small files.
MOST_RATIO, SLACK = 32, 16 << 20
METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
ENCRYPTED = 0x1
UTF_8 = 0x800  # the flag of an entry whose name is in UTF-8
UNICODE_NAME = 0x7075  # the kind of fact about an entry that is its name in UTF-8
# What programs that show folders leave in them; in lower case, as some of their file systems know no case.
UNUSED_FOLDER = "__macosx"
UNUSED_FILES = (".ds_store", "thumbs.db", "desktop.ini")
UNUSED_START = "._"  # before the name of a file: what macOS knows of that file and other file systems cannot keep
# Code pages in which Windows writes names in zips: of western, central and eastern Europe, Japan, China, Korea and
# Taiwan.
CODE_PAGES = ("cp850", "cp852", "cp866", "cp1251", "cp932", "gbk", "cp949", "cp950")
ALIGNMENT = 64  # bytes; where each file of a USD package begins


class Archive:
    """The files of a zip. Raises ParseError when it is opened if an entry's name, kind or size is not allowed."""

    def __init__(self, data: bytes | memoryview, max_bytes: int) -> None:
        """`max_bytes` bounds the size of all its files together when they are unpacked."""
        try:
            self._zip = zipfile.ZipFile(io.BytesIO(data))
        except (zipfile.BadZipFile, NotImplementedError, ValueError, OverflowError) as error:
            raise ParseError(f"it can't be read as a zip ({str(error)[:200].lower()})") from None
        self._data = memoryview(data)
        entries = self._zip.infolist()
        if len(entries) > MOST_ENTRIES:
            raise ParseError(f"the zip has {len(entries)} entries; {MOST_ENTRIES} are allowed")
        self._files: dict[str, zipfile.ZipInfo] = {}
        others: dict[str, str] = {}  # files by another reading of their names' bytes
        self.used: set[str] = set()  # names of the files that were read
        for entry in entries:
            _check(entry)
            name, *spellings = (posixpath.normpath(each) for each in _names(entry))
            if _slashed(entry.filename).endswith("/") or _is_unused(name):
                continue
            if (same := self._files.get(name)) is not None:
                if (same.CRC, same.file_size) == (entry.CRC, entry.file_size):
                    continue
                raise ParseError(f"the zip has two files named {name[:100]!r}")
            self._files[name] = entry
            others |= {spelled: name for spelled in spellings if spelled not in others}
        total = sum(entry.file_size for entry in self._files.values())
        most = min(max_bytes, MOST_RATIO * len(data) + SLACK)
        if total > most:
            raise ParseError(f"its files hold {total} bytes; {most} are allowed, for a zip of {len(data)}")
        self.finder = Finder(self._files, others)

    @property
    def names(self) -> list[str]:
        """The paths of the files, relative to the zip's root."""
        return list(self._files)

    def __contains__(self, name: str) -> bool:
        return name in self._files

    @property
    def is_package(self) -> bool:
        """True if each file lies in the zip as in a USD package: uncompressed, and where memory may be mapped."""
        return all(
            entry.compress_type == zipfile.ZIP_STORED and self._start(entry) % ALIGNMENT == 0
            for entry in self._files.values()
        )

    def size(self, name: str) -> int:
        return self._files[name].file_size

    def read(self, name: str) -> bytes:
        """The bytes of a file, as many as its entry claims."""
        self.used.add(name)
        entry = self._files[name]
        data = self._unpacked(name, entry.file_size + 1)
        if len(data) != entry.file_size:
            raise ParseError(f"its entry promises {entry.file_size} bytes, it has {len(data)}", name[:100])
        return data

    def head(self, name: str, size: int) -> bytes:
        """The first bytes of a file, which does not count as used; none of one that cannot be unpacked."""
        try:
            return self._unpacked(name, size)
        except ParseError:
            return b""

    def _unpacked(self, name: str, size: int) -> bytes:
        try:
            with self._zip.open(self._files[name]) as file:
                return file.read(size)
        except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError, OSError) as error:
            raise ParseError(f"it can't be unpacked ({str(error)[:200].lower()})", name[:100]) from None

    def _start(self, entry: zipfile.ZipInfo) -> int:
        """Where the bytes of a file begin: after its header, its name and more of its facts."""
        name, more = struct.unpack("<HH", bytes(self._data[entry.header_offset + 26 :][:4]).ljust(4, b"\0"))
        return int(entry.header_offset + 30 + name + more)


def listed(names: Sequence[str], most: int = 10) -> str:
    """The names of files as words of a sentence: at most so many, and how many more there are."""
    first = [repr(name[:SHOWN])[1:-1] for name in names[:most]]
    more = len(names) - len(first)
    last = f"{more} more" if more else first.pop() if len(first) > 1 else ""
    return ", ".join(first) + (f" and {last}" if last else "")


def zipped(files: Mapping[str, bytes]) -> bytes:
    """Files by path as a zip; the same files always give the same bytes."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_STORED) as archive:
        for path in sorted(files):
            archive.writestr(zipfile.ZipInfo(path), files[path])
    return out.getvalue()


def _names(entry: zipfile.ZipInfo) -> list[str]:
    """The name of an entry, and what it is called where its bytes are read as another program may have written them.

    Many write UTF-8 without its flag, or the code page of their system; zips know only that of the first PCs. Some on
    Windows write its backslashes, and some write the name once more, in UTF-8, among the further facts.
    """
    name = _slashed(entry.filename)
    if entry.flag_bits & UTF_8:
        return [name]
    if (further := _unicode_name(entry)) is not None:
        return [further]
    data = entry.filename.encode("cp437")
    try:
        return [_slashed(data.decode())]
    except UnicodeDecodeError:
        return [name, *(_slashed(each) for each in (decoded(data), *_spellings(data)))]


def _spellings(data: bytes) -> Iterator[str]:
    for page in CODE_PAGES:
        try:
            yield data.decode(page)
        except UnicodeDecodeError:
            continue


def _slashed(name: str) -> str:
    return name.replace("\\", "/")


def _unicode_name(entry: zipfile.ZipInfo) -> str | None:
    """The name in UTF-8 of an entry's further facts [PKWARE, APPNOTE 4.6.9], unless it belongs to another name."""
    facts, checksum = entry.extra, struct.pack("<I", zlib.crc32(entry.orig_filename.encode("cp437")))
    while len(facts) >= 4:
        kind, size = struct.unpack_from("<HH", facts)
        fact, facts = facts[4 : 4 + size], facts[4 + size :]
        if kind == UNICODE_NAME and fact[1:5] == checksum:
            return _slashed(fact[5:].decode("utf-8", "replace"))
    return None


def _is_unused(name: str) -> bool:
    *folders, base = name.lower().split("/")
    return UNUSED_FOLDER in folders or base.startswith(UNUSED_START) or base in UNUSED_FILES


def _check(entry: zipfile.ZipInfo) -> None:
    """Raise ParseError for an entry that could lead out of a folder, or that cannot simply be inflated."""
    shown = repr(entry.orig_filename[:100])
    for name in (_slashed(entry.orig_filename), *_names(entry)):
        if "\0" in name:
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
