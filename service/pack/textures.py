"""Textures -> texels one after another, and for each material which of its numbers gets which of them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from gpu import TextureArrays
from gpu.layout import texture_records
from service.assets import Assets, ImageData
from service.assets.parts import linear
from service.pack.cache import PackCache, lasting
from service.pack.values import member_of
from service.problems import AssetError, FieldError, InvalidDocument
from service.scene import Scene
from service.scene.color import LINEAR_OF_BYTE
from service.scene.material import Material, stretches
from service.scene.mistakes import escaped
from service.scene.texture import (
    CheckerTexture,
    ColorTexture,
    ImageTexture,
    NormalTexture,
    Reference,
    ScalarTexture,
    references,
)

LINEAR = np.array(LINEAR_OF_BYTE, np.float32)
DECODED = " decoded"  # after an asset's reference
MAX_TEXELS = 2**27  # what two textures of the device hold, 16384 rows each


class TexelLimits(Protocol):
    @property
    def max_texels(self) -> int: ...


@dataclass(frozen=True)
class Use:
    """One reference: `material` is an index, `pointer` leads to the reference."""

    material: int
    member: str
    reference: Reference
    texture: ImageTexture | CheckerTexture
    srgb: bool  # bytes that the kernel decodes
    pointer: str
    decoded: bool = False  # floats that are said to be sRGB

    @property
    def kept(self) -> str:
        """Under which the texels of an image are found."""
        assert isinstance(self.texture, ImageTexture)
        return self.texture.asset + (DECODED if self.decoded else "")

    @property
    def look(self) -> tuple[str, bool]:
        """Equal where one look at the texture serves both."""
        return self.reference.texture, self.srgb


@dataclass(frozen=True)
class Texels:
    """All images of a scene; `places`: `Use.kept` -> (first texel among those of its kind, image)."""

    texels: np.ndarray
    floats: np.ndarray
    places: dict[str, tuple[int, ImageData]] = field(default_factory=dict)


@dataclass(frozen=True)
class Reads:
    """What a material reads of its shapes: sets of texture coordinates, and the one that its tangents run along."""

    uv_sets: frozenset[int] = frozenset()
    tangents: int | None = None  # None: it needs none


def reads(scene: Scene) -> dict[str, Reads]:
    """Of the materials that read anything."""
    out = {}
    for name, material in scene.materials.items():
        sets = {key: _uv_set(scene, reference) for key, reference in references(material).items()}
        found = Reads(frozenset(sets.values()), _tangent_set(material, sets))
        if found != Reads():
            out[name] = found
    return out


def _uv_set(scene: Scene, reference: Reference) -> int:
    texture = scene.textures[reference.texture]
    return texture.uv if isinstance(texture, ImageTexture) else 0


def _tangent_set(material: Material, sets: Mapping[str, int]) -> int | None:
    """That of its normal map, or else of its coat's; the first where it only stretches highlights."""
    for name in ("normal_map", "clearcoat_normal_map"):
        if name in sets:
            return sets[name]
    return 0 if stretches(material) else None


def pack_textures(
    scene: Scene, assets: Assets, cache: PackCache | None, limits: TexelLimits | None
) -> tuple[TextureArrays | None, list[Use], Texels, list[str]]:
    """The renderer's arrays or None, what they serve, and warnings. Raises InvalidDocument."""
    images = _images(scene, assets)
    uses = list(_uses(scene, images))
    _check_channels(uses, images)
    used = {use.kept: use.texture.asset for use in uses if isinstance(use.texture, ImageTexture)}
    wanted = {use.texture.asset: use.reference.texture for use in uses if isinstance(use.texture, ImageTexture)}
    texels = _texels({kept: (wanted[asset], images[asset]) for kept, asset in used.items()}, cache, limits)
    if not uses:
        return None, uses, texels, []
    slots = _slots(uses)
    words = _words(len(scene.materials), uses, slots, texels)
    write_uses(words, scene, slots)
    key = " ".join(f"{kept}@{first}" for kept, (first, _) in texels.places.items())
    key = key if all(map(lasting, texels.places)) else ""
    arrays = TextureArrays(slots, words, texels.texels, texels.floats, key)
    return arrays, uses, texels, [*_told(wanted, images), *_warnings(uses, texels)]


def _images(scene: Scene, assets: Assets) -> dict[str, ImageData]:
    """By asset: of all textures, used or not, so that none is wrong unnoticed."""
    out: dict[str, ImageData] = {}
    errors = []
    for name, texture in scene.textures.items():
        if isinstance(texture, ImageTexture) and texture.asset not in out:
            try:
                out[texture.asset] = assets.image(texture.asset)
            except AssetError as error:
                errors.append(FieldError(f"/textures/{escaped(name)}/asset", error.detail))
    if errors:
        raise InvalidDocument(errors)
    return out


