"""Arguments and results of every writer."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from service.exports.losses import Losses
from service.formats import Assets
from service.problems import TooLarge


class Files(Assets, Protocol):
    """Assets with their bytes as they were uploaded. All methods raise AssetError, and any thread may call them."""

    def read(self, ref: str) -> bytes: ...


class Limits(Protocol):
    """The part of the service's configuration that bounds an export."""

    @property
    def max_triangles(self) -> int: ...

    @property
    def max_texels(self) -> int: ...

    @property
    def max_asset(self) -> int: ...


@dataclass(frozen=True)
class Exported:
    """A file in pieces, so that a large one is never copied whole, what it has no place for, and files that it names
    by their paths beside it."""

    pieces: Sequence[bytes | memoryview]
    losses: Losses = field(default_factory=Losses)
    beside: Mapping[str, bytes] = field(default_factory=dict)

    @property
    def size(self) -> int:
        return sum(map(len, self.pieces))

    @property
    def data(self) -> bytes:
        return b"".join(self.pieces)

    def zipped(self, name: str) -> Exported:
        """One zip of the file, under this name, and those beside it, which are compressed already."""
        out = io.BytesIO()
        with zipfile.ZipFile(out, "w") as archive:
            archive.writestr(zipfile.ZipInfo(name), self.data, zipfile.ZIP_DEFLATED)
            for path, data in self.beside.items():
                archive.writestr(zipfile.ZipInfo(path), data)
        return Exported([out.getvalue()], self.losses)


def check_size(size: int, limits: Limits) -> None:
    """Raises TooLarge for a file that could not be uploaded again."""
    if size > limits.max_asset:
        raise TooLarge(f"The file would have {size} bytes; {limits.max_asset} are allowed (SUNBOX_MAX_ASSET).")
