"""Errors of callers and of the service, and how HTTP reports them.

ServiceError
    MalformedJson  InvalidDocument  AssetError            the body
    Unauthorized  Forbidden                               who asks
    NotFound  Conflict  PreconditionFailed  Gone                            what is asked for
    TooLarge  UnsupportedMedia  TimedOut                  how it is sent
    TooManyRequests  Unavailable  NotProvided  Internal   the service
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

LONGEST_STEP = 200  # characters of a name in a pointer: a hundred pointers through a name of 20 MB would be 2 GB


@dataclass(frozen=True)
class FieldError:
    """A mistake at `pointer` (RFC 6901, "" is the whole document) and what would be right."""

    pointer: str
    detail: str

    def __str__(self) -> str:
        return f"{self.pointer or '/'}: {self.detail}"


def escaped(step: object) -> str:
    """One step of a JSON pointer (RFC 6901); a very long name is cut off."""
    return str(step)[:LONGEST_STEP].replace("~", "~0").replace("/", "~1")


class ServiceError(Exception):
    """`detail` is for the caller's eyes: it names nothing inside the server."""

    def __init__(self, detail: str = "") -> None:
        super().__init__(detail)
        self.detail = detail


class MalformedJson(ServiceError):
    """Not JSON, or not the JSON that RFC 8259 asks senders for: duplicate keys, bad UTF-8, absurd nesting."""


class InvalidDocument(ServiceError):
    """JSON that is no valid document. `errors` has at least one entry."""

    def __init__(self, errors: Iterable[FieldError]) -> None:
        self.errors = list(errors)
        super().__init__("; ".join(map(str, self.errors[:3])) + _more(len(self.errors) - 3))

    def under(self, pointer: str) -> InvalidDocument:
        """The same mistakes, seen from a document in which this one stands at `pointer`."""
        return InvalidDocument(FieldError(pointer + error.pointer, error.detail) for error in self.errors)

    def __reduce__(self) -> tuple[type[InvalidDocument], tuple[list[FieldError]]]:
        return InvalidDocument, (self.errors,)  # crosses process borders; the default would pass the text


class AssetError(ServiceError):
    """An asset that is missing, unreadable or not what its use asks for; callers that know the field add the pointer.

    `place` is a pointer into the asset's own JSON, where it has one. `choices` are the models of a zip that holds
    several.
    """

    def __init__(self, detail: str = "", place: str = "", choices: tuple[str, ...] = ()) -> None:
        super().__init__(detail)
        self.place = place
        self.choices = choices


class Unauthorized(ServiceError):
    pass


class Forbidden(ServiceError):
    pass


class NotFound(ServiceError):
    """`pointer` says which part of a document names what is not there, where one does."""

    def __init__(self, detail: str = "", pointer: str = "") -> None:
        super().__init__(detail)
        self.pointer = pointer


class Conflict(ServiceError):
    pass


class PreconditionFailed(ServiceError):
    pass


class Gone(ServiceError):
    pass


class TooLarge(ServiceError):
    """`pointer` says which part of a document is too large, where it is one."""

    def __init__(self, detail: str = "", pointer: str = "") -> None:
        super().__init__(detail)
        self.pointer = pointer

    def __reduce__(self) -> tuple[type[TooLarge], tuple[str, str]]:
        return TooLarge, (self.detail, self.pointer)  # crosses process borders


class UnsupportedMedia(ServiceError):
    pass


class TimedOut(ServiceError):
    pass


class TooManyRequests(ServiceError):
    """`retry_after` goes into the header of that name, in whole seconds."""

    def __init__(self, detail: str = "", retry_after: int = 1) -> None:
        super().__init__(detail)
        self.retry_after = retry_after


class Unavailable(ServiceError):
    """`retry_after` goes into the header of that name, in whole seconds."""

    def __init__(self, detail: str = "", retry_after: int = 1) -> None:
        super().__init__(detail)
        self.retry_after = retry_after


class NotProvided(ServiceError):
    """The server lacks a program or a package that this needs, which `detail` names."""


class Internal(ServiceError):
    pass


MISTAKE = "The server made a mistake; its log says which."  # of an Internal that no request can avoid


@dataclass(frozen=True)
class Answer:
    """How HTTP answers one class of error."""

    status: int
    type: str
    title: str


ANSWERS: dict[type[ServiceError], Answer] = {
    MalformedJson: Answer(400, "malformed-json", "Malformed JSON"),
    InvalidDocument: Answer(422, "invalid-document", "Invalid document"),
    AssetError: Answer(422, "invalid-asset", "Invalid asset"),
    Unauthorized: Answer(401, "unauthorized", "Key required"),
    Forbidden: Answer(403, "forbidden", "Forbidden"),
    NotFound: Answer(404, "not-found", "Not found"),
    Conflict: Answer(409, "conflict", "Not possible in this state"),
    PreconditionFailed: Answer(412, "precondition-failed", "Precondition failed"),
    Gone: Answer(410, "gone", "Gone"),
    TimedOut: Answer(408, "timed-out", "Request took too long"),
    TooLarge: Answer(413, "too-large", "Too large"),
    UnsupportedMedia: Answer(415, "unsupported-media", "Unsupported media type"),
    TooManyRequests: Answer(429, "too-many-requests", "Too many requests"),
    Unavailable: Answer(503, "unavailable", "Unavailable"),
    NotProvided: Answer(501, "not-provided", "Not provided by this server"),
    Internal: Answer(500, "internal", "Internal error"),
}


def answer(error: Exception) -> Answer:
    """The table's row for an error: its own class's or the nearest ancestor's; Internal for a stranger."""
    return next((ANSWERS[kind] for kind in type(error).__mro__ if kind in ANSWERS), ANSWERS[Internal])


def problem(error: Exception) -> dict[str, Any]:
    """The body of an `application/problem+json` answer (RFC 9457).

    A URN as `type` needs no host and stays true under any subpath. The text of an exception that is no
    ServiceError is left out: it is about the server, not about the request.
    """
    row = answer(error)
    known = isinstance(error, ServiceError)
    body: dict[str, Any] = {
        "type": f"urn:sunbox:problem:{row.type}",
        "title": row.title,
        "status": row.status,
        "detail": (str(error) if known else "") or row.title,
    }
    if isinstance(error, InvalidDocument):
        body["errors"] = [{"pointer": e.pointer, "detail": e.detail} for e in error.errors]
    elif isinstance(error, TooLarge | NotFound) and error.pointer:
        body["errors"] = [{"pointer": error.pointer, "detail": error.detail}]
    elif isinstance(error, AssetError) and error.place:
        body["errors"] = [{"pointer": error.place, "detail": error.detail}]
    if isinstance(error, AssetError) and error.choices:
        body["choices"] = list(error.choices)
    return body


def _more(count: int) -> str:
    return f"; and {count} more" if count > 0 else ""
