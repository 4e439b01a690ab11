"""JSON text to Python values, by the letter of RFC 8259 where json.loads is lenient in ways that hide mistakes."""

from __future__ import annotations

import json
from collections import Counter
from typing import Any

from service.problems import MalformedJson

DEEPEST = 64  # containers within containers: a scene has six; deeper ones would exhaust the stack further on


def load_json(data: bytes | str) -> Any:
    """The value of a JSON text in UTF-8.

    Raises MalformedJson. NaN, Infinity and numbers beyond float64 do become floats: validation refuses them with the
    pointer of their field, which is of more use than a line and a column.
    """
    text = _decoded(data)
    try:
        value = json.loads(text, object_pairs_hook=_unique)
    except json.JSONDecodeError as error:
        raise MalformedJson(f"line {error.lineno}, column {error.colno}: {error.msg.lower()}") from None
    except RecursionError:
        raise _too_deep() from None
    except ValueError:  # a whole number of more than 4300 digits
        raise MalformedJson("a number has too many digits") from None
    _check_depth(value)
    if "\\ud" in text or "\\uD" in text:
        _check_surrogates(value)
    return value


def _decoded(data: bytes | str) -> str:
    if isinstance(data, str):
        return data
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise MalformedJson(f"byte {error.start} is not UTF-8") from None


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    value = dict(pairs)
    if len(value) < len(pairs):
        twice = Counter(key for key, _ in pairs).most_common(1)[0][0]
        raise MalformedJson(f"the key {twice[:80]!r} stands twice in one object")
    return value


def _check_depth(value: Any) -> None:
    level: list[Any] = [[value]]
    for _ in range(DEEPEST + 1):
        level = [
            child
            for container in level
            for child in (container.values() if type(container) is dict else container)
            if type(child) is dict or type(child) is list
        ]
        if not level:
            return
    raise _too_deep()


def _too_deep() -> MalformedJson:
    return MalformedJson(f"arrays and objects are nested deeper than {DEEPEST}")


def _check_surrogates(value: Any) -> None:
    """An escaped half of a surrogate pair is no character: no answer could quote it in UTF-8."""
    try:
        json.dumps(value, ensure_ascii=False).encode()
    except UnicodeEncodeError:
        raise MalformedJson("a text has an unpaired surrogate (\\ud800 to \\udfff)") from None
