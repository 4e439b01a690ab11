"""The references of materials to textures, and the charts of shapes that they need."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

from gpu.layout import texture_records
from gpu.layout.texture_records import Texels
from service.document import Scene
from service.document.material import Material, MicrofacetMaterial, stretches
from service.document.procedural import NoiseTexture, RampInput, RampTexture
from service.document.shape import MeshShape
from service.document.texture import (
    CheckerTexture,
    ColorTexture,
    HeightTexture,
    ImageTexture,
    NormalTexture,
    Reference,
    Texture,
    is_projected,
    references,
)
from service.formats import ImageData
from service.pack.parameters import member_of
from service.problems import FieldError, InvalidDocument, escaped

# Appended to the reference of an asset whose texels, or whose mip levels, are not those that stand under it alone.
DECODED = " decoded"  # sRGB floats that were made linear
NORMALS = " normals"  # averaged as vectors
LINEAR = " linear"  # averaged as numbers, where others average the same bytes as sRGB
POINTWISE = ("opacity", "cutoff", texture_records.HEIGHT)  # members looked up at single points, without mip levels


@dataclass(frozen=True)
class TextureReference:
    """One reference of a material to a texture. `material` is an index; `pointer` is that of the reference.

    `texture` is the one that is read, by a `ramp` or as it is, and `name` its name; None where a ramp reads a
    coordinate.
    """

    material: int
    member: str
    reference: Reference
    texture: ImageTexture | CheckerTexture | NoiseTexture | None
    ramp: RampTexture | None
    name: str
    srgb: bool  # bytes that the kernel decodes
    pointer: str
    bounds: tuple[float, float]  # that its values are clamped to
    suffix: str = ""  # DECODED, NORMALS, LINEAR or none

    @property
    def key(self) -> str:
        """The key under which the texels of an image are stored."""
        assert isinstance(self.texture, ImageTexture)
        return self.texture.content + self.suffix

    @property
    def averaged(self) -> Texels | None:
        """How the mip levels of an image are averaged; None where this reference needs none."""
        if self.member in POINTWISE:
            return None
        return Texels.NORMALS if self.suffix == NORMALS else Texels.SRGB if self.srgb else Texels.LINEAR

    @property
    def sample_key(self) -> tuple[str, bool]:
        """A key that is equal where one sample of the texture serves both references."""
        return self.reference.texture + self.suffix, self.srgb


@dataclass(frozen=True)
class RequiredCharts:
    """The charts of its shapes that a material reads: sets of texture coordinates, and the set of its tangents."""

    uv_sets: frozenset[int] = frozenset()
    tangents: int | None = None  # None: it needs none
    height: tuple[HeightTexture, Texture] | None = None  # that moves meshes of the material


def required_charts(scene: Scene) -> dict[str, RequiredCharts]:
    """The charts of the materials that read any."""
    displaced = {shape.material for shape in scene.shapes if isinstance(shape, MeshShape) and shape.displacement}
    out = {}
    for name, material in scene.materials.items():
        sets = {key: _uv_set(scene, reference) for key, reference in sampled(material).items()}
        tangents, height = _tangent_set(scene, material, sets), None
        if name in displaced and material.height is not None:
            sets["height"] = _uv_set(scene, material.height)
            height = material.height, scene.textures[material.height.texture]
        flat = frozenset(which for which in sets.values() if which is not None)
        found = RequiredCharts(flat, tangents, height)
        if found != RequiredCharts():
            out[name] = found
    return out


def _read(scene: Scene, name: str) -> tuple[str, ImageTexture | CheckerTexture | NoiseTexture | None]:
    """The texture that is read in the end, and its name: that of a ramp's input. None for a coordinate."""
    texture = scene.textures[name]
    if not isinstance(texture, RampTexture):
        return name, texture
    if not isinstance(texture.input, RampInput):
        return name, None
    inner = scene.textures[texture.input.texture]
    assert not isinstance(inner, RampTexture)  # refused with the document
    return texture.input.texture, inner