def _uses(scene: Scene, images: Mapping[str, ImageData]) -> Iterator[Use]:
    for i, (name, material) in enumerate(scene.materials.items()):
        for key, reference in references(material).items():
            texture = scene.textures[reference.texture]
            srgb = is_8bit = False
            if isinstance(texture, ImageTexture):
                is_8bit = images[texture.asset].is_8bit
                assumed = is_8bit and isinstance(reference, ColorTexture)
                srgb = assumed if texture.color_space is None else texture.color_space == "srgb"
            pointer = f"/materials/{escaped(name)}/{key}"
            member = member_of(material, key)
            yield Use(i, member, reference, texture, srgb and is_8bit, pointer, srgb and not is_8bit)


def _check_channels(uses: list[Use], images: Mapping[str, ImageData]) -> None:
    errors = []
    for use in uses:
        name = use.reference.texture
        channels = images[use.texture.asset].pixels.shape[2] if isinstance(use.texture, ImageTexture) else 3
        if isinstance(use.reference, NormalTexture):
            if channels < 3:
                detail = f"a normal map has red, green and blue; {name!r} is grey"
                errors.append(FieldError(f"{use.pointer}/texture", detail))
        elif use.reference.channel == "a" and channels < 4:
            detail = f"texture {name!r} has no alpha: it has {'one channel' if channels == 1 else 'r, g and b'}"
            errors.append(FieldError(f"{use.pointer}/channel", detail))
    if errors:
        raise InvalidDocument(errors)


def _texels(wanted: dict[str, tuple[str, ImageData]], cache: PackCache | None, limits: TexelLimits | None) -> Texels:
    room = MAX_TEXELS if limits is None else min(limits.max_texels, MAX_TEXELS)
    for name, image in wanted.values():
        height, width = image.pixels.shape[:2]
        if width * height > room:
            detail = f"has {width} x {height} texels; this server has room for {room} more in a scene"
            raise InvalidDocument([FieldError(f"/textures/{escaped(name)}/asset", detail)])
        room -= width * height
    images = {kept: image for kept, (_, image) in wanted.items()}
    if cache is None or not images or not all(map(lasting, images)):
        return _laid(images)
    return cache.get(("texels", tuple(images)), lambda: _laid(images))


def _laid(images: dict[str, ImageData]) -> Texels:
    places: dict[str, tuple[int, ImageData]] = {}
    ends = {True: 0, False: 0}
    for kept, image in images.items():
        places[kept] = ends[image.is_8bit], _decoded(image) if kept.endswith(DECODED) else image
        ends[image.is_8bit] += image.pixels.shape[0] * image.pixels.shape[1]
    out: dict[bool, np.ndarray] = {
        True: np.empty((ends[True], 4), np.uint8),
        False: np.empty((ends[False], 4), np.float32),
    }
    for first, image in places.values():
        height, width, channels = image.pixels.shape
        part = out[image.is_8bit][first : first + width * height].reshape(height, width, 4)
        part[..., :3] = image.pixels[..., :3]  # a grey one three times
        part[..., 3] = image.pixels[..., 3] if channels == 4 else 255 if image.is_8bit else 1
    return Texels(out[True], out[False], places)


def _decoded(image: ImageData) -> ImageData:
    """Linear floats of sRGB ones, such as a PNG of 16 bits has; its alpha as it is."""
    pixels = np.array(image.pixels, np.float32)
    pixels[..., :3] = linear(pixels[..., :3])
    return ImageData(pixels)


def _slots(uses: list[Use]) -> dict[str, int]:
    """Member -> slot. Members share one where no material would have to look at two textures for it."""
    taken: dict[str, dict[int, tuple[str, bool]]] = {}
    for use in uses:
        taken.setdefault(use.member, {})[use.material] = use.look
    surface = [name for name in (*texture_records.SURFACE_RANGES, *texture_records.NORMALS) if name in taken]
    slots: dict[str, int] = {}
    held: list[dict[int, tuple[str, bool]]] = []
    for name in surface:
        mine = taken[name]
        fits = (all(others.get(m, look) == look for m, look in mine.items()) for others in held)
        slots[name] = next((slot for slot, good in enumerate(fits) if good), len(held))
        if slots[name] == len(held):
            held.append({})
        held[slots[name]] |= mine
    for name in texture_records.OTHER_RANGES:
        if name in taken:
            slots[name] = len(held)
            held.append(taken[name])
    return slots


def _words(materials: int, uses: list[Use], slots: dict[str, int], texels: Texels) -> np.ndarray:
    """(materials, n) uint32: the slots filled in, the uses still empty."""
    count = max(slots.values()) + 1
    records = np.zeros((materials, count), texture_records.TextureSlot.dtype)
    for slot in range(count):
        mine = [use for use in uses if slots[use.member] == slot]
        for use in mine:
            records[use.material, slot] = record_of(use, texels)
        # A look that no material asked for still is a look: somewhere in the texels, and raising no other flag.
        without = [m for m in range(materials) if all(use.material != m for use in mine)]
        records[without, slot] = records[mine[0].material, slot]
    slot_words = count * texture_records.TextureSlot.words
    words = np.zeros((materials, slot_words + len(slots) * texture_records.TextureUse.words), np.uint32)
    words[:, :slot_words] = records.view(np.uint32).reshape(materials, -1)
    return words


