"""Elements of the library's document -> trees. Nodes that the library, or the file itself, implements by other nodes
are taken apart, so that what is left are operations that have no such implementation."""

from __future__ import annotations

import math
from collections.abc import Callable, Container
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from service.formats.errors import ParseError
from service.formats.read.materialx.evaluation import fixed, scaled
from service.formats.read.materialx.images import Images
from service.formats.read.scenes.warnings import Warnings
from service.formats.surface.trees import Tree, Unsupported, applied, constant, times, walk

MOST_TREES = 20_000
MOST_DEPTH = 150  # of nodes within nodes
LARGEST = 1e9
SIZES = {
    "float": 1, "integer": 1, "boolean": 1, "color3": 3, "color4": 4, "vector2": 2, "vector3": 3, "vector4": 4,
    "matrix33": 9, "matrix44": 16,
}  # fmt: skip
COLOURS = ("color3", "color4")
WHOLE = {"true": 1.0, "false": 0.0}
TEXTS = ("string", "filename")
TARGET = "genglsl"  # whose primitive operations `operations` has
# Spaces by the names that programs write, and the one that the library has a transform for.
SPACES = {
    "": "lin_rec709", "linear": "lin_rec709", "lin_srgb": "lin_rec709", "scene_linear": "lin_rec709",
    "raw": "lin_rec709", "none": "lin_rec709", "data": "lin_rec709", "utility - raw": "lin_rec709",
    "lin_rec709_scene": "lin_rec709", "linear rec.709 (srgb)": "lin_rec709", "utility - linear - srgb": "lin_rec709",
    "srgb": "srgb_texture", "srgb_tx": "srgb_texture", "srgb - texture": "srgb_texture",
    "utility - srgb - texture": "srgb_texture", "srgb_rec709_scene": "srgb_texture", "lin_ap1": "acescg",
    "lin_ap1_scene": "acescg", "aces - acescg": "acescg", "g22_rec709_scene": "g22_rec709",
    "g18_rec709_scene": "g18_rec709", "g22_ap1_scene": "g22_ap1", "lin_p3d65": "lin_displayp3",
    "lin_p3d65_scene": "lin_displayp3", "srgb_p3d65_scene": "srgb_displayp3", "lin_adobergb_scene": "lin_adobergb",
    "g22_adobergb_scene": "adobergb",
}  # fmt: skip
METRES = {
    "nanometer": 1e-9, "micron": 1e-6, "millimeter": 1e-3, "centimeter": 1e-2, "inch": 0.0254, "foot": 0.3048,
    "yard": 0.9144, "meter": 1.0, "kilometer": 1e3, "mile": 1609.344,
}  # fmt: skip
DEGREES = {"degree": 1.0, "radian": 180 / math.pi}


@dataclass
class Scope:
    """The inputs of a graph that implements a node, as that node has them."""

    inputs: dict[str, Tree]
    texts: dict[str, tuple[str, str]]  # strings and file names, with their colour space