def _uv_set(scene: Scene, reference: Reference) -> int | None:
    """The set of coordinates that a reference reads; None where it lies in the shape's own space."""
    _, texture = _read(scene, reference.texture)
    if is_projected(texture) or (isinstance(texture, NoiseTexture) and texture.space == "object"):
        return None
    return texture.uv if isinstance(texture, ImageTexture) else 0


def _tangent_set(scene: Scene, material: Material, sets: Mapping[str, int | None]) -> int | None:
    """The set of its normal map, or else of its coat's; the first one where only its highlights are anisotropic. Of a
    projected normal map kernels know the directions without a chart."""
    projected = {
        key for key, reference in references(material).items() if is_projected(_read(scene, reference.texture)[1])
    }
    by_member = {member_of(material, key): uv_set for key, uv_set in sets.items() if key not in projected}
    for name in texture_records.NORMALS:
        if name in by_member:
            return by_member[name] or 0
    return 0 if stretches(material) else None


def sampled(material: Material) -> dict[str, Reference]:
    """The references that kernels read: all but a height that does not show in the shading."""
    found = references(material)
    height = found.get("height")
    if isinstance(height, HeightTexture) and not height.shading:
        del found["height"]
    return found


def uses_of(scene: Scene, images: Mapping[str, ImageData]) -> list[TextureReference]:
    uses = list(_uses(scene, images))
    colored = {
        use.texture.content for use in uses if isinstance(use.texture, ImageTexture) and use.averaged is Texels.SRGB
    }
    return [
        replace(use, suffix=LINEAR)
        if isinstance(use.texture, ImageTexture)
        and use.texture.content in colored
        and use.averaged is Texels.LINEAR
        and not use.suffix
        else use
        for use in uses
    ]


def _uses(scene: Scene, images: Mapping[str, ImageData]) -> Iterator[TextureReference]:
    for i, (name, material) in enumerate(scene.materials.items()):
        for key, reference in sampled(material).items():
            whole = scene.textures[reference.texture]
            ramp = whole if isinstance(whole, RampTexture) else None
            read, texture = _read(scene, reference.texture)
            srgb = is_8bit = False
            if isinstance(texture, ImageTexture):
                is_8bit = images[texture.content].is_8bit
                assumed = is_8bit and isinstance(reference, ColorTexture) and ramp is None
                srgb = assumed if texture.color_space is None else texture.color_space == "srgb"
            pointer = f"/materials/{escaped(name)}/{key}"
            member = member_of(material, key)
            bounds = texture_records.TEXTURABLE.get(member, texture_records.UNIT)
            if isinstance(material, MicrofacetMaterial) and key == "alpha":
                bounds = material.alpha_range
            suffix = DECODED if srgb and not is_8bit else ""
            if isinstance(reference, NormalTexture) and isinstance(whole, ImageTexture) and not srgb:
                suffix = NORMALS
            seen = texture, ramp, read
            yield TextureReference(i, member, reference, *seen, srgb and is_8bit, pointer, bounds, suffix)


def check_channels(uses: list[TextureReference], images: Mapping[str, ImageData]) -> None:
    errors = []
    for use in uses:
        name = use.reference.texture
        channels = images[use.texture.content].pixels.shape[2] if isinstance(use.texture, ImageTexture) else 3
        if use.ramp is not None:
            given = use.ramp.input
            if isinstance(given, RampInput) and given.channel == "a" and channels < 4:
                detail = f"texture {given.texture!r} has no alpha"
                errors.append(FieldError(f"/textures/{escaped(name)}/input/channel", detail))
            channels = 3
        if isinstance(use.reference, NormalTexture):
            if channels < 3:
                detail = f"a normal map has red, green and blue; {name!r} is grey"
                errors.append(FieldError(f"{use.pointer}/texture", detail))
        elif use.reference.channel == "a" and channels < 4:
            detail = f"texture {name!r} has no alpha: it has {'one channel' if channels == 1 else 'r, g and b'}"
            errors.append(FieldError(f"{use.pointer}/channel", detail))
    if errors:
        raise InvalidDocument(errors)
