"""A `.mtlx` file, or a zip that has one with its images, as a document with materials and textures."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

from service.formats.errors import ParseError
from service.formats.read.materialx.document import check_library, is_standard, named, read_document
from service.formats.read.materialx.graph import Graphs, definition_of
from service.formats.read.materialx.images import Images
from service.formats.read.materialx.surface import Surface
from service.formats.read.materialx.values import Values
from service.formats.read.references import Finder
from service.formats.read.scenes.names import unique
from service.formats.read.scenes.part_files import PartFiles
from service.formats.read.scenes.warnings import Warnings
from service.formats.surface import MODELS
from service.formats.surface.trees import Unsupported, times
from service.formats.types import AssetLimits, SceneFile

ALONE = "material.mtlx"  # the name of a file that came without a zip
MOST_FILES, MOST_MATERIALS = 100, 1_000
# What a document needs beside materials; nobody sees it.
CAMERA = {"position": [0, 0, 4], "target": [0, 0, 0]}


def read_materialx(
    sources: Iterable[str], finder: Finder, read: Callable[[str], bytes], limits: AssetLimits
) -> SceneFile:
    """The materials of these `.mtlx` files, each a `principled` or an `openpbr`. `finder` knows the images beside
    them. Raises ParseError."""
    check_library()
    sources = sorted(sources)
    if len(sources) > MOST_FILES:
        raise ParseError(f"it has {len(sources)} MaterialX files; {MOST_FILES} are allowed")
    reading = _Reading(finder, read, limits, several=len(sources) > 1)
    for source in reading.roots(sources):
        if source not in reading.parts:  # of files in a circle
            reading.file(source)
    if not reading.materials:
        raise reading.nothing_left()
    document = {
        "version": 1, "camera": CAMERA, "materials": reading.materials, "textures": reading.textures, "shapes": [],
    }  # fmt: skip
    return SceneFile(document, reading.files.parts, reading.notes.document(), 0, False)


@dataclass
class _Reading:
    finder: Finder
    read: Callable[[str], bytes]
    limits: AssetLimits
    several: bool  # files, so that places must name theirs
    notes: Warnings = field(default_factory=Warnings)
    files: PartFiles = field(default_factory=PartFiles)
    materials: dict[str, dict[str, Any]] = field(default_factory=dict)
    parts: set[str] = field(default_factory=set)  # files that those read include
    values: Values = field(init=False)

    def __post_init__(self) -> None:
        self.values = Values(Images(self.finder, self.read, self.limits), self.files, self.notes)

    @property
    def textures(self) -> dict[str, dict[str, Any]]:
        """Those that a material shows: a parameter that was left out may have made others."""
        shown = {
            value["texture"] for one in self.materials.values() for value in one.values() if isinstance(value, dict)
        }
        return {name: found for name, found in self.values.documents.items() if name in shown}

    def roots(self, sources: list[str]) -> list[str]:
        """Those of the files that no other one includes; all where that leaves none."""
        parts = {
            found.path
            for source in sources
            for name in named(self.read(source)).included
            if (found := self.finder.find(source, name)) is not None and found.path != source
        }
        return [source for source in sources if source not in parts] or sources

    def _included(self, source: str, name: str) -> str | None:
        """The path of the file that the one at `source` includes; None, with a warning, where it is not there."""
        place = self.finder.located(source, name, place=source, notes=self.notes)
        if place is None and not is_standard(name):
            self.notes.add(source, f"it includes {name[:100]!r}, which is not in the upload; it is read without that")
        self.parts |= {place} if place is not None else set()
        return place

    def file(self, source: str) -> None:
        document = read_document(source, self.read, self._included)
        prefix = f"{source}/" if self.several else ""
        graphs = Graphs(document, source, self.values.images, self.notes, lambda path: prefix + path)
        materials = document.getMaterialNodes()
        found = [(one, self._shader(one, graphs)) for one in materials]
        if not materials:
            shaders = [one for one in document.getNodes() if one.getType() == "surfaceshader"]
            found = [(one, one) for one in shaders]
        for material, shader in found:
            if shader is not None:
                self._add(material, shader, graphs)

    def _shader(self, material: Any, graphs: Graphs) -> Any:
        """The shader node of a material; None, with a warning, where it has none that is known."""
        given = material.getInput("surfaceshader")
        shader = given.getConnectedNode() if given is not None else None
        if shader is None:
            self.notes.add(graphs.place(material.getNamePath()), "the material has no surface shader; it is left out")
        if material.getInput("backsurfaceshader") is not None:
            place = graphs.place(f"{material.getNamePath()}/backsurfaceshader")
            self.notes.add(place, "a shader of the back is not supported and is left out")
        return shader

    def _displace(self, material: Any, surface: Surface, graphs: Graphs) -> None:
        given = material.getInput("displacementshader")
        shader = given.getConnectedNode() if given is not None else None
        if shader is None:
            return
        place = graphs.place(f"{shader.getNamePath()}/displacement")
        moved = shader.getInput("displacement")
        if shader.getCategory() != "displacement" or moved is None or moved.getType() != "float":
            self.notes.add(place, "displacement other than along the normal is not supported and is left out")
            return
        surface.raise_by(times(graphs.input(shader, "displacement"), graphs.input(shader, "scale")), place)

    def _add(self, material: Any, shader: Any, graphs: Graphs) -> None:
        model, place = MODELS.get(shader.getCategory()), graphs.place(shader.getNamePath())
        definition = definition_of(shader)
        if model is None or definition is None:
            known = ", ".join(MODELS)
            self.notes.add(place, f"<{shader.getCategory()[:40]}> is not supported, only {known}; it is left out")
            return
        if len(self.materials) >= MOST_MATERIALS:
            raise ParseError(f"it has more than {MOST_MATERIALS} materials", place)
        graphs.check_inputs(shader, definition, model.defaults)
        surface = Surface(shader, graphs, self.values)
        try:
            model.read(surface)
        except Unsupported as problem:
            raise ParseError(str(problem), place) from None
        self._displace(material, surface, graphs)
        self.materials[unique(material.getName() or "material", self.materials)] = surface.material

    def nothing_left(self) -> ParseError:
        reasons = self.notes.document()
        if not reasons:
            return ParseError("it has no material and no surface shader")
        return ParseError(f"it has no material that can be used: {reasons[0]['detail']}", reasons[0]["pointer"])
