"""Expressions that materials are made of: inputs, and what models make of them. They hold for numbers and for
textures alike; the operations are those of MaterialX that no other nodes implement."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from service.formats.types import Doubles, Floats

PROBES = 6
CLOSE = 1e-5  # by how much a probe may differ from a linear function; single precision is 100 times as fine
TINY = np.float32(1e-8)  # the divisor in place of 0, as the library's GLSL has it
LUMINANCE = (0.2722287, 0.6740818, 0.0536895)  # what MaterialX's `luminance` weighs by unless it is told otherwise


class Unsupported(Exception):
    """A part of a graph that has no meaning here; the message says which and why."""


@dataclass(eq=False)
class Tree:
    """One operation, whose value has `size` numbers. Equal parts of a graph are one object, so it has no copies."""

    operation: str
    size: int
    inputs: dict[str, Tree] = field(default_factory=dict)
    value: Floats | Doubles | None = None  # (size,), of a constant
    texts: dict[str, str] = field(default_factory=dict)  # of an image: its file, its colour space, its wrapping


def constant(*numbers: float) -> Tree:
    return Tree("constant", len(numbers), value=np.array(numbers))


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
    """The mix of two, without the one that a share of 0 or 1 hides."""
    size = max(background.size, foreground.size)
    for end, shown in ((0, background), (1, foreground)):
        if share.value is not None and bool((share.value == end).all()) and shown.size == size:
            return shown
    return applied("mix", size, bg=background, fg=foreground, mix=share)


def mean(a: Tree) -> Tree:
    """The mean of the channels."""
    third = constant(*[1.0 / a.size] * a.size)
    return a if a.size == 1 else applied("dotproduct", 1, in1=a, in2=third)


def largest(a: Tree) -> Tree:
    """The largest channel."""
    return a if a.size == 1 else Tree("largest", 1, {"in": a})


def alike(a: Tree, b: Tree) -> bool:
    """True if two trees compute the same by the same operations."""
    seen, left = set[tuple[int, int]](), [(a, b)]
    while left:
        one, other = left.pop()
        if one is other or (id(one), id(other)) in seen:
            continue
        seen.add((id(one), id(other)))
        own, others = ({k: v for k, v in vars(each).items() if k not in ("inputs", "value")} for each in (one, other))
        if own != others or one.inputs.keys() != other.inputs.keys():
            return False
        if not np.array_equal(_numbers(one), _numbers(other)):
            return False
        left += [(found, other.inputs[name]) for name, found in one.inputs.items()]
    return True


def _numbers(tree: Tree) -> Any:
    return () if tree.value is None else tree.value.astype(np.float32)


def walk(tree: Tree) -> list[Tree]:
    """All trees of which this one is made, each once, itself first."""
    seen, left = {id(tree): tree}, [tree]
    while left:
        for one in left.pop().inputs.values():
            if id(one) not in seen:
                seen[id(one)] = one
                left.append(one)
    return list(seen.values())


Values = dict[str, Any]  # of a tree's inputs by name: (n, size), or (1, size) where all n are the same
Operation = Callable[[Values, Tree], Any]


def plain(function: Callable[..., Any], *names: str) -> Operation:
    """A function of the inputs of these names."""
    return lambda v, tree: function(*(v[name] for name in names))


# What formulas are made of; a file's own graphs have more (`read/materialx/operations.py`).
OPERATIONS: dict[str, Operation] = {
    "add": plain(np.add, "in1", "in2"),
    "subtract": plain(np.subtract, "in1", "in2"),
    "multiply": plain(np.multiply, "in1", "in2"),
    "divide": lambda v, tree: v["in1"] / np.where(v["in2"] == 0, TINY, v["in2"]),
    "power": lambda v, tree: np.power(np.maximum(v["in1"], 0), v["in2"]),
    "clamp": lambda v, tree: np.minimum(np.maximum(v["in"], v["low"]), v["high"]),
    "absval": plain(np.abs, "in"),
    "dotproduct": lambda v, tree: (v["in1"] * v["in2"]).sum(axis=1, keepdims=True),
    "largest": lambda v, tree: v["in"].max(axis=1, keepdims=True),
    "mix": lambda v, tree: v["bg"] * (1 - v["mix"]) + v["fg"] * v["mix"],
    "ifgreatereq": lambda v, tree: np.where(v["value1"] >= v["value2"], v["in1"], v["in2"]),
}


def value(tree: Tree, known: Mapping[int, Any]) -> Doubles:
    """(n or 1, size) the value of a formula in double precision; `known` has those of textures, (n, size) by the
    identities of their trees."""
    if id(tree) in known:
        found = known[id(tree)]
    elif tree.value is not None:
        found = tree.value[None, :].astype(np.float64)
    else:
        found = OPERATIONS[tree.operation]({name: value(one, known) for name, one in tree.inputs.items()}, tree)
    found = np.asarray(found, np.float64)
    return np.repeat(found, tree.size, axis=1) if found.shape[1] == 1 < tree.size else found


def factors(size: int, channels: int, values: Callable[[Doubles], Any]) -> tuple[Doubles, list[int]] | None:
    """For what multiplies the channels of one texture: the factor of each of its `size` numbers, and the channel;
    None where it does something else. `values` (n, channels) -> (n, size) computes it of texels."""
    probes = np.concatenate(
        [np.eye(channels), np.zeros((1, channels)), np.random.default_rng(2).uniform(0, 1, (PROBES, channels))]
    )
    found = np.broadcast_to(values(probes), (len(probes), size)).astype(np.float64)
    matrix = found[:channels]  # (channel, number)
    if not np.isfinite(found).all() or np.abs(found - probes @ matrix).max() > CLOSE * (1 + np.abs(matrix).max()):
        return None
    picked = np.abs(matrix).argmax(axis=0)
    if np.count_nonzero(np.abs(matrix) > CLOSE, axis=0).max() > 1:
        return None
    return matrix[picked, range(size)], [int(one) for one in picked]
