"""glTF's materials as the contract's `principled`, or as bare emission where they are unlit."""

from __future__ import annotations

from typing import Any

from service.formats.read.gltf import material_extensions
from service.formats.read.gltf.document import GltfDocument
from service.formats.read.gltf.json_view import JsonView
from service.formats.read.gltf.material_reader import MaterialReader
from service.formats.read.gltf.specular_glossiness import converted
from service.formats.read.gltf.textures import Chart, Textures
from service.formats.read.scenes.names import unique
from service.formats.read.scenes.warnings import Warnings

WHITE = (1.0, 1.0, 1.0)


class Materials:
    """The materials that meshes use; `documents` are the finished ones by name."""

    def __init__(self, file: GltfDocument, textures: Textures, notes: Warnings) -> None:
        self.file, self.textures, self.notes = file, textures, notes
        self.documents: dict[str, dict[str, Any]] = {}
        self._names: dict[tuple[Any, ...], str] = {}
        self._called: dict[str, list[str]] = {}  # names of documents by the file's name for them

    def name(self, primitive: JsonView, charts: tuple[Chart | None, ...]) -> tuple[str, JsonView]:
        """The document's name for a primitive's material, and the material."""
        given = "material" in primitive
        place = self.file.follow(primitive, "material", "materials") if given else JsonView({}, "")  # all defaults
        attributes = primitive.need("attributes")
        directed = charts[0] is not None or ("TANGENT" in attributes and "NORMAL" in attributes)
        read = MaterialReader(place, self.textures, charts, directed, self.notes)
        key = place.pointer, self.textures.kinds(charts), directed
        if key not in self._names:
            document = self._document(read)
            called = place.text("name") or place.pointer[1:].replace("/", " ") or "default"
            same = self._called.setdefault(called, [])  # a file has one material twice where its sides differ
            found = next((name for name in same if self.documents[name] == document), None)
            if found is None:
                found = unique(called, self.documents)
                self.documents[found] = document
                same.append(found)
            self._names[key] = found
        return self._names[key], place

    def _document(self, read: MaterialReader) -> dict[str, Any]:
        place = read.place
        if "occlusionTexture" in place:
            self.notes.add(place.at("occlusionTexture"), "the occlusion texture is not used; occlusion is traced")
        glossy = place.extension("KHR_materials_pbrSpecularGlossiness")
        if place.extension("KHR_materials_unlit") is not None:
            document = self._unlit(read)
        elif glossy is not None:
            document = converted(read, glossy) | self._emission(read) | self._normal(read)
        else:
            document = self._rough(read)
        self._alpha(read, document, glossy)
        return document

    def _rough(self, read: MaterialReader) -> dict[str, Any]:
        place = read.place
        rough = place.object("pbrMetallicRoughness") or JsonView({}, place.at("pbrMetallicRoughness"))
        base = read.share(rough, "baseColorFactor", (1.0,) * 4)
        metallic, roughness = rough.number("metallicFactor", 1, 0, 1), rough.number("roughnessFactor", 1, 0, 1)
        document: dict[str, Any] = {
            "type": "principled",
            "base_color": read.color(rough, "baseColorTexture", base[:3]),
            "metallic": read.scalar(rough, "metallicRoughnessTexture", metallic, "b"),
            "roughness": read.scalar(rough, "metallicRoughnessTexture", roughness, "g"),
        }
        document |= self._emission(read) | self._normal(read)
        material_extensions.add(read, document)
        return document

    def _unlit(self, read: MaterialReader) -> dict[str, Any]:
        """An unlit material: its colour is radiance, and it reflects nothing."""
        rough = read.place.object("pbrMetallicRoughness") or JsonView({}, read.place.at("pbrMetallicRoughness"))
        base = rough.color("baseColorFactor", (1.0,) * 4)
        document = {"type": "diffuse", "albedo": 0.0, "emission": read.color(rough, "baseColorTexture", base[:3])}
        if read.place.flag("doubleSided"):
            document["emission_sides"] = "both"
        return document

    def _emission(self, read: MaterialReader) -> dict[str, Any]:
        place = read.place
        strength = place.extension("KHR_materials_emissive_strength")
        scale = strength.number("emissiveStrength", 1, 0) if strength else 1.0
        emission: tuple[float, ...] = tuple(place.radiance("emissiveFactor", (0.0, 0.0, 0.0), scale))
        if not max(emission):
            return {}
        sides = {"emission_sides": "both"} if place.flag("doubleSided") else {}
        return {"emission": read.color(place, "emissiveTexture", emission), **sides}

    def _normal(self, read: MaterialReader) -> dict[str, Any]:
        return material_extensions.normal_map(read, read.place, "normalTexture", "normal_map")

    def _alpha(self, read: MaterialReader, document: dict[str, Any], glossy: JsonView | None) -> None:
        place = read.place
        mode = place.text("alphaMode", "OPAQUE")
        if mode not in ("OPAQUE", "MASK", "BLEND"):
            raise place.error("alphaMode", f"must be OPAQUE, MASK or BLEND, not {mode[:40]!r}")
        if mode == "OPAQUE":
            return
        owner, color, texture = glossy, "diffuseFactor", "diffuseTexture"
        if owner is None:
            owner, color, texture = place.object("pbrMetallicRoughness"), "baseColorFactor", "baseColorTexture"
        if owner is not None:
            alpha = read.share(owner, color, (1.0,) * 4)[3]
            value = read.scalar(owner, texture, alpha, "a", "srgb")
            if value != 1:
                document["alpha"] = value
        if mode == "MASK":
            cutoff = place.number("alphaCutoff", 0.5, 0)
            if cutoff > 1:
                document["alpha"] = 0.0
            else:
                document["alpha_cutoff"] = cutoff
