"""Things of a scene that a person can give a name: its shapes and its lights."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import Field

from service.document.base import OMITTABLE, Model, hint

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
