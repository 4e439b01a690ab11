"""One of several models in a zip, as a file of its own."""

from __future__ import annotations

from service.formats.cache import refused
from service.formats.errors import ParseError
from service.formats.sandbox.sandbox import Sandbox
from service.formats.source import Source, for_sandbox, format_of, length
from service.problems import AssetError

ZIPS = ("zip", "usd")  # formats of files that may hold several models


def taken(
    sandbox: Sandbox, data: Source, entry: str, content_type: str | None, filename: str | None, title: str | None
) -> tuple[str, Source]:
    """The name and the bytes of the model that `entry` names; errors call the file `title`. Raises AssetError."""
    format = format_of(data, content_type, filename) if length(data) else None
    if format not in ZIPS:
        raise AssetError("`entry` names a model of a zip; this file is none", "/entry")
    try:
        return sandbox.take(format, for_sandbox(data), entry)
    except ParseError as error:
        raise refused(title or "the ZIP file", error) from None
