"""Errors and what HTTP says of them."""

from __future__ import annotations

import pickle

import pytest

from service import problems
from service.problems import ANSWERS, FieldError, InvalidDocument, ServiceError, Unavailable, answer, problem


def every_error() -> list[type[ServiceError]]:
    kinds = [kind for kind in vars(problems).values() if isinstance(kind, type) and issubclass(kind, ServiceError)]
    return [kind for kind in kinds if kind is not ServiceError]


def test_table_is_whole() -> None:
    assert set(ANSWERS) == set(every_error())
    types = [row.type for row in ANSWERS.values()]
    assert len(set(types)) == len(types)


@pytest.mark.parametrize(
    ("name", "status"),
    [
        ("MalformedJson", 400),
        ("Unauthorized", 401),
        ("Forbidden", 403),
        ("NotFound", 404),
        ("Conflict", 409),
        ("Gone", 410),
        ("TooLarge", 413),
        ("UnsupportedMedia", 415),
        ("AssetError", 422),
        ("TooManyRequests", 429),
        ("Internal", 500),
        ("Unavailable", 503),
    ],
)
def test_status_and_detail(name: str, status: int) -> None:
    told = problem(getattr(problems, name)("the lamp is out"))
    assert told["status"] == status
    assert told["detail"] == "the lamp is out"
    assert told["type"].startswith("urn:sunbox:problem:") and told["title"]
    assert "errors" not in told


def test_invalid_document_lists_pointers_seen_from_the_root() -> None:
    error = InvalidDocument([FieldError("/camera", "is required"), FieldError("", "is odd")]).under("/scene")
    told = problem(error)
    assert told["status"] == 422
    assert told["errors"] == [
        {"pointer": "/scene/camera", "detail": "is required"},
        {"pointer": "/scene", "detail": "is odd"},
    ]
    assert "/scene/camera: is required" in told["detail"]


def test_long_lists_of_mistakes_are_cut_in_the_detail_only() -> None:
    error = InvalidDocument(FieldError(f"/shapes/{i}", "is wrong") for i in range(9))
    assert str(error).endswith("and 6 more") and len(problem(error)["errors"]) == 9


def test_strangers_tell_nothing() -> None:
    told = problem(KeyError("/srv/secret/path"))
    assert told["status"] == 500 and "secret" not in str(told)


def test_unlisted_children_answer_as_their_parent() -> None:
    class Full(Unavailable):
        pass

    assert answer(Full("full")).status == 503 and Full("full", retry_after=7).retry_after == 7


def test_errors_cross_process_borders() -> None:
    error = pickle.loads(pickle.dumps(InvalidDocument([FieldError("/a", "is wrong")])))
    assert error.errors == [FieldError("/a", "is wrong")]
