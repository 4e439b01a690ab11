"""Pydantic's errors in plain words, each with the JSON pointer of the place to correct."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from itertools import islice
from types import NoneType, UnionType
from typing import Annotated, Any, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, Tag, TypeAdapter, ValidationError

from service.document.base import MOST_MISTAKES, REFUSAL, field_names
from service.document.numbers import described
from service.problems import FieldError, InvalidDocument, escaped

T = TypeVar("T")
U = TypeVar("U")
_WRONG_KIND = ("union_tag_invalid", "union_tag_not_found", "literal_error", "missing")


def validated(adapter: TypeAdapter[T], document: Any, pointer: str) -> T:
    """The document as `adapter` makes it. Raises InvalidDocument with its mistakes, seen from `pointer` up."""
    try:
        return adapter.validate_python(document)
    except ValidationError as error:
        # The adapter's type has no public name; the error alone does not tell tags from fields.
        raise InvalidDocument(mistakes(error, adapter._type)).under(pointer) from None


def both(first: Callable[[], T], second: Callable[[], U]) -> tuple[T, U]:
    """The results of both. Raises InvalidDocument with the mistakes of both."""
    errors: list[FieldError] = []
    found: list[Any] = []
    for parse in (first, second):
        try:
            found.append(parse())
        except InvalidDocument as error:
            errors += error.errors
    if errors:
        raise InvalidDocument(errors)
    return found[0], found[1]


def validated_entries(
    adapter: TypeAdapter[T], entries: Iterable[tuple[int | str, Any]], known: Callable[[int | str, Any], T | None]
) -> tuple[dict[int | str, T], list[FieldError]]:
    """The validated entries of an array or object, and the mistakes, with pointers from it.

    The search ends at MOST_MISTAKES. `known` gives the earlier result for an unchanged entry. Entries are validated
    one at a time, because pydantic stores all errors (1 KiB each) and lets no other thread run meanwhile.
    """
    made: dict[int | str, T] = {}
    found: list[FieldError] = []
    for key, value in entries:
        same = known(key, value)
        if same is not None:
            made[key] = same
            continue
        try:
            made[key] = adapter.validate_python(value)
        except ValidationError as error:
            step = "/" + escaped(key)
            found += (FieldError(step + each.pointer, each.detail) for each in mistakes(error, adapter._type))
            if len(found) >= MOST_MISTAKES:
                break
    return made, found[:MOST_MISTAKES]


def mistakes(error: ValidationError, kind: Any) -> list[FieldError]:
    """The errors with their pointers, in the order of the document; `kind` is the type that was validated."""
    found: dict[str, tuple[Any, ErrorLocation]] = {}
    kinds: set[str] = set()
    for entry in error.errors(include_url=False):
        place = locate(kind, entry["loc"])
        pointer = "".join("/" + escaped(step) for step in place.steps)
        if entry["type"] in ("union_tag_invalid", "union_tag_not_found"):
            pointer += "/type"
        if pointer.endswith("/type") and entry["type"] in _WRONG_KIND:
            kinds.add(pointer)
        found.setdefault(pointer + entry.get("ctx", {}).get("at", ""), (entry, place))
    # Errors of `type` come first: under a wrong type every other field may look wrong.
    holders = {pointer.removesuffix("type") for pointer in kinds}
    outer = (pointer for pointer in found if pointer in kinds or not _is_below(pointer, holders))
    return [FieldError(pointer, _detail(*found[pointer])) for pointer in islice(outer, MOST_MISTAKES)]


def among(names: Iterable[str]) -> str:
    """The names as a list for an error message, cut off where it gets too long."""
    known = [repr(name[:40]) for name in islice(names, 21)]
    return ", ".join(known[:20]) + (", ..." if len(known) > 20 else "") if known else "none"


def _is_below(pointer: str, holders: set[str]) -> bool:
    """True if one of the holders, which end with a slash, leads to it."""
    at = pointer.find("/")
    while at >= 0:
        if pointer[: at + 1] in holders:
            return True
        at = pointer.find("/", at + 1)
    return False


def _detail(entry: Any, place: ErrorLocation) -> str:
    kind, value, context = entry["type"], entry["input"], entry.get("ctx", {})
    if kind == REFUSAL:
        return str(context["detail"])
    if kind == "extra_forbidden" and place.holder is not None:
        return _unknown_field(str(place.steps[-1]), place.holder)
    if kind == "union_tag_invalid":
        known = [tag for tag in context["expected_tags"].split(", ") if "<" not in tag]  # those are forms without it
        return f"is not known: {described(value.get('type'))}; known are {', '.join(known)}"
    if kind == "literal_error":
        return f"must be {context['expected']}, not {described(value)}"
    words = _WORDS.get(kind)
    return words(context, value) if words else str(entry["msg"])


def _unknown_field(name: str, model: type[BaseModel]) -> str:
    names = field_names(model)
    near = difflib.get_close_matches(name[:40], names, n=1)  # its time grows with the square
    return f"is not known here{f' (did you mean {near[0]!r}?)' if near else ''}; known are {', '.join(names)}"


def _not(what: str) -> Callable[[dict[str, Any], Any], str]:
    return lambda context, value: f"must be {what}, not {described(value)}"


def _bound(word: str, key: str) -> Callable[[dict[str, Any], Any], str]:
    return lambda context, value: f"must be {word} {context[key]:.10g}, not {described(value)}"


_WORDS: dict[str, Callable[[dict[str, Any], Any], str]] = {
    "missing": lambda context, value: "is required",
    "union_tag_not_found": lambda context, value: "is required: it says what kind of thing this is",
    "finite_number": _not("a finite number"),
    "float_type": _not("a number"),
    "int_type": _not("a whole number"),
    "bool_type": _not("true or false"),
    "string_type": _not("a text"),
    "string_too_short": lambda context, value: "must not be empty",
    "too_short": lambda context, value: (
        "must not be empty" if context["min_length"] == 1 else f"must have at least {context['min_length']} entries"
    ),
    "too_long": lambda context, value: f"must have at most {context['max_length']} entries",
    "list_type": _not("an array"),
    "dict_type": _not("an object"),
    "model_type": _not("an object"),
    "model_attributes_type": _not("an object"),
    "greater_than": _bound("above", "gt"),
    "greater_than_equal": _bound("at least", "ge"),
    "less_than": _bound("below", "lt"),
    "less_than_equal": _bound("at most", "le"),
}


@dataclass
class ErrorLocation:
    """Pydantic's path of an error, without the steps that are not in the document.

    Pydantic adds the tag of the chosen member behind every union: ("shapes", 3, "sphere", "radius"). Only the types
    tell a tag from a field, or from a material named "sphere", so the path is followed along them.

    `steps` in the document; `holder` is the model that the last step is, or would be, a field of.
    """

    steps: list[int | str] = field(default_factory=list)
    holder: type[BaseModel] | None = None


def locate(kind: Any, loc: tuple[int | str, ...]) -> ErrorLocation:
    """Walks `loc` from a value of the type `kind`."""
    place = ErrorLocation()
    for step in loc:
        members = _members(kind)
        if len(members) > 1:
            kind = next((member for member in members if step in _tags(member)), None)
            continue
        kind = _bare(members[0]) if members else None
        place.steps.append(step)
        place.holder = kind if isinstance(kind, type) and issubclass(kind, BaseModel) else None
        kind = _below(kind, step)
    return place


def _members(kind: Any) -> list[Any]:
    """The types that a value of `kind` may have besides null."""
    bare = _bare(kind)
    if get_origin(bare) in (Union, UnionType):
        return [member for part in get_args(bare) if part is not NoneType for member in _members(part)]
    return [kind]


def _bare(kind: Any) -> Any:
    return get_args(kind)[0] if get_origin(kind) is Annotated else kind


def _tags(kind: Any) -> tuple[Any, ...]:
    """The names that pydantic may use for this member of a union: its Tag, or the values of its `type`."""
    named = tuple(extra.tag for extra in getattr(kind, "__metadata__", ()) if isinstance(extra, Tag))
    fields = getattr(_bare(kind), "model_fields", {})
    values = get_args(fields["type"].annotation) if "type" in fields else ()
    return named + values


def _below(kind: Any, step: int | str) -> Any:
    """The type of what `step` leads to."""
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        return kind.model_fields[str(step)].annotation if step in kind.model_fields else None
    arguments = get_args(kind) if get_origin(kind) in (list, dict) else ()
    return arguments[-1] if arguments else None
