"""The editor's files as a browser gets them: code without comments, a quarter of what a first visit loads.

The lines stay, empty, so that what a browser says of an error is said of the lines of the source.
"""

from __future__ import annotations

import os
import re
from functools import lru_cache
from pathlib import Path

from starlette.datastructures import Headers
from starlette.responses import Response
from starlette.types import Scope

from service.server.routes.errors import Files

MOST = 512  # files that are kept without their comments; there are some 180
# Lines that are comments alone, by the ending of the file's name, with its type.
_COMMENTS = {
    ".js": (re.compile(rb"^[ \t]*//[^\n]*$", re.MULTILINE), "text/javascript"),
    ".css": (re.compile(rb"^[ \t]*/\*[^\n]*\*/$", re.MULTILINE), "text/css"),
}


class EditorFiles(Files):
    """The folder's files; modules and style sheets go out without the lines that are comments alone."""

    def file_response(
        self, full_path: os.PathLike[str] | str, stat_result: os.stat_result, scope: Scope, status_code: int = 200
    ) -> Response:
        response = super().file_response(full_path, stat_result, scope, status_code)
        ending = Path(full_path).suffix
        if response.status_code != 200 or ending not in _COMMENTS or "range" in Headers(scope=scope):
            return response
        validators = {name: response.headers[name] for name in ("etag", "last-modified")}
        body = without_comments(str(full_path), stat_result.st_mtime_ns)
        return Response(body, headers=validators, media_type=_COMMENTS[ending][1])


@lru_cache(MOST)
def without_comments(path: str, modified_ns: int) -> bytes:
    """A file's text with empty lines in the place of comments; as it was modified then."""
    comment, _ = _COMMENTS[Path(path).suffix]
    return comment.sub(b"", Path(path).read_bytes())
