"""The base of every model of the document: strictness, how a validator reports an error, and the names that people
give to shapes and lights.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import islice
from types import NoneType
from typing import Annotated, Any, Literal, get_args

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, GetCoreSchemaHandler, GetPydanticSchema, model_validator
from pydantic_core import CoreSchema, PydanticCustomError

# The parts of a material, under which the editor shows its parameters.
Group = Literal["Base", "Specular", "Coat", "Sheen", "Transmission", "Subsurface", "Film", "Emission", "Geometry"]
# What can be the width of a highlight: a perceptual roughness, the alpha of a distribution of facets, or the exponent
# of a cosine, that of half vectors or that of mirrored directions.
Width = Literal["roughness", "alpha", "exponent", "mirrored exponent"]
REFUSAL = "refusal"  # the type, among pydantic's errors, of those that our validators raise
MOST_MISTAKES = 100  # after which the search ends: a list of ten thousand wrong spheres only repeats itself


class Model(BaseModel):
    # strict: "1" and true are no numbers; frozen: a scene is shared between threads and never edited in place.
    model_config = ConfigDict(
        strict=True, extra="forbid", allow_inf_nan=False, frozen=True, arbitrary_types_allowed=True
    )

    @model_validator(mode="before")
    @classmethod
    def _without_most_unknown_names(cls, value: Any) -> Any:
        """Drop unknown names beyond those that suffice to refuse the object: pydantic makes an error of each, even of
        a hundred thousand, and lets no other thread run meanwhile."""
        if not isinstance(value, dict) or len(value) <= MOST_MISTAKES:  # the usual case; `model_fields` takes time
            return value
        fields = cls.model_fields
        if len(value) <= len(fields) + MOST_MISTAKES:
            return value
        unknown = islice((name for name in value if name not in fields), MOST_MISTAKES)
        return {name: value[name] for name in fields if name in value} | {name: value[name] for name in unknown}


def refusal(detail: str, at: str = "") -> PydanticCustomError:
    """The error for a validator to raise; `at` is a JSON pointer from the validated value."""
    return PydanticCustomError(REFUSAL, "{detail}", {"detail": detail, "at": at})


# Where a function is sampled, closer towards both ends, where the square roots of optics bend. Lines between the
# values are within 0.001 of them.
FOLLOWED = [round((1 - math.cos(math.pi * i / 64)) / 2, 9) for i in range(65)]


def hint(
    title: str,
    description: str,
    group: Group | None = None,
    *,
    unit: str | None = None,
    widget: str | None = None,
    soft: tuple[float, float] | float | None = None,
    default: float | None = None,
    absent: str | None = None,
    follows: tuple[str, Callable[[float], float]] | None = None,
    ranges: tuple[str, Mapping[Any, tuple[float, float]]] | None = None,
    used: tuple[str, Sequence[str]] | None = None,
    unless: str | None = None,
    beside: str | None = None,
    example: list[float] | None = None,
    highlight: tuple[Width, str | None] | None = None,
    new: dict[str, str] | None = None,
    known_as: str | None = None,
    asset: tuple[str, tuple[str, ...]] | None = None,
    log: float | None = None,
) -> Any:
    """The editor's hints for a field, as metadata for Annotated.

    `group` is the part of a material that the field belongs to. `soft` is where a slider ends whose range goes on, or
    both its ends; `default`: shown in the schema where the field's own default is None. For a field that may be left
    out: `absent` is a word for what holds then; `follows` names the field, of the range 0 to 1, that sets it then,
    and how. `ranges` names a field with a choice, and the range for each of its values; `used` the choices with which
    the field has a meaning, `unless` the field that takes its place where it is given, and `example` is what it
    begins with there. `beside` names a field without which it must not stand. `highlight` says in what sense the
    field is the width of the highlight, and names the field of the highlight's colour, where it has its own. `new`
    is what the editor begins an entry of a table with. `known_as` is the name that other models have for the
    parameter. `asset` is the kind of the file that a reference leads to, with the endings of such files' names, where
    the editor lets choose one. `log` is where a slider begins that goes over decades; below it is only 0.
    """
    extra: dict[str, Any] = {}
    if group is not None:
        extra["x-group"] = group
    if unit is not None:
        extra["x-unit"] = unit
    if widget is not None:
        extra["x-widget"] = widget
    if isinstance(soft, tuple):
        extra["x-soft-minimum"], soft = soft
    if soft is not None:
        extra["x-soft-maximum"] = soft
    if default is not None:
        extra["default"] = default
    if absent is not None:
        extra["x-absent"] = absent
    if follows is not None:
        name, function = follows
        extra["x-follows"] = {"field": name, "points": [[x, function(x)] for x in FOLLOWED]}
    if ranges is not None:
        name, bounds = ranges
        extra["x-ranges"] = {"field": name, "bounds": {key: list(ends) for key, ends in bounds.items()}}
    if beside is not None:
        extra["x-beside"] = beside
    if used is not None:
        name, values = used
        extra["x-used"] = {"field": name, "values": list(values)}
    if unless is not None:
        extra["x-unless"] = unless
    if example is not None:
        extra["examples"] = [example]
    if highlight is not None:
        width, color = highlight
        extra["x-highlight"] = {"as": width} | ({} if color is None else {"color": color})
    if new is not None:
        extra["x-new"] = new
    if known_as is not None:
        extra["x-known-as"] = known_as
    if asset is not None:
        kind, endings = asset
        extra["x-asset"] = {"kind": kind, "endings": list(endings)}
    if log is not None:
        extra["x-log"] = log
    return Field(title=title, description=description, json_schema_extra=extra)


slider = partial(hint, widget="slider", unit="")
picker = partial(hint, widget="color", unit="")
entry = partial(hint, widget="number", unit="m")  # a box for a number, or for several
dial = partial(hint, widget="angle", unit="degrees")


def field_names(model: type[BaseModel]) -> list[str]:
    """A model's own fields before those that it shares with all of its kind: the order of a form."""
    kind = next(c for c in reversed(model.__mro__) if issubclass(c, Model) and c is not Model and c.__annotations__)
    return sorted(model.model_fields, key=lambda name: kind is not model and name in kind.__annotations__)


def _without_null(source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
    (kind,) = (argument for argument in get_args(source) if argument is not NoneType)
    return handler(kind)


# On `T | None = None`: the field may be left out, but null is no value for it (in a merge patch null removes).
OMITTABLE = GetPydanticSchema(_without_null)


Name = Annotated[
    Annotated[str, Field(min_length=1, max_length=500)] | None,
    OMITTABLE,
    hint("Name", "For people: nothing refers to it. Slashes make groups, as in a path: Truck/Wheels/Left."),
]


class Named(Model):
    """Two that differ in nothing but `name` are equal: they look the same."""

    def __eq__(self, other: Any) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        ours, theirs = self.__dict__, other.__dict__
        return all(_equal(value, theirs[key]) for key, value in ours.items() if key != "name")

    def __hash__(self) -> int:
        return hash(tuple(value for key, value in self.__dict__.items() if key != "name"))


def _equal(a: Any, b: Any) -> bool:
    """Arrays by value: pydantic's own comparison has no answer for them."""
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return np.array_equal(a, b)
    return type(a) is type(b) and bool(a == b)
