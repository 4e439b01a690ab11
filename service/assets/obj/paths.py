"""Where a reference from an OBJ file or a material library leads, within the folder of the model."""

from __future__ import annotations

import posixpath
import re

DRIVE = re.compile(r"[A-Za-z]:")


def is_absolute(reference: str) -> bool:
    """Of Linux, Windows, or a network; such paths are from the machine of whoever made the file."""
    return reference.startswith(("/", "\\")) or DRIVE.match(reference) is not None


def located(source: str, reference: str) -> str:
    """The path of what the file at `source` calls `reference`; of an absolute one a file of that name beside it.

    Both are relative to the model's folder, with `/` between their parts; the result may begin with `..`.
    """
    plain = reference.replace("\\", "/")
    if is_absolute(reference):
        plain = posixpath.basename(plain)
    return posixpath.normpath(posixpath.join(posixpath.dirname(source), plain))


def library_names(statement: str) -> list[str]:
    """What `mtllib` may name: one file whose name has blanks in it, or else several files."""
    words = statement.split()
    return [statement, *words] if len(words) > 1 else words
