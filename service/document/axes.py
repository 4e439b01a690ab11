"""The axes of a batch: what varies from one of its renders to the next.

An axis says what its j-th step does to a document `{scene, settings}`; axes multiply, and the last runs fastest.
Nothing here takes time or memory in proportion to the product: a render's document is made when it is asked for.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import Discriminator, Field, Tag, model_validator

from service.document.base import Model, refusal
from service.document.text import merge_patch
from service.problems import FieldError, InvalidDocument

MOST_TIMES = 500  # of an animation: each is posed before the batch is accepted
LONGEST_NAME = 60  # characters of a step's name, in a file's name or under a picture


class Values(Model):
    """One place of the scene takes each of the values."""

    path: Annotated[
        str, Field(pattern="^/", max_length=1000, description="A JSON pointer (RFC 6901) into the scene.")
    ]
    values: Annotated[list[Any], Field(min_length=1, description="JSON of any kind, whole materials, too.")]

    @property
    def title(self) -> str:
        return self.path

    def __len__(self) -> int:
        return len(self.values)

    def label(self, step: int) -> str:
        return _short(self.values[step])

    def name(self, step: int) -> str:
        return f"{self.path.rpartition('/')[2]} {self.label(step)}"

    def pointer(self, step: int) -> str:
        return f"/values/{step}"

    def applied(self, document: dict[str, Any], step: int) -> dict[str, Any]:
        scene = _with(document["scene"], _steps(self.path), self.values[step])
        return {**document, "scene": scene}

    def written(self, step: int) -> Any:
        """A step's value in the part of a scene that it changes; entries of lists are members here, named by their
        indices."""
        value = self.values[step]
        for name in reversed(_steps(self.path)):
            value = {name: value}
        return value


class Patches(Model):
    """Merge patches (RFC 7396) of `{scene?, settings?}`, one a step."""

    patches: Annotated[list[dict[str, Any]], Field(min_length=1)]
    names: list[Annotated[str, Field(max_length=LONGEST_NAME)]] | None = None

    @model_validator(mode="after")
    def _has_a_name_each(self) -> Patches:
        if self.names is not None and len(self.names) != len(self.patches):
            raise refusal(f"has {len(self.names)} names for {len(self.patches)} patches: give as many")
        return self

    @property
    def title(self) -> str:
        return ""

    def __len__(self) -> int:
        return len(self.patches)

    def label(self, step: int) -> str:
        return self.names[step] if self.names is not None else f"{step}"

    def name(self, step: int) -> str:
        return self.label(step)

    def pointer(self, step: int) -> str:
        return f"/patches/{step}"

    def applied(self, document: dict[str, Any], step: int) -> dict[str, Any]:
        patch = self.patches[step]
        if unknown := patch.keys() - {"scene", "settings"}:
            raise InvalidDocument([FieldError("", f"has {min(unknown)!r}: only scene and settings can be patched")])
        return dict(merge_patch(document, patch))

    def written(self, step: int) -> Any:
        """See Values."""
        return merge_patch(None, self.patches[step].get("scene"))


class Turntable(Model):
    """The camera turns about +Y through its target, and looks at it all the while."""

    turntable: Annotated[int, Field(ge=1, description="Pictures of a turn; the last does not repeat the first.")]
    degrees: Annotated[float, Field(ge=-36000, le=36000)] = 360.0

    @property
    def title(self) -> str:
        return "turntable"

    def __len__(self) -> int:
        return self.turntable

    def label(self, step: int) -> str:
        return f"{step * self.degrees / self.turntable:g}\N{DEGREE SIGN}"

    def name(self, step: int) -> str:
        return f"{step * self.degrees / self.turntable:g} degrees"

    def pointer(self, step: int) -> str:
        return "/turntable"

    def applied(self, document: dict[str, Any], step: int) -> dict[str, Any]:
        camera = document["scene"].get("camera") if isinstance(document["scene"], dict) else None
        try:
            turned = _turned(camera, math.radians(step * self.degrees / self.turntable))
        except (TypeError, KeyError, ValueError):  # no camera: that is told of the scene itself
            return document
        return {**document, "scene": {**document["scene"], "camera": turned}}

    def written(self, step: int) -> Any:
        """See Values."""
        return {}  # but for numbers


class Times(Model):
    """A glTF file's animation at each of these times: the scene's shapes and lights of the file are posed anew."""

    time: Annotated[
        list[Annotated[float, Field(ge=-1e9, le=1e9)]],
        Field(min_length=1, max_length=MOST_TIMES, description="s, before the start and after the end as there."),
    ]
    asset: Annotated[str, Field(description="The file's id.")]
    animation: Annotated[str, Field(description="By name.")]

    @property
    def title(self) -> str:
        return self.animation

    def __len__(self) -> int:
        return len(self.time)

    def label(self, step: int) -> str:
        return f"{self.time[step]:g} s"

    def name(self, step: int) -> str:
        return self.label(step)

    def pointer(self, step: int) -> str:
        return f"/time/{step}"

    def applied(self, document: dict[str, Any], step: int) -> dict[str, Any]:
        return document  # what moves is known once the file was read

    def written(self, step: int) -> Any:
        """See Values."""
        return {}


class PosedTimes(Times):
    """Such an axis as it is stored, of a batch that was accepted."""

    # For each time the members of things that differ, by the kind of the thing and its place: {"shapes": {"3":
    # {"asset": ...}}}. A member that is null is taken away.
    poses: list[dict[str, dict[str, dict[str, Any]]]]

    def applied(self, document: dict[str, Any], step: int) -> dict[str, Any]:
        scene = dict(document["scene"])
        for kind, moved in self.poses[step].items():
            things = list(scene[kind])
            for place, members in moved.items():
                changed = {**things[int(place)], **members}
                things[int(place)] = {name: value for name, value in changed.items() if value is not None}
            scene[kind] = things
        return {**document, "scene": scene}

    def written(self, step: int) -> Any:
        """See Values."""
        return self.poses[step]


def _kind(value: Any) -> str:
    given = value if isinstance(value, dict) else getattr(value, "__dict__", {})
    return next((kind for kind in ("patches", "turntable", "time") if kind in given), "values")


_Written = (
    Annotated[Values, Tag("values")] | Annotated[Patches, Tag("patches")] | Annotated[Turntable, Tag("turntable")]
)
Axis = Annotated[_Written | Annotated[Times, Tag("time")], Discriminator(_kind)]
StoredAxis = Annotated[_Written | Annotated[PosedTimes, Tag("time")], Discriminator(_kind)]


@dataclass(frozen=True)
class Variations:
    """The documents of a batch, numbered from 0. `base` is `{scene, settings}`."""

    base: dict[str, Any]
    axes: Sequence[Values | Patches | Turntable | Times]

    def __len__(self) -> int:
        return math.prod(map(len, self.axes))

    def steps(self, number: int) -> tuple[int, ...]:
        """The step of each axis; the last axis runs fastest."""
        found = []
        for axis in reversed(self.axes):
            number, step = divmod(number, len(axis))
            found.append(step)
        return tuple(reversed(found))

    def document(self, number: int) -> dict[str, Any]:
        """`{scene, settings}`, which shares with the base what does not vary. Raises InvalidDocument."""
        return self._at(self.steps(number))

    def name(self, number: int) -> str:
        """A name that tells this render from the others, for a person."""
        return ", ".join(axis.name(step) for axis, step in zip(self.axes, self.steps(number), strict=True))

    def labels(self, number: int) -> list[str]:
        """The label of each axis' step, without what the axis varies."""
        return [axis.label(step) for axis, step in zip(self.axes, self.steps(number), strict=True)]

    def one_by_one(self) -> Iterator[tuple[str, dict[str, Any]]]:
        """Each step of each axis, the other axes being at their first: a pointer from the list of axes, and the
        document. As many as the axes' lengths together. Raises InvalidDocument."""
        first = (0,) * len(self.axes)
        for i, axis in enumerate(self.axes):
            # Neither a turn nor a pose makes a scene invalid.
            for step in range(1 if isinstance(axis, Turntable | Times) else len(axis)):
                yield f"/{i}{axis.pointer(step)}", self._at((*first[:i], step, *first[i + 1 :]))

    def _at(self, steps: Sequence[int]) -> dict[str, Any]:
        document = self.base
        for i, (axis, step) in enumerate(zip(self.axes, steps, strict=True)):
            try:
                document = axis.applied(document, step)
            except InvalidDocument as error:
                raise error.under(f"/{i}{axis.pointer(step)}") from None
            except LookupError as error:
                raise InvalidDocument([FieldError(f"/{i}/path", str(error.args[0]))]) from None
        return document


