"""References from one file of an upload to others: the rule by which all readers find what a file calls by a name.

A path is taken to the letter; else without regard to case and to the form of Unicode; else by its last part alone,
where only one file is called so. What exporters write is the path on the machine of the file's author.
"""

from __future__ import annotations

import posixpath
import re
import unicodedata
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from service.formats.read.scenes.warnings import Warnings

DRIVE = re.compile(r"[A-Za-z]:")
URL = re.compile(r"(?!file:)[A-Za-z][A-Za-z0-9+.-]*://", re.IGNORECASE)  # of another machine
SHOWN = 100  # characters of a name in messages


def is_absolute(reference: str) -> bool:
    """True if a path is absolute on Linux, Windows or a network, as on the machine where the file was made."""
    return reference.startswith(("/", "\\")) or DRIVE.match(reference) is not None


def located(source: str, reference: str) -> str:
    """The path that the file at `source` calls `reference`. Both are relative to the model's folder, with `/` between
    their parts; the result may begin with `..`, and with `/` for an absolute reference."""
    return posixpath.normpath(posixpath.join(posixpath.dirname(source), reference.replace("\\", "/")))


def base_name(reference: str) -> str:
    """The last part of a path."""
    return DRIVE.sub("", posixpath.basename(reference.replace("\\", "/")), count=1)


@dataclass(frozen=True)
class Found:
    """A file that a reference leads to. `remark` says how, where that is not by its path."""

    path: str
    remark: str = ""


class Finder:
    """Finds files among `names`, paths with `/` between their parts. `others` are further spellings of these."""

    def __init__(self, names: Iterable[str], others: Mapping[str, str] | None = None) -> None:
        self._names = {name: name for name in (others or {}).values()} | dict(others or {})
        self._names |= {name: name for name in names}
        self._by_form: dict[str, set[str]] = {}
        self._by_key: dict[str, set[str]] = {}
        self._by_base: dict[str, set[str]] = {}
        for spelled, name in self._names.items():
            self._by_form.setdefault(_form(spelled), set()).add(name)
            self._by_key.setdefault(_key(spelled), set()).add(name)
            self._by_base.setdefault(_key(posixpath.basename(spelled)), set()).add(name)

    def find(self, source: str, *spellings: str) -> Found | None:
        """The file that the file at `source` calls by the first of these spellings that leads to one."""
        for reference in spellings:
            if (there := self.path(located(source, reference))) is not None:
                return Found(there)
        for reference in spellings:
            base = base_name(reference)
            named = self._by_base.get(_key(base), set())
            found = self.path(posixpath.join(posixpath.dirname(source), base))
            how = "the file of that name beside it"
            if found is None and len(named) == 1:
                (found,), how = named, "the only file of that name"
            if base and found is not None and not URL.match(reference):
                return Found(found, f"{reference[:SHOWN]!r} is not there; {found[:SHOWN]!r}, {how}, is used")
        return None

    def located(self, source: str, *spellings: str, place: str, notes: Warnings) -> str | None:
        """The path of the file that `find` finds, with a warning where it is not the one of the reference."""
        found = self.find(source, *spellings)
        if found is not None and found.remark:
            notes.add(place, found.remark)
        return None if found is None else found.path

    def path(self, path: str) -> str | None:
        """The file at a path: as it is written, else the only one with another form of Unicode, else of case."""
        if path in self._names:
            return self._names[path]
        for names in (self._by_form.get(_form(path)), self._by_key.get(_key(path))):
            if names:
                return next(iter(names)) if len(names) == 1 else None
        return None


def _form(path: str) -> str:
    return unicodedata.normalize("NFC", path)


def _key(path: str) -> str:
    return _form(_form(path).casefold())