def record_of(use: Use, texels: Texels) -> np.ndarray:
    record = np.zeros((), texture_records.TextureSlot.dtype)
    texture = use.texture
    if isinstance(texture, CheckerTexture):
        record["width"] = record["height"] = 1
        record["flags"] = texture_records.SLOT_CHECKER
        record["turn"] = (texture.scale[0], 0, 0, texture.scale[1])
        record["color_a"], record["color_b"] = texture.a, texture.b
        return record
    first, image = texels.places[use.kept]
    flags = {"repeat": 0, "clamp": texture_records.SLOT_CLAMP, "mirror": texture_records.SLOT_MIRROR}[texture.wrap]
    flags |= texture_records.SLOT_SRGB if use.srgb else 0
    flags |= 0 if image.is_8bit else texture_records.SLOT_FLOATS
    flags |= texture_records.SLOT_UV_1 if texture.uv == 1 else 0
    angle = math.radians(math.fmod(texture.rotation, 360.0))
    c, s = math.cos(angle), math.sin(angle)
    record["first"], record["flags"] = first, flags
    record["height"], record["width"] = image.pixels.shape[:2]
    record["turn"] = (c * texture.scale[0], -s * texture.scale[1], s * texture.scale[0], c * texture.scale[1])
    record["offset_u"], record["offset_v"] = texture.offset
    return record


def write_uses(words: np.ndarray, scene: Scene, slots: dict[str, int]) -> None:
    """Factors and channels into the uses of `words`: what an edit of a material may change of them."""
    first = (max(slots.values()) + 1) * texture_records.TextureSlot.words
    records = words[:, first:].copy().view(texture_records.TextureUse.dtype)
    records[:] = 0
    places = {member: i for i, member in enumerate(slots)}
    for i, material in enumerate(scene.materials.values()):
        for key, reference in references(material).items():
            record = records[i, places[member_of(material, key)]]
            record["channel"], record["factor"] = _channel(reference), _factor(reference)
    words[:, first:] = records.view(np.uint32)


def _channel(reference: Reference) -> int:
    if isinstance(reference, NormalTexture) or reference.channel is None:
        return texture_records.CHANNEL_COLOR
    return texture_records.CHANNEL_R + "rgba".index(reference.channel)


def _factor(reference: Reference) -> tuple[float, float, float]:
    if isinstance(reference, NormalTexture):
        return reference.scale, 0.0, 0.0
    return reference.factor if isinstance(reference, ColorTexture) else (reference.factor, 0.0, 0.0)


def repacked(textures: TextureArrays, scene: Scene) -> np.ndarray:
    """`textures.words` of a scene whose materials differ in numbers only."""
    words = textures.words.copy()
    write_uses(words, scene, textures.slots)
    return words


def values_of(use: Use, pixels: np.ndarray) -> np.ndarray:
    """(..., 3) float32: what texels (..., channels), bytes or floats, give a colour, before its range."""
    if pixels.dtype == np.uint8:
        linear = pixels.astype(np.float32) / np.float32(255)
        if use.srgb:
            linear[..., :3] = LINEAR[pixels[..., :3]]
        pixels = linear
    channel = _channel(use.reference)
    if channel != texture_records.CHANNEL_COLOR:
        pixels = pixels[..., [min(channel - texture_records.CHANNEL_R, pixels.shape[-1] - 1)]]
    return np.asarray(pixels[..., :3] * np.array(_factor(use.reference), np.float32))


def _told(wanted: Mapping[str, str], images: Mapping[str, ImageData]) -> Iterator[str]:
    """What is odd about the images of these textures."""
    for asset, name in wanted.items():
        yield from (f"/textures/{escaped(name)}/asset: {warning}" for warning in images[asset].warnings)


def _warnings(uses: list[Use], texels: Texels) -> Iterator[str]:
    charts = {use.material: getattr(use.texture, "uv", 0) for use in uses if use.member == "normal"}
    for use in uses:
        if isinstance(use.reference, NormalTexture):
            own = getattr(use.texture, "uv", 0)
            along = charts.get(use.material, own)
            if own != along:
                yield f"{use.pointer}: reads uv set {own}, but runs along set {along}, that of the normal map"
            continue
        low, high = texture_records.TEXTURABLE[use.member]
        pixels: np.ndarray
        if isinstance(use.texture, CheckerTexture):
            pixels = np.array([[use.texture.a, use.texture.b]], np.float32)
        elif texels.places[use.kept][1].is_8bit:
            continue  # 0..1: what the factor makes of that keeps to the range by definition
        else:
            pixels = texels.places[use.kept][1].pixels
        values = values_of(use, pixels)
        if isinstance(use.reference, ScalarTexture):
            values = values[..., :1]
        beyond = int(np.count_nonzero(((values < low) | (values > high)).any(axis=-1)))
        if beyond:
            yield f"{use.pointer}: {beyond} texels of {use.reference.texture!r} are clamped to {low:g}..{high:g}"
