"""Expressions that materials are made of: nodes of the standard library without an implementation by other nodes."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from service.formats.types import Floats

LUMINANCE = (0.2722287, 0.6740818, 0.0536895)  # what MaterialX's `luminance` weighs by unless it is told otherwise


class Unsupported(Exception):
    """A part of a graph that has no meaning here; the message says which and why."""


@dataclass(eq=False)
class Tree:
    """One operation, whose value has `size` numbers. Equal parts of a graph are one object, so it has no copies."""

    operation: str
    size: int
    inputs: dict[str, Tree] = field(default_factory=dict)
    value: Floats | None = None  # (size,), of a constant
    texts: dict[str, str] = field(default_factory=dict)  # of an image: its file, its colour space, its wrapping


def constant(*numbers: float) -> Tree:
    return Tree("constant", len(numbers), value=np.array(numbers, np.float32))


def applied(operation: str, size: int, **inputs: Tree) -> Tree:
    return Tree(operation, size, inputs)


def added(a: Tree, b: Tree) -> Tree:
    return applied("add", max(a.size, b.size), in1=a, in2=b)


def less(a: Tree, b: Tree) -> Tree:
    return applied("subtract", max(a.size, b.size), in1=a, in2=b)


def times(a: Tree, b: Tree | float) -> Tree:
    """The product, without a factor of one."""
    other = b if isinstance(b, Tree) else constant(b)
    for one, rest in ((a, other), (other, a)):
        if one.value is not None and bool((one.value == 1).all()) and rest.size >= one.size:
            return rest
    return applied("multiply", max(a.size, other.size), in1=a, in2=other)


def quotient(a: Tree, b: Tree) -> Tree:
    return applied("divide", max(a.size, b.size), in1=a, in2=b)


def raised(a: Tree, exponent: float) -> Tree:
    return applied("power", a.size, in1=a, in2=constant(exponent))


def complement(a: Tree) -> Tree:
    return less(constant(1.0), a)


def clamped(a: Tree, low: float, high: float) -> Tree:
    return applied("clamp", a.size, **{"in": a, "low": constant(low), "high": constant(high)})


def mixed(background: Tree, foreground: Tree, share: Tree) -> Tree:
    return applied("mix", max(background.size, foreground.size), bg=background, fg=foreground, mix=share)


def mean(a: Tree) -> Tree:
    """The mean of the channels."""
    third = constant(*[1.0 / a.size] * a.size)
    return a if a.size == 1 else applied("dotproduct", 1, in1=a, in2=third)


def largest(a: Tree) -> Tree:
    """The largest channel."""
    return a if a.size == 1 else Tree("largest", 1, {"in": a})


def walk(tree: Tree) -> list[Tree]:
    """All trees of which this one is made, each once, itself first."""
    seen, left = {id(tree): tree}, [tree]
    while left:
        for one in left.pop().inputs.values():
            if id(one) not in seen:
                seen[id(one)] = one
                left.append(one)
    return list(seen.values())
