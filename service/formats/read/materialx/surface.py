"""One surface shader of a file, as the models read it: its inputs as trees of the file's graphs."""

from __future__ import annotations

from typing import Any

import numpy as np

from service.formats.read.materialx.evaluation import Places, fixed, images_in, in_frame
from service.formats.read.materialx.graph import Graphs
from service.formats.read.materialx.values import Values
from service.formats.surface.inputs import Inputs
from service.formats.surface.trees import Tree, Unsupported, added, applied, constant, times
from service.formats.types import Floats

SIGNED_NORMAL = "UsdPreviewSurface"  # the node whose normals are vectors already


class Surface(Inputs):
    """A shader node."""

    def __init__(self, node: Any, graphs: Graphs, values: Values) -> None:
        super().__init__()
        self.node, self.graphs, self.values = node, graphs, values

    def tree(self, name: str) -> Tree:
        return self.graphs.input(self.node, name)

    def is_given(self, name: str) -> bool:
        return self.graphs.is_given(self.node, name)

    def fixed(self, tree: Tree) -> Floats | None:
        return fixed(tree)

    def most(self, name: str) -> Any:
        tree = self.tree(name)
        white = {id(one): np.ones((1, 4), np.float32) for one in images_in(tree)}
        try:
            return Places(np.zeros((1, 2), np.float32), texels=white).value(tree)[0]
        except Unsupported:  # which is told where the input is set
            return np.ones(tree.size, np.float32)

    def value(self, tree: Tree, name: str, low: float, high: float, is_color: bool) -> Any:
        if is_color:
            return self.values.color(tree, self._place(name), high)
        return self.values.number(tree, self._place(name), low, high)

    def bump(self, name: str) -> dict[str, Any] | None:
        found = self.graphs.normal(self.node, name)
        if found is None or found.value is not None:
            return None  # the surface's own, or one direction for all of it, which has no meaning
        if self.node.getCategory() == SIGNED_NORMAL and found.operation != "normalmap":
            halved = added(times(found, 0.5), constant(0.5, 0.5, 0.5))
            found = applied("normalmap", 3, scale=constant(1.0), **{"in": halved})
        return self.values.normal(found, self._place(name))

    def direction(self, name: str) -> tuple[float, float] | None:
        tree = self.tree(name)
        if tree.operation == "tangent":
            return 1.0, 0.0
        try:
            found = in_frame(tree)
        except Unsupported:
            return None
        return None if found is None else (float(found[0]), float(found[1]))

    def height(self, name: str) -> None:
        self.raise_by(self.tree(name), self._place(name))

    def raise_by(self, tree: Tree, place: str) -> None:
        """Set the heights above the surface; only displaced shapes show them where a normal map shows the same."""
        try:
            found = self.values.height(tree, place)
        except Unsupported as problem:
            self.graphs.notes.add(place, f"{problem}; the heights are left out")
            return
        if found is not None:
            bends = "normal_map" in self.material or "geometry_normal" in self.material
            self.material["height"] = found | ({"shading": False} if bends else {})

    def warn(self, name: str, detail: str) -> None:
        self.graphs.notes.add(self._place(name), detail)

    def _place(self, name: str) -> str:
        return self.graphs.place(f"{self.node.getNamePath()}/{name}")
