"""glTF's materials as the contract's `principled`, or as bare emission where they are unlit."""

from __future__ import annotations

from typing import Any

from service.assets.gltf import layers
from service.assets.gltf.file import GltfFile
from service.assets.gltf.notes import Notes
from service.assets.gltf.place import Place
from service.assets.gltf.specular_glossiness import converted
from service.assets.gltf.textures import Chart, ColorSpace, Textures, factor, unique

WHITE = (1.0, 1.0, 1.0)


class Reading:
    """One material for meshes that have these uv sets, and perhaps a direction for what is brushed."""

    def __init__(
        self, place: Place, textures: Textures, charts: tuple[Chart | None, ...], directed: bool, notes: Notes
    ) -> None:
        self.place, self.textures, self.charts, self.directed, self.notes = place, textures, charts, directed, notes

    def texture(self, owner: Place | None, name: str, space: ColorSpace) -> str | None:
        return self.textures.use(owner.object(name), space, self.charts) if owner else None

    def color(self, owner: Place, name: str, values: tuple[float, ...]) -> Any:
        """A colour, or the texture that it multiplies."""
        texture = self.texture(owner, name, "srgb")
        return factor(values) if texture is None else {"texture": texture, "factor": factor(values)}

    def share(self, owner: Place, name: str, default: tuple[float, ...]) -> tuple[float, ...]:
        """A colour within 0..1, perhaps with alpha."""
        found = owner.color(name, default)
        if max(found) > 1:
            self.notes.add(owner.at(name), "values above 1 are not supported; 1 is used instead")
        return tuple(min(value, 1.0) for value in found)

    def scalar(self, owner: Place, name: str, value: float, channel: str, space: ColorSpace = "linear") -> Any:
        """A number, or the texture's channel that it multiplies; an image without alpha has 1 there."""
        info = owner.object(name)
        if channel == "a" and info is not None and "A" not in self.textures.channels(info):
            return value
        texture = self.texture(owner, name, space)
        return value if texture is None else {"texture": texture, "channel": channel, "factor": value}


class Materials:
    """`documents` by name, as far as they were asked for."""

    def __init__(self, file: GltfFile, textures: Textures, notes: Notes) -> None:
        self.file, self.textures, self.notes = file, textures, notes
        self.documents: dict[str, dict[str, Any]] = {}
        self._names: dict[tuple[Any, ...], str] = {}

    def name(self, primitive: Place, charts: tuple[Chart | None, ...]) -> tuple[str, Place]:
        """The document's name for a primitive's material, and the material."""
        given = "material" in primitive
        place = self.file.follow(primitive, "material", "materials") if given else Place({}, "")  # all defaults
        attributes = primitive.need("attributes")
        directed = charts[0] is not None or ("TANGENT" in attributes and "NORMAL" in attributes)
        read = Reading(place, self.textures, charts, directed, self.notes)
        key = place.pointer, self.textures.kinds(charts), directed
        if key not in self._names:
            document = self._document(read)
            same = [n for (pointer, *_), n in self._names.items() if pointer == place.pointer]
            found = next((name for name in same if self.documents[name] == document), None)
            if found is None:
                found = unique(place.text("name") or place.pointer[1:].replace("/", " ") or "default", self.documents)
                self.documents[found] = document
            self._names[key] = found
        return self._names[key], place

    def _document(self, read: Reading) -> dict[str, Any]:
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

    def _rough(self, read: Reading) -> dict[str, Any]:
        place = read.place
        rough = place.object("pbrMetallicRoughness") or Place({}, place.at("pbrMetallicRoughness"))
        base = read.share(rough, "baseColorFactor", (1.0,) * 4)
        metallic, roughness = rough.number("metallicFactor", 1, 0, 1), rough.number("roughnessFactor", 1, 0, 1)
        document: dict[str, Any] = {
            "type": "principled",
            "base_color": read.color(rough, "baseColorTexture", base[:3]),
            "metallic": read.scalar(rough, "metallicRoughnessTexture", metallic, "b"),
            "roughness": read.scalar(rough, "metallicRoughnessTexture", roughness, "g"),
        }
        document |= self._emission(read) | self._normal(read)
        layers.add(read, document)
        return document

    def _unlit(self, read: Reading) -> dict[str, Any]:
        """As it is: its colour is radiance, and nothing is reflected."""
        rough = read.place.object("pbrMetallicRoughness") or Place({}, read.place.at("pbrMetallicRoughness"))
        base = rough.color("baseColorFactor", (1.0,) * 4)
        document = {"type": "diffuse", "albedo": 0.0, "emission": read.color(rough, "baseColorTexture", base[:3])}
        if read.place.flag("doubleSided"):
            document["emission_sides"] = "both"
        return document

    def _emission(self, read: Reading) -> dict[str, Any]:
        place = read.place
        strength = place.extension("KHR_materials_emissive_strength")
        scale = strength.number("emissiveStrength", 1, 0) if strength else 1.0
        emission: tuple[float, ...] = tuple(place.radiance("emissiveFactor", (0.0, 0.0, 0.0), scale))
        if not max(emission):
            return {}
        sides = {"emission_sides": "both"} if place.flag("doubleSided") else {}
        return {"emission": read.color(place, "emissiveTexture", emission), **sides}

    def _normal(self, read: Reading) -> dict[str, Any]:
        return layers.normal_map(read, read.place, "normalTexture", "normal_map")

    def _alpha(self, read: Reading, document: dict[str, Any], glossy: Place | None) -> None:
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
