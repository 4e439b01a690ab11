"""The files around a glTF file, to which its URIs lead."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from urllib.parse import unquote_to_bytes

from service.formats.formats import decoded
from service.formats.read.archive import Archive, listed
from service.formats.read.references import Found
from service.formats.read.scenes.warnings import Warnings


@dataclass
class Beside:
    """The files of the zip that a glTF file is in; `model` is its path there."""

    archive: Archive
    model: str
    notes: Warnings

    def take(self, uris: Iterable[str]) -> None:
        """Let the files of these URIs count as used, whether or not the present picture shows them: another variant
        may."""
        self.archive.used |= {found.path for uri in uris if (found := self.find(uri)) is not None}

    def find(self, uri: str) -> Found | None:
        """The file that a URI leads to: blanks and other characters may be written with percent signs, or not."""
        return self.archive.finder.find(self.model, *spellings(uri))

    def read(self, found: Found, place: str) -> bytes:
        if found.remark:
            self.notes.add(place, found.remark)
        return self.archive.read(found.path)

    @property
    def shown(self) -> str:
        """A sentence with the names of the files."""
        return f"the zip holds {listed(self.archive.names)}"


def spellings(uri: str) -> tuple[str, str]:
    """The paths that a relative URI may mean."""
    return uri, decoded(unquote_to_bytes(uri))