@dataclass
class Graphs:
    """The trees of one document. `file` is its path in the upload."""

    document: Any
    file: str
    images: Images
    notes: Warnings
    place: Callable[[str], str]
    _trees: dict[tuple[str, int, str], Tree] = field(default_factory=dict)
    _scopes: list[Scope] = field(default_factory=list)  # kept, so that their identities stay theirs
    _open: set[tuple[str, int, str]] = field(default_factory=set)
    _depth: int = 0
    _count: int = 0

    def input(self, node: Any, name: str) -> Tree:
        """The tree of a node's input, or of its default. A part that has no meaning here is `unsupported`."""
        return self._input(node, definition_of(node), name, None)

    def normal(self, node: Any, name: str) -> Tree | None:
        """Likewise of an input for a normal; None where that is the surface's own."""
        found = self.input(node, name)
        return None if found.operation in ("normal", "tangent") else found

    def check_inputs(self, node: Any, definition: Any, known: Container[str] = ()) -> None:
        """Warn of inputs that neither the definition of a node has nor `known`."""
        for given in node.getInputs():
            if given.getName() not in known and definition.getActiveInput(given.getName()) is None:
                place = self.place(given.getNamePath())
                self.notes.add(place, f"<{node.getCategory()[:40]}> has no such input; it is left out")

    def is_given(self, node: Any, name: str) -> bool:
        return node.getInput(name) is not None

    def text(self, node: Any, name: str) -> str:
        return self._text(node, definition_of(node), name, None)[0]

    def _input(self, owner: Any, definition: Any, name: str, scope: Scope | None) -> Tree:
        given = owner.getInput(name)
        default = definition.getActiveInput(name) if definition is not None else None
        try:
            if given is not None:
                found = self._connected(given, owner, scope)
                if found is not None:
                    return found
                if given.getValueString():
                    return self._constant(given)
        except Unsupported as problem:
            return _unsupported(f"{problem}", SIZES.get(given.getType(), 1))
        if default is not None and default.hasAttribute("defaultgeomprop"):
            return self._geometry(default)
        source = default if default is not None else given
        if source is not None and source.getValueString():
            return self._constant(source)
        size = SIZES.get(source.getType() if source is not None else "float", 1)
        return Tree("constant", size, value=np.zeros(size, np.float32))

    def _connected(self, given: Any, owner: Any, scope: Scope | None) -> Tree | None:
        """The tree that an input is connected to; None where it has a value of its own."""
        parent = owner.getParent()
        interface = given.getInterfaceName()
        if interface:
            if scope is not None and interface in scope.inputs:
                return scope.inputs[interface]
            declared = parent.getInput(interface) if parent.getCategory() == "nodegraph" else None
            return self._input(parent, None, interface, scope) if declared is not None else None
        graph, node, output = given.getNodeGraphString(), given.getNodeName(), given.getOutputString()
        if graph:
            outer = parent.getParent() if parent.getCategory() == "nodegraph" else parent
            found = parent.getChild(graph) or outer.getChild(graph) or self.document.getNodeGraph(graph)
            if found is None:
                raise Unsupported(f"the graph {graph[:60]!r} is not in the document")
            return self.output(found, output, None)
        if node:
            found = parent.getChild(node)
            if found is None or found.getCategory() in ("input", "output"):
                raise Unsupported(f"the node {node[:60]!r} is not in the document")
            if found.getCategory() == "nodegraph":
                return self.output(found, output, scope)
            return self._node(found, output, scope)
        if output:
            return self.output(parent, output, scope)
        return None

    def output(self, graph: Any, name: str, scope: Scope | None = None) -> Tree:
        """The tree of an output of a graph, or of its first. Raises Unsupported."""
        outputs = graph.getOutputs()
        found = graph.getOutput(name) if name else (outputs[0] if outputs else None)
        if found is None:
            raise Unsupported(f"the graph {graph.getName()[:60]!r} has no output {name[:60]!r}")
        tree = self._connected(found, found, scope)
        if tree is not None:
            return tree
        if found.getValueString():
            return self._constant(found)
        raise Unsupported(f"the output {found.getName()[:60]!r} is connected to nothing")

    def _node(self, node: Any, output: str, scope: Scope | None) -> Tree:
        key = node.getNamePath(), id(scope), output
        if key in self._trees:
            return self._trees[key]
        if key in self._open:
            raise Unsupported(f"the node {node.getName()[:60]!r} is connected to itself")
        self._count += 1
        if self._count > MOST_TREES:
            raise ParseError(f"its graphs have more than {MOST_TREES} nodes", self.place(node.getNamePath()))
        if self._depth >= MOST_DEPTH:
            raise Unsupported(f"more than {MOST_DEPTH} nodes lie within each other")
        self._open.add(key)
        self._depth += 1
        try:
            self._trees[key] = self._made(node, output, scope)
        finally:
            self._depth -= 1
            self._open.discard(key)
        return self._trees[key]

    def _made(self, node: Any, output: str, scope: Scope | None) -> Tree:
        definition, kind = definition_of(node, TARGET), node.getCategory()
        if definition is None:
            raise Unsupported(f"the node <{kind[:40]}> is not one of the standard library")
        self.check_inputs(node, definition)
        if kind == "triplanarprojection":
            return self._projected(node, definition, scope)
        implementation = definition.getImplementation(TARGET)
        if implementation is not None and implementation.getCategory() == "nodegraph":
            return self._taken_apart(node, definition, implementation, output, scope)
        outputs = definition.getActiveOutputs()
        type = outputs[0].getType() if outputs else node.getType()
        size = SIZES.get(type)
        if size is None:
            raise Unsupported(f"a <{kind[:40]}> of type {type[:40]} is not supported")
        if kind == "image":
            return self._image(node, definition, type, scope)
        if kind == "texcoord":
            return self._texcoord(node, definition, size, scope)
        if kind == "constant":
            return self._input(node, definition, "value", scope)
        if kind in ("time", "frame"):
            self.notes.add(self.place(node.getNamePath()), "nothing moves here: the time is 0")
            return Tree("constant", 1, value=np.zeros(1, np.float32))
        if kind.startswith("geompropvalue"):
            self.notes.add(self.place(node.getNamePath()), "meshes have no such values here: its default is used")
            return self._input(node, definition, "default", scope)
        names = [one.getName() for one in definition.getActiveInputs() if one.getType() not in TEXTS]
        return Tree(kind, size, {name: self._input(node, definition, name, scope) for name in names})

    def _taken_apart(self, node: Any, definition: Any, graph: Any, output: str, scope: Scope | None) -> Tree:
        inner = Scope({}, {})
        self._scopes.append(inner)
        for one in definition.getActiveInputs():
            name = one.getName()
            if one.getType() in TEXTS:
                inner.texts[name] = self._text(node, definition, name, scope)
            else:
                inner.inputs[name] = self._input(node, definition, name, scope)
        names = [one.getName() for one in graph.getOutputs()]
        return self.output(graph, output if output in names else "", inner)

    def _projected(self, node: Any, definition: Any, scope: Scope | None) -> Tree:
        """A projection along the axes, as an image by box."""
        place, files = (
            self.place(node.getNamePath()),
            [self._text(node, definition, f"file{k}", scope) for k in "xyz"],
        )
        named = [k for k, (name, _) in zip("xyz", files, strict=True) if name]
        side = named[0] if named else "x"
        if len({name for name, _ in files}) > 1:
            self.notes.add(place, f"an image for each axis is not supported; file{side} is used on all sides")
        self.notes.add(place, "a projection along the axes is not blended where they meet; its image is seen from "
                              "outside, +Y up, and nowhere mirrored")  # fmt: skip
        scale = scaled(self._input(node, definition, "position", scope))
        if scale is None:
            self.notes.add(
                f"{place}/position", "positions other than a number times the shape's own are not supported"
            )
        type = definition.getActiveOutputs()[0].getType()
        by_box = Tree("texcoord", 2) if scale in (None, 1) else times(Tree("texcoord", 2), constant(scale or 1.0))
        found = self._image(node, definition, type, scope, (f"file{side}", by_box))
        # A colour of a space of its own is several operations on the image.
        for one in walk(found):
            if one.operation == "image" and one.inputs["texcoord"] is by_box:
                one.texts["mapping"] = "box"
        return found

    def _image(
        self, node: Any, definition: Any, type: str, scope: Scope | None, by: tuple[str, Tree] | None = None
    ) -> Tree:
        """The tree of an image node, or of a projection `by` one of its files and with these coordinates."""
        size, place = SIZES[type], self.place(node.getNamePath())
        name, space = self._text(node, definition, "file" if by is None else by[0], scope)
        try:
            found = self.images.located(name, self.file)
        except Unsupported as problem:
            self.notes.add(place, f"{problem}; the node's default is used")
            return self._input(node, definition, "default", scope)
        if found.remark:
            self.notes.add(place, f"the image {found.remark}")
        texts = {"file": found.path, "space": "linear", "place": place}
        for text, attribute in (("wrap_u", "uaddressmode"), ("wrap_v", "vaddressmode"), ("filter", "filtertype")):
            texts[text] = self._text(node, definition, attribute, scope)[0]
        if texts["filter"] == "closest":
            self.notes.add(place, "nearest-neighbour filtering is not supported; bilinear filtering is used instead")
        if "constant" in (texts["wrap_u"], texts["wrap_v"]):
            self.notes.add(place, "a constant colour beyond the image is not supported; its edge goes on instead")
        texts["layer"] = self._layer(
            node, definition, "layer" if by is None else f"layer{by[0][-1]}", found.path, scope
        )
        if self._text(node, definition, "framerange", scope)[0]:
            self.notes.add(f"{place}/framerange", "is not supported and is ignored")
        at = self._input(node, definition, "texcoord", scope) if by is None else by[1]
        image = Tree("image", size, {"texcoord": at}, texts=texts)
        if type not in COLOURS:
            return image
        if self._space(space, place) == "srgb_texture":
            texts["space"] = "srgb"
            return image
        return self._transformed(image, space, type, place)

    def _layer(self, node: Any, definition: Any, name: str, path: str, scope: Scope | None) -> str:
        """The layer of an EXR that an input names; "" for the one that is shown without a name."""
        layer = self._text(node, definition, name, scope)[0]
        if not layer:
            return ""
        try:
            self.images.check_layer(path, layer)
        except Unsupported as problem:
            detail = f"{problem}; the image is shown as without this input"
            self.notes.add(f"{self.place(node.getNamePath())}/{name}", detail)
            return ""
        return layer

    def _texcoord(self, node: Any, definition: Any, size: int, scope: Scope | None) -> Tree:
        index = fixed(self._input(node, definition, "index", scope))
        self._note_set(0 if index is None else int(index[0]), node)
        return Tree("texcoord", size)

    def _geometry(self, source: Any) -> Tree:
        """A default that the surface itself gives: coordinates, its position, its normal."""
        name, size = source.getAttribute("defaultgeomprop"), SIZES.get(source.getType(), 3)
        if name.startswith("UV"):
            return Tree("texcoord", size)
        kinds = {"P": "position", "N": "normal", "T": "tangent", "B": "bitangent", "I": "viewdirection"}
        return Tree(kinds.get(name[:1], "unsupported"), size, texts={"why": f"{name} is not supported"})

    def _note_set(self, index: int, node: Any) -> None:
        if index:
            place = self.place(node.getNamePath())
            self.notes.add(place, "a second set of coordinates is not supported here; the first is used")

    def _text(self, owner: Any, definition: Any, name: str, scope: Scope | None) -> tuple[str, str]:
        """A string or a file's name, and its colour space."""
        given = owner.getInput(name)
        for _ in range(MOST_DEPTH):
            if given is None:
                break
            interface, parent = given.getInterfaceName(), owner.getParent()
            if not interface:
                return given.getResolvedValueString() or "", given.getActiveColorSpace()
            if scope is not None and interface in scope.texts:
                return scope.texts[interface]
            owner, given = parent, parent.getInput(interface) if parent.getCategory() == "nodegraph" else None
        default = definition.getActiveInput(name) if definition is not None else None
        return (default.getValueString() if default is not None else ""), ""

    def _constant(self, source: Any) -> Tree:
        type, text = source.getType(), source.getValueString()
        size = SIZES.get(type)
        place = self.place(source.getNamePath())
        if size is None:
            raise Unsupported(f"a value of type {type[:40]} is not supported")
        try:
            words = text.replace(",", " ").split()  # commas, blanks or both stand between them, as in the library
            found = [WHOLE[one] if one in WHOLE else float(one) for one in words]
        except ValueError:
            raise ParseError(f"must be {size} number{'s' * (size > 1)}, not {text[:60]!r}", place) from None
        if len(found) != size or not all(abs(one) <= LARGEST for one in found):
            raise ParseError(f"must be {size} number{'s' * (size > 1)} within 1e9, not {text[:60]!r}", place)
        unit = source.getAttribute("unit")
        scale = METRES.get(unit, DEGREES.get(unit, 1.0))
        tree = Tree("constant", size, value=np.array(found, np.float32) * np.float32(scale))
        return self._transformed(tree, source.getActiveColorSpace(), type, place) if type in COLOURS else tree

    def _space(self, name: str, place: str) -> str:
        space = SPACES.get(name.strip().lower(), name)
        if space not in ("lin_rec709", "srgb_texture") and self._transform(space, "color3") is None:
            self.notes.add(place, f"the colour space {name[:60]!r} is not known; linear Rec.709 is used instead")
            return "lin_rec709"
        return space

    def _transform(self, space: str, type: str) -> Any:
        return self.document.getNodeDef(f"ND_{space}_to_lin_rec709_{type}")

    def _transformed(self, tree: Tree, space: str, type: str, place: str) -> Tree:
        """A colour of a space, in linear Rec.709: by the library's own transform."""
        space = self._space(space, place)
        if space == "lin_rec709":
            return tree
        definition = self._transform(space, type)
        graph = definition.getImplementation(TARGET)
        inner = Scope({"in": tree}, {})
        self._scopes.append(inner)
        found = self.output(graph, "", inner)
        value = fixed(found)
        return found if value is None else Tree("constant", found.size, value=value)


def definition_of(node: Any, target: str = "") -> Any:
    """The definition of a node; where its inputs fit none, as those of another version, that of its name and type.
    None for one of another name."""
    return node.getNodeDef(target) or node.getNodeDef(target, True)


def _unsupported(why: str, size: int) -> Tree:
    return applied("unsupported", size) if not why else Tree("unsupported", size, texts={"why": why})
