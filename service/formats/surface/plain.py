"""Inputs that are numbers, colours and references to textures: of formats whose files compute nothing else."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from service.formats.surface.inputs import Inputs
from service.formats.surface.trees import Tree, Unsupported, constant, factors, times, value, walk
from service.formats.types import Doubles

Default = float | tuple[float, float, float] | None  # None: a direction, which the surface gives
Given = float | tuple[float, ...] | dict[str, Any]


@dataclass(eq=False)
class Texture(Tree):
    """A texture of the document, and how a parameter refers to it."""

    reference: dict[str, Any] = field(default_factory=dict)


class PlainInputs(Inputs):
    """`defaults` has each input of the model. A texture times a number stays a texture; other formulas of textures
    are unsupported."""

    computes = False

    def __init__(self, defaults: Mapping[str, Default]) -> None:
        super().__init__()
        self.defaults = defaults
        self._trees: dict[str, Tree] = {}

    @abstractmethod
    def given(self, name: str, default: Default) -> Given | None:
        """A number, a colour or a reference to a texture; None for the default."""

    @abstractmethod
    def is_textured(self, name: str) -> bool:
        """True if an input differs from place to place. It is asked of inputs that may not be read at all."""

    def tree(self, name: str) -> Tree:
        if name not in self._trees:
            default = self.defaults[name]
            self._trees[name] = tree_of(self.given(name, default), default)
        return self._trees[name]

    def constant(self, name: str) -> list[float] | None:
        return None if self.is_textured(name) else super().constant(name)

    def fixed(self, tree: Tree) -> Any:
        return None if _textures(tree) else value(tree, {})[0]

    def most(self, name: str) -> Any:
        tree = self.tree(name)
        return value(tree, {id(one): np.ones((1, one.size)) for one in _textures(tree)})[0]

    def direction(self, name: str) -> tuple[float, float] | None:
        return None if self.is_given(name) else (1.0, 0.0)

    def height(self, name: str) -> None:
        if self.is_textured(name):
            self.note(name, "displacement is not read")

    def value(self, tree: Tree, name: str, low: float, high: float, is_color: bool) -> Any:
        found = self.fixed(tree)
        if found is not None:
            return _number(self._within(found, name, low, high), is_color)
        texture, *others = _textures(tree)
        by = None if others else _factors(tree, texture)
        if by is None:
            raise Unsupported("what is computed of its textures is not supported")
        if not np.abs(by).max():
            return _number(by, is_color)
        return texture.reference | self.scale(_number(self._within(by, name, 0.0, high), is_color))

    def scale(self, factor: Any) -> dict[str, Any]:
        """The member of a reference that says its factor."""
        return {} if factor == 1 else {"factor": factor}

    def _within(self, values: Any, name: str, low: float, high: float) -> Any:
        if not np.isfinite(values).all():
            raise Unsupported("its value is not a finite number")
        inside = np.clip(values, low, high)
        if np.abs(inside - values).max() > 1e-6:
            nearest = ", ".join(f"{one:g}" for one in sorted(set(inside[inside != values].tolist())))
            self.note(name, f"values beyond {low:g}..{high:g} are not supported; {nearest} is used instead")
        return inside


def tree_of(found: Given | None, default: Default) -> Tree:
    """The tree of what `given` says."""
    size = 3 if isinstance(default, tuple) else 1
    if isinstance(found, dict):
        reference = dict(found)
        factor = reference.pop("factor", 1.0)
        by = constant(*factor) if isinstance(factor, list) else constant(factor)
        return times(Texture("texture", size, reference=reference), by)
    plain = default if found is None else found
    numbers = plain if isinstance(plain, tuple) else (plain or 0.0,) * size
    return constant(*numbers[:size])


def _number(values: Any, is_color: bool) -> Any:
    numbers = [float(one) for one in values]
    return numbers[0] if not is_color or len(set(numbers)) == 1 else numbers


def _textures(tree: Tree) -> list[Texture]:
    """Those that a tree reads, each once."""
    return [one for one in walk(tree) if isinstance(one, Texture)]


def _factors(tree: Tree, texture: Texture) -> Any:
    """(size,) what the channels of the only texture of a tree are multiplied by; None where it is something else. A
    number that follows from a colour's texture is read of it as of a grey one."""
    channels = texture.size if tree.size == texture.size else 1

    def values(texels: Doubles) -> Any:
        return value(tree, {id(texture): np.repeat(texels, texture.size // channels, axis=1)})

    found = factors(tree.size, channels, values)
    if found is None:
        return None
    by, picked = found
    return by if all(k % channels == picked[k] for k in range(tree.size) if by[k]) else None
