"""The document's materials as glTF's, each written once for all shapes that ask the same of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TypeGuard

from service.document import Scene
from service.document.material import DiffuseMaterial, Material, PrincipledMaterial
from service.document.material.surface import AnySurface
from service.document.texture import ColorTexture, ScalarTexture
from service.exports.gltf import extensions
from service.exports.gltf.builder import Builder, Tree
from service.exports.gltf.material_writer import Asked, MaterialWriter
from service.exports.gltf.textures import Plane, Textures
from service.exports.losses import Losses
from service.exports.principled import as_principled
from service.formats.surface import outputs
from service.formats.surface.outputs import Output
from service.problems import escaped

BLACK = (0.0, 0.0, 0.0)
FILM_WEIGHT = "thin_film_weight"  # of models whose films cover a part, which glTF has as well


@dataclass
class Materials:
    scene: Scene
    builder: Builder
    textures: Textures
    losses: Losses
    _known: dict[tuple[str, Asked], int] = field(default_factory=dict)
    _plain: dict[str, PrincipledMaterial] = field(default_factory=dict)

    def index(self, name: str, asked: Asked) -> int:
        """Raises InvalidDocument, TooLarge."""
        material = self.scene.materials[name]
        if not _transmits(material):
            asked = Asked(asked.double_sided, asked.fades)
        elif not _shines(material):  # such a body has both sides in any case, and glTF wants it to be single-sided
            asked = replace(asked, double_sided=False)
        key = name, asked
        if key not in self._known:
            self._known[key] = self.builder.add("materials", {"name": name, **self._written(name, asked)})
        return self._known[key]

    def is_single_sided(self, name: str) -> bool:
        """True if light leaves its front only, which glTF has for single-sided surfaces alone."""
        material = self.scene.materials[name]
        return _shines(material) and material.emission_sides == "front"

    def _written(self, name: str, asked: Asked) -> Tree:
        material = self.scene.materials[name]
        if is_unlit(material, asked.double_sided):
            made = self._unlit(material, name, asked)
        else:
            made = _Principled(self._as_principled(name), name, self.textures, asked).written()
        return made | ({"doubleSided": True} if asked.double_sided else {})

    def _as_principled(self, name: str) -> PrincipledMaterial:
        if name not in self._plain:
            material, pointer = self.scene.materials[name], f"/materials/{escaped(name)}"
            self._plain[name] = as_principled(material, pointer, self.losses, written={FILM_WEIGHT})
        return self._plain[name]

    def _unlit(self, material: DiffuseMaterial, name: str, asked: Asked) -> Tree:
        writer = MaterialWriter(material, name, self.textures, asked)
        made = writer.base(material.emission, "emission")
        made["extensions"] = self.builder.extension("KHR_materials_unlit", {})
        writer.tell_others({"albedo", "emission", "emission_sides"})
        return made


def is_unlit(material: Material, double_sided: bool) -> TypeGuard[DiffuseMaterial]:
    """True if it is nothing but a glow, as the importer has it for KHR_materials_unlit."""
    if not isinstance(material, DiffuseMaterial) or material.albedo != BLACK:
        return False
    color = material.emission
    factor = color.factor if isinstance(color, ColorTexture) else color
    sides = "both" if double_sided else "front"
    return 0 < max(factor) <= 1 and material.emission_sides == sides and material.normal_map is None


def _shines(material: AnySurface) -> bool:
    emission = getattr(material, "emission", BLACK)
    return max(emission.factor if isinstance(emission, ColorTexture) else emission) > 0


def _transmits(material: AnySurface) -> bool:
    """True if it is a body that light goes through; thin walls are none."""
    if getattr(material, "is_thin", getattr(material, "geometry_thin_walled", False)):
        return False
    found = getattr(material, "transmission", 0.0)
    return bool((found.factor if isinstance(found, ScalarTexture) else found) > 0)


class _Principled(MaterialWriter):
    def written(self) -> Tree:
        weight = getattr(self.given, FILM_WEIGHT, 1.0)
        inputs = outputs.gltf_pbr(self.material, self.tell, self.asked.thickness, Output(weight, FILM_WEIGHT))
        made = self.base(inputs["base_color"].value, "base_color")
        found = extensions.written(self, inputs) | self._emission(made)
        rough, metallic = (
            self.scalar(*inputs[name], channel) for name, channel in (("roughness", 1), ("metallic", 2))
        )
        pbr = made["pbrMetallicRoughness"]
        for name, (factor, _) in (("metallicFactor", metallic), ("roughnessFactor", rough)):
            if factor != 1:
                pbr[name] = factor
        g, b = (self._beside(mine, other) for mine, other in ((rough, metallic), (metallic, rough)))
        if (info := self.textures.info((None, g, b, None), is_srgb=False)) is not None:
            pbr["metallicRoughnessTexture"] = info
        if (normal := self.normal(self.material.normal_map, "normal_map")) is not None:
            made["normalTexture"] = normal
        if found:
            made["extensions"] = found
        self.tell_others(outputs.GLTF_PBR | {"emission_sides"})
        return made

    def _beside(self, mine: tuple[float, Plane | None], other: tuple[float, Plane | None]) -> Plane | None:
        """The plane of one of two numbers that share an image: a constant one needs a channel of ones, unless it
        is 0."""
        factor, plane = mine
        return Plane() if plane is None and other[1] is not None and factor != 0 else plane

    def _emission(self, made: Tree) -> Tree:
        """Adds the colour to `made`; the strength as an extension, a power of two, so that their product is exact."""
        m = self.material
        if not _shines(m):
            return {}
        value = m.emission
        factor, planes = self.color(value, "emission", most=math.inf)
        brightest = max(factor)
        strength = 1.0 if brightest <= 1 else 2.0 ** math.ceil(math.log2(brightest))
        made["emissiveFactor"] = [each / strength for each in factor]
        if (info := self.textures.info((*planes, None), is_srgb=True)) is not None:
            made["emissiveTexture"] = info
        if m.emission_sides == "front" and self.asked.double_sided:
            self.tell("emission_sides", "glTF's double-sided surfaces shine on both sides")
        if strength == 1:
            return {}
        return self.builder.extension("KHR_materials_emissive_strength", {"emissiveStrength": strength})
