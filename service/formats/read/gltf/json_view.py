"""A JSON object of a file with its place, so that errors name their pointer."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from service.formats.errors import ParseError
from service.formats.read.scenes.warnings import Warnings
from service.formats.types import BRIGHTEST, LARGEST
from service.problems import escaped

LARGEST_WHOLE = 1 << 53  # JSON's whole numbers are exact up to this one
NUMBERS = {int, float}  # the types of numbers; bool is not among them


class JsonView:
    """A JSON object whose values are read by type. Methods raise ParseError where a value has another type."""

    def __init__(self, value: Any, pointer: str) -> None:
        if not isinstance(value, dict):
            raise ParseError(f"must be an object, not {shown(value)}", pointer)
        self.value: dict[str, Any] = value
        self.pointer = pointer

    def __contains__(self, name: str) -> bool:
        return name in self.value

    def at(self, name: str | int) -> str:
        return f"{self.pointer}/{escaped(name)}"

    def error(self, name: str | int, detail: str) -> ParseError:
        return ParseError(detail, self.at(name))

    def object(self, name: str) -> JsonView | None:
        return self._inner(name) if name in self.value else None

    def _inner(self, name: str) -> JsonView | None:
        return JsonView(self.value[name], self.at(name))

    def need(self, name: str) -> JsonView:
        found = self.object(name)
        if found is None:
            raise self.error(name, "is missing")
        return found

    def array(self, name: str) -> list[Any]:
        found = self.value.get(name, [])
        if not isinstance(found, list):
            raise self.error(name, f"must be an array, not {shown(found)}")
        return found

    def objects(self, name: str) -> Iterator[JsonView]:
        for k, one in enumerate(self.array(name)):
            yield JsonView(one, f"{self.at(name)}/{k}")

    def extension(self, name: str) -> JsonView | None:
        extensions = self.object("extensions")
        return extensions.object(name) if extensions else None

    def whole(self, name: str, default: int | None = None, low: int = 0) -> int:
        return whole(self.value.get(name, default), self.at(name), low)

    def number(self, name: str, default: float, low: float = -math.inf, high: float = math.inf) -> float:
        value = number(self.value.get(name, default), self.at(name))
        if not low <= value <= high:
            limits = f"at least {low:g}" if high == math.inf else f"from {low:g} to {high:g}"
            raise self.error(name, f"must be {limits}, not {value:.9g}")
        return value

    def numbers(self, name: str, default: tuple[float, ...], most: float = LARGEST) -> tuple[float, ...]:
        """As many numbers as the default has, each from -`most` to `most`."""
        found = self.value.get(name, default)
        if not isinstance(found, list | tuple) or len(found) != len(default):
            raise self.error(name, f"must be {len(default)} numbers, not {shown(found)}")
        if {*map(type, found)} <= NUMBERS and abs(max(found, key=abs)) <= most:  # the quick way: files have millions
            return tuple(map(float, found))
        for k, one in enumerate(found):
            number(one, f"{self.at(name)}/{k}")
        raise self.error(name, f"must be at most {most:g}: {shown(found)}")

    def color(self, name: str, default: tuple[float, ...]) -> tuple[float, ...]:
        """Numbers that are not negative."""
        found = self.numbers(name, default)
        if min(found) < 0:
            raise self.error(name, f"must not be negative: {shown(list(found))}")
        return found

    def radiance(self, name: str, default: tuple[float, ...], scale: float) -> list[float]:
        """A colour times `scale`, within the range of radiance."""
        found = [scale * value for value in self.color(name, default)]
        if max(found) > BRIGHTEST:
            raise self.error(name, f"times its strength or intensity must be at most {BRIGHTEST:g}: {max(found):g}")
        return found

    def flag(self, name: str, default: bool = False) -> bool:
        found = self.value.get(name, default)
        if type(found) is not bool:
            raise self.error(name, f"must be true or false, not {shown(found)}")
        return found

    def text(self, name: str, default: str = "") -> str:
        found = self.value.get(name, default)
        if not isinstance(found, str):
            raise self.error(name, f"must be a string, not {shown(found)}")
        return found


class LenientView(JsonView):
    """An object of which no member costs the others: what can't be used has its default, and a number out of range
    the nearest one within. Each is noted."""

    def __init__(self, value: Any, pointer: str, notes: Warnings) -> None:
        super().__init__(value, pointer)
        self.notes = notes

    def _inner(self, name: str) -> JsonView | None:
        if isinstance(self.value[name], dict):
            return LenientView(self.value[name], self.at(name), self.notes)
        self.notes.add(self.at(name), f"must be an object, not {shown(self.value[name])}; it is left out")
        return None

    def number(self, name: str, default: float, low: float = -math.inf, high: float = math.inf) -> float:
        try:
            return super().number(name, default, low, high)
        except ParseError as error:
            value = self.value.get(name, default)
            is_number = type(value) in NUMBERS and abs(value) < math.inf
            return float(self._instead(error, min(max(value, low), high) if is_number else default))

    def numbers(self, name: str, default: tuple[float, ...], most: float = LARGEST) -> tuple[float, ...]:
        try:
            return super().numbers(name, default, most)
        except ParseError as error:
            self._instead(error, default)
            return default

    def color(self, name: str, default: tuple[float, ...]) -> tuple[float, ...]:
        found = self.value.get(name)
        if isinstance(found, list) and len(found) == 3 and len(default) == 4:
            self._instead(self.error(name, f"must be 4 numbers, not {shown(found)}"), [*found, 1])
            return (*LenientView({name: found}, self.pointer, self.notes).color(name, default[:3]), 1.0)
        try:
            return super().color(name, default)
        except ParseError as error:  # `numbers` gives none: some are negative
            used = tuple(max(value, 0.0) for value in self.numbers(name, default))
            self._instead(error, used)
            return used

    def radiance(self, name: str, default: tuple[float, ...], scale: float) -> list[float]:
        try:
            return super().radiance(name, default, scale)
        except ParseError as error:
            self._instead(error, BRIGHTEST)
            return [min(scale * value, BRIGHTEST) for value in self.color(name, default)]

    def flag(self, name: str, default: bool = False) -> bool:
        try:
            return super().flag(name, default)
        except ParseError as error:
            self.notes.add(error.pointer, f"{error.detail}; {str(default).lower()} is used instead")
            return default

    def text(self, name: str, default: str = "") -> str:
        try:
            return super().text(name, default)
        except ParseError as error:
            self.notes.add(error.pointer, f"{error.detail}; {default or 'none'} is used instead")
            return default

    def _instead(self, error: ParseError, used: Any) -> Any:
        values = [f"{value:g}" if isinstance(value, int | float) else shown(value) for value in
                  (used if isinstance(used, list | tuple) else [used])]  # fmt: skip
        verb = "are" if len(values) > 1 else "is"
        self.notes.add(error.pointer, f"{error.detail}; {' '.join(values)} {verb} used instead")
        return used


def whole(value: Any, pointer: str, low: int = 0) -> int:
    if value is None:
        raise ParseError("is missing", pointer)
    if isinstance(value, float) and value.is_integer() and abs(value) < LARGEST_WHOLE:
        value = int(value)  # 3.0 is 3 in JSON
    if type(value) is not int or not low <= value < LARGEST_WHOLE:
        raise ParseError(f"must be a whole number of at least {low}, not {shown(value)}", pointer)
    return value


def number(value: Any, pointer: str) -> float:
    if type(value) not in NUMBERS or not abs(value) < 1e308:
        raise ParseError(f"must be a finite number, not {shown(value)}", pointer)
    return float(value)


def shown(value: Any) -> str:
    """A short text for any value, for messages."""
    if isinstance(value, dict):
        return "an object"
    if isinstance(value, list) and len(value) > 16:
        return f"an array of {len(value)}"
    text = "null" if value is None else repr(value)
    return text if len(text) <= 60 else text[:60] + "…"
