"""JSON text to Python values, by the letter of RFC 8259 where json.loads is lenient in ways that hide mistakes; and
JSON merge patches.
"""

from __future__ import annotations

import json
import threading
from collections import Counter
from contextlib import nullcontext
from typing import Any

from service.problems import MalformedJson

DEEPEST = 64  # nested containers: a scene has six; deeper texts would exhaust the stack later
LARGE = 64 * 1024  # characters whose parsing keeps every other thread waiting for 10 ms
_one_large = threading.Lock()


def load_json(data: bytes | bytearray | memoryview | str) -> Any:
    """The value of a JSON text in UTF-8.

    Raises MalformedJson. NaN, Infinity and numbers beyond float64 are accepted as floats: validation refuses them
    with the pointer of their field, which is more useful than a line and a column.
    """
    text = _decoded(data)
    # The scanner is written in C and lets no other thread run where there are no objects. One text at a time,
    # or threads that want to answer meanwhile would compete with all of them.
    with _one_large if len(text) > LARGE else nullcontext():
        value = _loaded(text)
    _check_depth(value)
    if "\\ud" in text or "\\uD" in text:
        _check_surrogates(value)
    return value


def most_bytes(text: bytes | bytearray | str) -> int:
    """An upper bound, from the punctuation alone, on the bytes of memory of a JSON text's values.

    Up to 70 times the text: a list takes 96 bytes with its place in another one, a number or an empty string 40 with
    its own, an object 200, a key 110 with its value. ASCII; other characters take four bytes where they took two.
    """
    if isinstance(text, str):
        counts = [text.count(mark) for mark in "{[:,"]
    else:
        counts = [text.count(mark.encode()) for mark in "{[:,"]
    return len(text) + sum(cost * count for cost, count in zip((200, 96, 110, 40), counts, strict=True))


def weigh(value: Any) -> int:
    """The bytes of memory of a JSON value, by the same rules."""
    bytes_, waiting = 0, [value]
    while waiting:
        found = waiting.pop()
        if isinstance(found, dict):
            bytes_ += 200 + 110 * len(found) + sum(map(len, found))
            waiting += found.values()
        elif isinstance(found, list):
            bytes_ += 96 + 40 * len(found)
            waiting += (each for each in found if isinstance(each, list | dict | str))
        elif isinstance(found, str):
            bytes_ += len(found)
    return bytes_


def dump_json(value: Any, levels: int = 2) -> str:
    """JSON without blanks, of `levels` levels one entry after the other: json.dumps lets no other thread run."""
    if levels and isinstance(value, dict):
        return "{" + ",".join(f"{_dumped(key)}:{dump_json(each, levels - 1)}" for key, each in value.items()) + "}"
    if levels and isinstance(value, list):
        return "[" + ",".join(dump_json(each, levels - 1) for each in value) + "]"
    return _dumped(value)


def _dumped(value: Any) -> str:
    return json.dumps(value, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


def _loaded(text: str) -> Any:
    try:
        return json.loads(text, object_pairs_hook=_unique)
    except json.JSONDecodeError as error:
        raise MalformedJson(f"line {error.lineno}, column {error.colno}: {error.msg.lower()}") from None
    except RecursionError:
        raise _too_deep() from None
    except ValueError:  # a whole number of more than 4300 digits
        raise MalformedJson("a number has too many digits") from None


def _decoded(data: bytes | bytearray | memoryview | str) -> str:
    if isinstance(data, str):
        return data
    try:
        return str(data, "utf-8-sig")
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


def merge_patch(target: Any, patch: Any) -> Any:
    """`target` with `patch` merged in [RFC 7396]; neither is changed, and what did not change is shared.

    Beyond the RFC: a patch that changes an object's `type` replaces the object whole, because the fields of the old
    kind mean nothing to the new one.
    """
    if not isinstance(patch, dict):
        return patch
    merged = {} if not isinstance(target, dict) or _changes_type(target, patch) else dict(target)
    for key, value in patch.items():
        if value is None:
            merged.pop(key, None)
        else:
            merged[key] = merge_patch(merged.get(key), value)
    return merged


def _changes_type(target: dict[str, Any], patch: dict[str, Any]) -> bool:
    """Only texts and absence count: in a table of materials, "type" may be somebody's material."""
    if "type" not in patch:
        return False
    old, new = target.get("type"), patch["type"]
    return old != new and all(kind is None or isinstance(kind, str) for kind in (old, new))
