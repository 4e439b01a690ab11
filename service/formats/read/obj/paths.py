"""References from an OBJ file or a material library to other files in the model's folder."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Callable

COMMENT = re.compile(r"\s+#(?:\s.*)?$")
DRIVE = re.compile(r"[A-Za-z]:")


def is_absolute(reference: str) -> bool:
    """True if a path is absolute on Linux, Windows or a network, as on the machine where the file was made."""
    return reference.startswith(("/", "\\")) or DRIVE.match(reference) is not None


def located(source: str, reference: str) -> str:
    """The path of the file that the file at `source` calls `reference`; for an absolute one that of its name beside
    it.

    Both are relative to the model's folder, with `/` between their parts; the result may begin with `..`.
    """
    plain = reference.replace("\\", "/")
    if is_absolute(reference):
        plain = posixpath.basename(plain)
    return posixpath.normpath(posixpath.join(posixpath.dirname(source), plain))


def without_comment(name: str) -> str:
    """A name without what looks like a comment after it: `#` between blanks, which `Material #25` has not."""
    return COMMENT.sub("", name)


def library_names(statement: str, is_there: Callable[[str], bool]) -> list[str]:
    """The names after `mtllib`: several files, or one whose name may contain blanks. `is_there` knows the files."""
    plain = without_comment(statement)
    return next(([name] for name in (statement, plain) if is_there(name)), plain.split())
