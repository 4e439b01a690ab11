"""A MaterialX document as a layer of USD, which other layers refer to as to any.

Prims are where USD's own plugin puts them [OpenUSD, pxr/usd/usdMtlx]: a material is `/MaterialX/Materials/NAME`, and
the nodes and graphs that it reads are prims in it, so that a reference to it brings all of them.
"""

from __future__ import annotations

import re
from typing import Any

from pxr import Gf, Sdf, Tf, Usd, UsdShade

from service.formats.errors import ParseError
from service.formats.read.scenes.warnings import Warnings

ROOT = Sdf.Path("/MaterialX")
MATERIALS = ROOT.AppendChild("Materials")
MOST_PRIMS = 10_000  # of all materials, each of which has its own: they take some seconds
# Types of MaterialX in USD, and the numbers of each; others, such as surfaceshader, are only connected.
VALUES = Sdf.ValueTypeNames
TYPES = {
    "float": (VALUES.Float, 1), "integer": (VALUES.Int, 1), "boolean": (VALUES.Bool, 1), "string": (VALUES.String, 0),
    "filename": (VALUES.Asset, 0), "color3": (VALUES.Color3f, 3), "color4": (VALUES.Color4f, 4),
    "vector2": (VALUES.Float2, 2), "vector3": (VALUES.Float3, 3), "vector4": (VALUES.Float4, 4),
}  # fmt: skip
VECTORS = {2: Gf.Vec2f, 3: Gf.Vec3f, 4: Gf.Vec4f}
BETWEEN = re.compile(r"[,\s]+")
OUTPUTS = {"surfaceshader": "surface", "displacementshader": "displacement", "volumeshader": "volume"}


def layer_of(document: Any, name: str, notes: Warnings) -> Sdf.Layer:
    """The layer of a document of the MaterialX library's; `name` is its file's, in warnings. Raises ParseError."""
    return _Writer(name, notes).written(document)


class _Writer:
    def __init__(self, name: str, notes: Warnings) -> None:
        self.name, self.notes = name, notes
        self.layer = Sdf.Layer.CreateAnonymous(".usda")
        self.stage = Usd.Stage.Open(self.layer)
        self.left: list[tuple[Sdf.Path, Any]] = []  # nodes and graphs that a prim was made for, and nothing else yet
        self.made: set[Sdf.Path] = set()

    def written(self, document: Any) -> Sdf.Layer:
        self.stage.SetDefaultPrim(self.stage.DefinePrim(ROOT))
        self.stage.DefinePrim(MATERIALS)
        for node in document.getMaterialNodes():
            material = UsdShade.Material.Define(self.stage, MATERIALS.AppendChild(_name(node)))
            for given in node.getInputs():
                if (output := OUTPUTS.get(given.getType())) is not None:
                    made = material.CreateOutput(f"mtlx:{output}", VALUES.Token)
                    self._connect(made, given, material.GetPath())
            while self.left:
                self._fill(*self.left.pop())
                if len(self.made) > MOST_PRIMS:
                    raise ParseError(f"its materials read more than the {MOST_PRIMS} nodes allowed")
        return self.layer

    def _fill(self, path: Sdf.Path, element: Any) -> None:
        """The inputs of a node, or those of a graph and its outputs."""
        is_graph = element.getCategory() == "nodegraph"
        prim = (UsdShade.NodeGraph if is_graph else UsdShade.Shader).Get(self.stage, path)
        for given in element.getInputs():
            type, _ = TYPES.get(given.getType(), (VALUES.Token, 0))
            made = prim.CreateInput(given.getName(), type)
            if not self._connect(made, given, path.GetParentPath()):
                self._set(made, given)
        if is_graph:
            for given in element.getOutputs():
                type, _ = TYPES.get(given.getType(), (VALUES.Token, 0))
                self._connect(prim.CreateOutput(given.getName(), type), given, path)

    def _connect(self, made: Any, given: Any, scope: Sdf.Path) -> bool:
        """Connect an input or an output with what the document's one reads; False where that is a value. `scope` is
        the prim that the nodes stand in."""
        if given.getInterfaceName():
            graph = UsdShade.NodeGraph.Get(self.stage, scope)
            source = graph.CreateInput(given.getInterfaceName(), made.GetTypeName()) if graph else None
            return source is not None and bool(made.ConnectToSource(source))
        is_output = given.getCategory() == "output"
        above = given.getParent() if is_output else given.getParent().getParent()  # a graph or the document
        element = None
        if given.getNodeGraphString():
            element = above.getDocument().getNodeGraph(given.getNodeGraphString())
        elif given.getNodeName():
            element = above.getNode(given.getNodeName())
        elif not is_output and (output := above.getOutput(given.getOutputString())) is not None:
            return self._connect(made, output, scope)
        if element is None:
            return False
        output = given.getOutputString()
        if not output and element.getCategory() == "nodegraph":
            output = next((each.getName() for each in element.getOutputs()), "")
        source = self._prim(scope.AppendChild(_name(element)), element).CreateOutput(
            output or "out", made.GetTypeName()
        )
        return bool(made.ConnectToSource(source))

    def _prim(self, path: Sdf.Path, element: Any) -> UsdShade.Shader | UsdShade.NodeGraph:
        """The prim of a node or graph, which is filled later."""
        kind = UsdShade.NodeGraph if element.getCategory() == "nodegraph" else UsdShade.Shader
        if path in self.made:
            return kind.Get(self.stage, path)
        self.made.add(path)
        self.left.append((path, element))
        prim = kind.Define(self.stage, path)
        if kind is UsdShade.Shader:
            known = element.getNodeDef("", True)  # also where its inputs are not all of this version
            prim.CreateIdAttr(element.getCategory() if known is None else known.getName())
        return prim

    def _set(self, made: UsdShade.Input, given: Any) -> None:
        type, count = TYPES.get(given.getType(), (VALUES.Token, 0))
        text = given.getResolvedValueString().strip()
        if not text:
            return
        try:
            made.Set(_value(given.getType(), count, text))
        except ValueError:
            detail = f"{given.getNamePath()} is no {given.getType()}, {text[:60]!r}; its default is used instead"
            self.notes.add(self.name, detail)
            return
        space = given.getActiveColorSpace()
        if space and (type in (VALUES.Color3f, VALUES.Color4f, VALUES.Asset)):
            made.GetAttr().SetColorSpace(space)


def _value(type: str, count: int, text: str) -> Any:
    """Raises ValueError."""
    if not count:
        return Sdf.AssetPath(text) if type == "filename" else text
    if type == "boolean":
        return {"true": True, "1": True, "false": False, "0": False}[text.lower()]
    numbers = [float(word) for word in BETWEEN.split(text.strip(", \t\r\n"))]
    if len(numbers) != count:
        raise ValueError
    if count == 1:
        return int(numbers[0]) if type == "integer" else numbers[0]
    return VECTORS[count](*numbers)


def _name(element: Any) -> str:
    return str(Tf.MakeValidIdentifier(element.getName()))