def _steps(path: str) -> list[str]:
    return [step.replace("~1", "/").replace("~0", "~") for step in path[1:].split("/")]


def _with(target: Any, path: list[str], value: Any) -> Any:
    """`target` with `value` at a path, copied along that path only. It may make a member of an object that is there.
    Raises LookupError that says where the path ends."""
    if not path:
        return value
    step, rest = path[0], path[1:]
    if isinstance(target, dict):
        if rest and step not in target:
            raise LookupError(f"leads nowhere: there is no {step!r}")
        return {**target, step: _with(target.get(step), rest, value)}
    if isinstance(target, list):
        if not step.isdecimal() or int(step) >= len(target):
            raise LookupError(
                f"leads nowhere: {step!r} is no index of {len(target)} entries, which are counted from 0"
            )
        i = int(step)
        return [*target[:i], _with(target[i], rest, value), *target[i + 1 :]]
    raise LookupError(
        f"leads nowhere: nothing is below {step!r}" if rest else f"leads nowhere: {step!r} has no place"
    )


def _turned(camera: Any, angle: float) -> dict[str, Any]:
    """The camera turned about +Y through its target, right-handed."""
    target = camera["target"]
    arm = [float(a) - float(b) for a, b in zip(camera["position"], target, strict=True)]
    turned = _rotated(arm, angle)
    up = {"up": _rotated([float(x) for x in camera["up"]], angle)} if "up" in camera else {}
    return {**camera, "position": [float(a) + b for a, b in zip(target, turned, strict=True)], **up}


def _rotated(v: Sequence[float], angle: float) -> list[float]:
    if angle == 0.0:
        return list(v)
    c, s = math.cos(angle), math.sin(angle)
    return [c * v[0] + s * v[2], v[1], c * v[2] - s * v[0]]


def _short(value: Any) -> str:
    if isinstance(value, bool | int | float | str):
        text = f"{value:g}" if isinstance(value, float) else str(value)
    elif isinstance(value, list) and all(isinstance(each, int | float) for each in value):
        text = " ".join(f"{each:g}" for each in value)
    elif isinstance(value, dict):
        text = str(value.get("type", "object"))
    else:
        text = "null" if value is None else "list"
    return text[:LONGEST_NAME]
