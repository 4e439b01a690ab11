"""Stored JSON as this version's dataclasses, whichever version wrote it.

A field that is added to one of these dataclasses has a default, which is what rows from before mean. A field that is
not known any more is left out. Only where a field's meaning changes does `FORMAT` rise, and `fit` converts.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields
from typing import Any, TypeVar

from pydantic import TypeAdapter, ValidationError

FORMAT = 1
VERSION = "version"  # the key of the number; rows from before there was one have none

T = TypeVar("T")


class Unfit(Exception):
    """A stored document cannot be understood; the text says what of it."""


def stored(values: Mapping[str, Any]) -> str:
    """As JSON for a row."""
    return json.dumps({VERSION: FORMAT} | dict(values), separators=(",", ":"))


def read(text: str) -> dict[str, Any]:
    """The values of a row. Raises Unfit."""
    try:
        values = json.loads(text)
    except (ValueError, TypeError, RecursionError) as error:
        raise Unfit(f"it is not whole JSON: {error}") from None
    if not isinstance(values, dict):
        raise Unfit("it is not a JSON object")
    if (version := values.pop(VERSION, 0)) not in range(FORMAT + 1):
        raise Unfit(f"another version of Sunbox wrote it (format {version!r}; this one reads up to {FORMAT})")
    return values


def unknown(kind: type[Any], values: Mapping[str, Any]) -> set[str]:
    """The names that a dataclass has no field for."""
    return set(values) - {field.name for field in fields(kind)}


def fit(kind: type[T], values: Any) -> T:
    """A dataclass with these values, those without a field left out. Raises Unfit."""
    try:
        fitted: T = _adapter(kind).validate_python(values)
        return fitted
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        where = ".".join(str(part) for part in first["loc"])
        raise Unfit(f"{where}: {first['msg']}" if where else first["msg"]) from None


_adapters = dict[type[Any], TypeAdapter[Any]]()  # making one takes as long as fitting fifty rows


def _adapter(kind: type[Any]) -> TypeAdapter[Any]:
    if kind not in _adapters:
        _adapters[kind] = TypeAdapter(kind)
    return _adapters[kind]
