"""Pydantic's path of an error, without the steps that are not in the document.

Pydantic adds the tag of the chosen member behind every union: ("shapes", 3, "sphere", "radius"). Only the types tell
a tag from a field, or from a material named "sphere", so the path is followed along them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from types import NoneType, UnionType
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import BaseModel, Tag


@dataclass
class ErrorLocation:
    """`steps` in the document; `holder` is the model that the last step is, or would be, a field of."""

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
