"""glTF's materials as `principled` or `openpbr`, or as bare emission where they are unlit."""

from __future__ import annotations

from typing import Any

from service.formats.errors import ParseError
from service.formats.read.gltf.document import REFUSALS, GltfDocument
from service.formats.read.gltf.json_view import JsonView, LenientView
from service.formats.read.gltf.material_inputs import MaterialInputs
from service.formats.read.gltf.material_reader import MaterialReader
from service.formats.read.gltf.specular_glossiness import converted
from service.formats.read.gltf.textures import Charts, Textures
from service.formats.read.scenes.names import unique
from service.formats.read.scenes.warnings import Warnings
from service.formats.surface import gltf
from service.formats.surface.gltf_members import GLOSSY
from service.formats.types import BRIGHTEST

OTHER_HUES = (
    "the film's colours are those of its exact interfaces; programs that use Khronos' approximation show other hues, "
    "most of all on metals"
)
GREY = "a grey material is shown in its place"
PLAIN = {"type": "diffuse", "albedo": 0.8}


class Materials:
    """The materials that meshes use; `documents` are the finished ones by name."""

    def __init__(self, file: GltfDocument, textures: Textures, notes: Warnings) -> None:
        self.file, self.textures, self.notes = file, textures, notes
        self.documents: dict[str, dict[str, Any]] = {}
        self._names: dict[tuple[Any, ...], str] = {}
        self._called: dict[str, list[str]] = {}  # names of documents by the file's name for them

    def name(self, primitive: JsonView, charts: Charts) -> tuple[str, JsonView]:
        """The document's name for a primitive's material, and the material."""
        place = self.place(primitive)
        attributes = primitive.need("attributes")
        directed = charts[0] or ("TANGENT" in attributes and "NORMAL" in attributes)
        read = MaterialReader(place, self.textures, charts, directed, self.notes)
        key = place.pointer, charts, directed
        if key not in self._names:
            try:
                document = self._document(read)
            except REFUSALS:
                raise
            except ParseError as error:
                self.notes.add(error.pointer, f"{error.detail}; {GREY}")
                document = dict(PLAIN)
            called = place.text("name") or place.pointer[1:].replace("/", " ") or "default"
            same = self._called.setdefault(called, [])  # a file has one material twice where its sides differ
            found = next((name for name in same if self.documents[name] == document), None)
            if found is None:
                found = unique(called, self.documents)
                self.documents[found] = document
                same.append(found)
            self._names[key] = found
        return self._names[key], place

    def place(self, primitive: JsonView) -> JsonView:
        """The material of a primitive; where it names none, or one that does not exist, one that is all defaults."""
        if "material" in primitive:
            try:
                found = self.file.follow(primitive, "material", "materials")
                return LenientView(found.value, found.pointer, self.notes)
            except ParseError as error:
                self.notes.add(error.pointer, f"{error.detail}; {GREY}")
        return JsonView({}, "")

    def _document(self, read: MaterialReader) -> dict[str, Any]:
        glossy = read.owner(GLOSSY)
        if read.owner("unlit") is not None:
            inputs = MaterialInputs(read)
            _unlit(inputs)
            gltf.opacity(inputs)
        elif glossy is not None:
            inputs = MaterialInputs(read, GLOSSY, converted(read, glossy))
            gltf.common(inputs)
            gltf.opacity(inputs)
        else:
            inputs = MaterialInputs(read)
            gltf.gltf_pbr(inputs)
            self._tell(read, inputs.material)
        shines = not inputs.material.keys().isdisjoint(("emission", "emission_luminance"))
        if shines and read.place.flag("doubleSided"):
            inputs.material["emission_sides"] = "both"
        return inputs.material

    def _tell(self, read: MaterialReader, material: dict[str, Any]) -> None:
        """Warn of what the inputs do not say."""
        film, volume = read.owner("iridescence"), read.owner("volume")
        if film is not None and not material.keys().isdisjoint(("film_thickness", "thin_film_weight")):
            self.notes.add(film.pointer, OTHER_HUES)
        is_glass = not material.keys().isdisjoint(("transmission", "transmission_weight"))
        is_body = is_glass and material.keys().isdisjoint(("thin_walled", "geometry_thin_walled"))
        if volume is not None and "thicknessTexture" in volume and is_body:
            detail = "the thickness texture is not used; rays go through the geometry itself"
            self.notes.add(volume.at("thicknessTexture"), detail)


def _unlit(inputs: MaterialInputs) -> None:
    """An unlit material: its colour is radiance, and it reflects nothing."""
    color = inputs.value(inputs.tree("base_color"), "base_color", 0.0, BRIGHTEST, is_color=True)
    inputs.material = {"type": "diffuse", "albedo": 0.0, "emission": color}
