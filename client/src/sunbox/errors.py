"""Errors of a server or a connection, as exceptions with the server's own sentence."""

from __future__ import annotations

from typing import Any


class SunboxError(Exception):
    """`str()` is a sentence that can be shown. `status` is the HTTP status, None where no answer came; `pointer` is
    the JSON pointer (RFC 6901) of the first wrong field, from the request's root, None where no field is to blame;
    `errors` has all of them as `[(pointer, detail), ...]`."""

    def __init__(
        self, detail: str, status: int | None = None, errors: list[tuple[str, str]] | None = None, title: str = ""
    ) -> None:
        super().__init__(detail)
        self.detail, self.status, self.errors, self.title = detail, status, errors or [], title

    @property
    def pointer(self) -> str | None:
        return self.errors[0][0] if self.errors else None


class Refused(SunboxError):
    """The request is wrong: what it says would have to change (status 4xx)."""


class NotFound(Refused):
    """There is nothing under this id, or no longer (404, 410)."""


class Failed(SunboxError):
    """The server could not do what was asked for (5xx), or the render failed."""


class Unreachable(SunboxError):
    """No answer came: the server is not there, or it did not come back within `patience`."""


def from_problem(problem: Any, status: int) -> SunboxError:
    """The exception for an RFC 9457 document, or else for whatever a proxy answered."""
    kind = NotFound if status in (404, 410) else Refused if 400 <= status < 500 else Failed
    try:
        errors = [(str(each["pointer"]), str(each["detail"])) for each in problem.get("errors", ())]
        title = str(problem["title"])
        return kind(str(problem.get("detail") or title), status, errors, title)
    except (AttributeError, KeyError, TypeError):
        return kind(f"The server answered with status {status} and no reason.", status)
