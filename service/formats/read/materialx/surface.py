"""One surface shader of a file, as the models' readers see it: its inputs as trees, and the material they make."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from service.document.numbers import LARGEST
from service.formats.read.materialx.evaluation import fixed, in_frame
from service.formats.read.materialx.graph import Graphs
from service.formats.read.materialx.trees import Tree, Unsupported
from service.formats.read.materialx.values import Values

BRIGHTEST = 1e6
# Ranges of parameters that are no shares, and colours without an upper end.
RANGES = {
    "ior": (1.0, 4.0), "attenuation_distance": (1e-9, 1e9), "anisotropic_rotation": (-1e9, 1e9),
    "specular_weight": (0.0, BRIGHTEST), "specular_ior": (1e-3, 1e3), "coat_ior": (1e-3, 1e3),
    "thin_film_ior": (1e-3, 1e3), "thin_film_thickness": (0.0, BRIGHTEST),
    "film_ior": (1.0, 4.0), "film_thickness": (0.0, 1e4),
    "emission_luminance": (0.0, 1e9),
}  # fmt: skip
COLORS = (
    "base_color", "attenuation_color", "specular_color", "sheen_color", "emission", "transmission_color",
    "coat_color", "fuzz_color", "emission_color", "subsurface_color", "diffuse_transmission_color",
)  # fmt: skip
NITS = 1 / 683  # watts of a lumen
TANGENT = "a tangent of the file's own is not supported; that of the texture coordinates is used"


@dataclass
class Surface:
    """A shader node. `material` collects the parameters of `principled`, or of the model that a reader makes it."""

    node: Any
    graphs: Graphs
    values: Values
    material: dict[str, Any] = field(default_factory=lambda: {"type": "principled"})

    def tree(self, name: str) -> Tree:
        return self.graphs.input(self.node, name)

    def place(self, name: str = "") -> str:
        path = self.node.getNamePath()
        return self.graphs.place(f"{path}/{name}" if name else path)

    def note(self, name: str, detail: str) -> None:
        self.graphs.notes.add(self.place(name), detail)

    def is_set(self, name: str) -> bool:
        """Whether a switch is on."""
        found = self.constant(name)
        return found is not None and found[0] > 0

    def constant(self, name: str) -> list[float] | None:
        """The value of an input that is the same everywhere; None for any other, and for one without a meaning."""
        try:
            found = fixed(self.tree(name))
        except Unsupported:
            return None
        return None if found is None else [float(one) for one in found]

    def number(self, name: str, otherwise: float) -> float:
        """The value of an input that must be the same everywhere."""
        found = self.constant(name)
        if found is None:
            self.note(name, f"a value that differs from place to place is not supported here; {otherwise:g} is used")
            return otherwise
        return found[0]

    def triple(self, name: str, otherwise: tuple[float, float, float]) -> tuple[float, float, float]:
        """The colour of an input that must be the same everywhere."""
        found = self.constant(name)
        if found is None:
            words = " ".join(f"{each:g}" for each in otherwise)
            self.note(name, f"a colour that differs from place to place is not supported here; {words} is used")
            return otherwise
        red, green, blue = found if len(found) == 3 else found[:1] * 3
        return red, green, blue

    def is_used(self, name: str, neutral: float) -> bool:
        """Whether an input is other than the value by which it does nothing."""
        found = self.constant(name)
        return found is None or any(abs(one - neutral) > 1e-6 for one in found)

    def lose(self, names: Iterable[tuple[str, float, str]]) -> None:
        """Say of each of these inputs, where it is not neutral, that the model has nothing for it."""
        for name, neutral, detail in names:
            if self.is_used(name, neutral):
                self.note(name, detail)

    def put(self, parameter: str, name: str, tree: Tree, default: float | None = None) -> None:
        """Set a parameter to a tree, whose place is that of the input `name`; not where that is its default."""
        place = self.place(name)
        try:
            if parameter in COLORS:
                value = self.values.color(tree, place, BRIGHTEST if parameter.startswith("emission") else 1.0)
            else:
                value = self.values.number(tree, place, *RANGES.get(parameter, (0.0, 1.0)))
        except Unsupported as problem:
            self.graphs.notes.add(place, f"{problem}; the parameter is left out")
            return
        if default is None or isinstance(value, dict | list) or abs(value - default) > 1e-6:
            self.material[parameter] = value

    def abbe(self, number: float) -> None:
        """Take an Abbe number; 0 is none."""
        if number > 0:
            self.material["abbe"] = min(number, LARGEST)

    def normal(self, parameter: str, name: str, tree: Tree | None = None) -> None:
        found = tree or self.graphs.normal(self.node, name)
        if found is None or found.value is not None:
            return  # the surface's own, or one direction for all of it, which has no meaning
        try:
            map = self.values.normal(found, self.place(name))
        except Unsupported as problem:
            self.graphs.notes.add(self.place(name), f"{problem}; the normal map is left out")
            return
        if map is not None:
            self.material[parameter] = map

    def tangent(self, parameter: str, name: str, degrees: float = 0.0) -> None:
        """Set a tangent to that of an input, turned counter-clockwise; not where it is the surface's own."""
        tree = self.tree(name)
        try:
            found = in_frame(tree) if tree.operation != "tangent" else np.array((1.0, 0.0, 0.0), np.float32)
        except Unsupported:
            found = None
        x, y = (0.0, 0.0) if found is None else (float(found[0]), float(found[1]))
        length = math.hypot(x, y)
        if not 1e-6 < length < 1e9:
            self.note(name, TANGENT)
            x, y, length = 1.0, 0.0, 1.0
        c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
        turned = [round(one / length, 6) + 0.0 for one in (c * x - s * y, s * x + c * y)]
        if turned != [1.0, 0.0]:
            self.material[parameter] = [*turned, 0.0]

    def height(self, tree: Tree, place: str) -> None:
        """Set the heights above the surface; only displaced shapes show them where a normal map shows the same."""
        try:
            found = self.values.height(tree, place)
        except Unsupported as problem:
            self.graphs.notes.add(place, f"{problem}; the heights are left out")
            return
        if found is not None:
            self.material["height"] = found | ({"shading": False} if self._bends() else {})

    def _bends(self) -> bool:
        return "normal_map" in self.material or "geometry_normal" in self.material

    def is_black(self, tree: Tree) -> bool:
        try:
            found = fixed(tree)
        except Unsupported:
            return False
        return found is not None and bool(np.abs(found).max() < 1e-9)
