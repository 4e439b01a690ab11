"""A surface shader as a model reads it: its inputs as trees, and the material that they make.

A format's reader says what the inputs of its file are. What they mean stands in the files of the models, once for all
formats.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import Any

import numpy as np

from service.formats.surface.trees import Tree, Unsupported, applied, constant
from service.formats.types import BRIGHTEST, LARGEST

LEAST_LENGTH = 1e-9  # metres
# Ranges of parameters that are no shares.
RANGES = {
    "ior": (1.0, 4.0), "attenuation_distance": (LEAST_LENGTH, LARGEST), "anisotropic_rotation": (-LARGEST, LARGEST),
    "specular_weight": (0.0, 1e6), "specular_ior": (1e-3, 1e3), "coat_ior": (1e-3, 1e3),
    "thin_film_ior": (1e-3, 1e3), "thin_film_thickness": (0.0, 1e6), "film_ior": (1.0, 4.0),
    "film_thickness": (0.0, 1e4), "emission_luminance": (0.0, LARGEST), "emission": (0.0, BRIGHTEST),
    "emission_color": (0.0, BRIGHTEST), "subsurface_radius": (0.0, LARGEST), "transmission_depth": (0.0, LARGEST),
    "transmission_scatter_anisotropy": (-1.0, 1.0), "subsurface_scatter_anisotropy": (-1.0, 1.0),
}  # fmt: skip
COLORS = (
    "base_color", "attenuation_color", "specular_color", "sheen_color", "emission", "transmission_color",
    "coat_color", "fuzz_color", "emission_color", "subsurface_color", "diffuse_transmission_color",
)  # fmt: skip
TANGENT = "a tangent of the file's own is not supported; that of the texture coordinates is used"
Triple = tuple[float, float, float]
# What a loss weighs beside others: an approximation, a parameter, a whole part of the material.
ROUGHLY, LOST, PART = 0.5, 1.0, 2.0


class Inputs(ABC):
    """One surface shader. `material` collects the parameters of `principled`, or of the model that a reading makes
    it."""

    unit = 1.0  # metres of the file's unit of length
    computes = True  # whether any formula of textures becomes a texture of its own

    def __init__(self) -> None:
        self.material: dict[str, Any] = {"type": "principled"}
        self.is_trial = False  # it only finds out what would be lost: nothing is warned of and no image is made
        self.losses: dict[tuple[str, str], float] = {}  # what each weighs, by its input and its words

    def note(self, name: str, detail: str, weight: float = LOST) -> None:
        """Warn of a loss at the place of an input."""
        self.losses[name, detail] = weight
        if not self.is_trial:
            self.warn(name, detail)

    @abstractmethod
    def tree(self, name: str) -> Tree:
        """An input, or its default. A part that has no meaning here is `unsupported`."""

    @abstractmethod
    def is_given(self, name: str) -> bool:
        """True if the file says anything about an input."""

    @abstractmethod
    def fixed(self, tree: Tree) -> Any:
        """(size,) the value of a tree that is the same everywhere; None for any other. Raises Unsupported."""

    @abstractmethod
    def most(self, name: str) -> Any:
        """(size,) what an input is where its textures are white."""

    @abstractmethod
    def value(self, tree: Tree, name: str, low: float, high: float, is_color: bool) -> Any:
        """A number, a colour or a reference to a texture within a range, whose place is that of the input `name`.
        Raises Unsupported."""

    @abstractmethod
    def bump(self, name: str) -> dict[str, Any] | None:
        """The normal map of an input; None for the surface's own normal, and with a warning for any other. Raises
        Unsupported."""

    @abstractmethod
    def direction(self, name: str) -> tuple[float, float] | None:
        """A tangent along those of the texture coordinates; None where it is something else."""

    @abstractmethod
    def height(self, name: str) -> None:
        """Set the heights above the surface."""

    @abstractmethod
    def warn(self, name: str, detail: str) -> None:
        """Warn at the place of an input."""

    def masked(self, name: str, mask: str) -> Tree:
        """The input where the input `mask` is at least 0.5, 0 elsewhere."""
        return applied(
            "ifgreatereq", 1, value1=self.tree(mask), value2=constant(0.5), in1=self.tree(name), in2=constant(0.0)
        )

    def is_set(self, name: str) -> bool:
        """True if a switch is on."""
        found = self.constant(name)
        return found is not None and found[0] > 0

    def constant(self, name: str) -> list[float] | None:
        """The value of an input that is the same everywhere; None for any other, and for one without a meaning."""
        found = known(self, self.tree(name))
        return None if found is None else [float(one) for one in found]

    def number(self, name: str, otherwise: float) -> float:
        """The value of an input that must be the same everywhere."""
        found = self.constant(name)
        if found is None:
            self.note(name, f"a value that differs from place to place is not supported here; {otherwise:g} is used")
            return otherwise
        return found[0]

    def triple(self, name: str, otherwise: Triple) -> Triple:
        """The colour of an input that must be the same everywhere."""
        found = self.constant(name)
        if found is None:
            words = " ".join(f"{each:g}" for each in otherwise)
            self.note(name, f"a colour that differs from place to place is not supported here; {words} is used")
            return otherwise
        red, green, blue = found if len(found) == 3 else found[:1] * 3
        return red, green, blue

    def is_used(self, name: str, neutral: float) -> bool:
        """True if an input is other than the value by which it does nothing."""
        found = self.constant(name)
        return found is None or any(abs(one - neutral) > 1e-6 for one in found)

    def is_black(self, tree: Tree) -> bool:
        found = known(self, tree)
        return found is not None and bool(np.abs(found).max() < 1e-9)

    def lose(self, names: Iterable[tuple[str, float, str]]) -> None:
        """Say of each of these inputs, where it is not neutral, that the model has nothing for it."""
        for name, neutral, detail in names:
            if self.is_used(name, neutral):
                self.note(name, detail)

    def put(
        self, parameter: str, name: str, tree: Tree, default: float | None = None, instead: Tree | None = None
    ) -> None:
        """Set a parameter to a tree, whose place is that of the input `name`; not where that is its default.
        `instead` serves where the format's reader cannot compute the tree."""
        low, high = RANGES.get(parameter, (0.0, 1.0))
        try:
            if self.is_trial and self.computes:
                value = _tried(self, tree, name, low, high)
            else:
                value = self.value(tree, name, low, high, is_color=parameter in COLORS)
        except Unsupported as problem:
            how = "the parameter is left out" if instead is None else "the input itself is used instead"
            self.note(name, f"{problem}; {how}")
            if instead is not None:
                self.put(parameter, name, instead, default)
            return
        if default is None or isinstance(value, dict | list) or abs(value - default) > 1e-6:
            self.material[parameter] = value

    def normal(self, parameter: str, name: str) -> None:
        if self.is_trial:
            return
        try:
            found = self.bump(name)
        except Unsupported as problem:
            self.note(name, f"{problem}; the normal map is left out")
            return
        if found is not None:
            self.material[parameter] = found

    def tangent(self, parameter: str, name: str, degrees: float = 0.0) -> None:
        """Set a tangent to that of an input, turned counter-clockwise; not where it is the surface's own."""
        x, y = self.direction(name) or (0.0, 0.0)
        length = math.hypot(x, y)
        if not 1e-6 < length < 1e9:
            self.note(name, TANGENT)
            x, y, length = 1.0, 0.0, 1.0
        c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
        turned = [round(one / length, 6) + 0.0 for one in (c * x - s * y, s * x + c * y)]
        if turned != [1.0, 0.0]:
            self.material[parameter] = [*turned, 0.0]


def known(s: Inputs, tree: Tree) -> Any:
    """(size,) as of `fixed`; None also for a tree that has no meaning here, of which `put` warns."""
    try:
        return s.fixed(tree)
    except Unsupported:
        return None


def _tried(s: Inputs, tree: Tree, name: str, low: float, high: float) -> Any:
    """What `value` would give, without an image that takes long to compute."""
    found = s.fixed(tree)
    if found is None:
        return {}
    inside = np.clip(found, low, high)
    if np.abs(inside - found).max() > 1e-6:
        s.note(name, f"values beyond {low:g}..{high:g}")
    numbers = [float(one) for one in inside]
    return numbers[0] if len(set(numbers)) == 1 else numbers
