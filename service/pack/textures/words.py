"""Textures -> texels one after another, and for each material the words that say which number reads which of them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np

from gpu import TextureArrays
from gpu.layout import texture_records
from gpu.layout.texture_records import Texels
from service.document import Scene
from service.document.color import LINEAR_OF_BYTE
from service.document.procedural import NoiseTexture
from service.document.texture import (
    CheckerTexture,
    ColorTexture,
    HeightTexture,
    ImageTexture,
    NormalTexture,
    Reference,
    ScalarTexture,
    is_projected,
)
from service.formats import Assets, ImageData
from service.pack.cache import PackCache, lasting
from service.pack.parameters import member_of
from service.pack.textures.images import PackedTexels, TexelLimits, images_of, lay_out
from service.pack.textures.recipes import listed, recipe_flags, recipe_words, room_for_stops
from service.pack.textures.uses import TextureReference, check_channels, sampled, uses_of
from service.problems import escaped

LINEAR = np.array(LINEAR_OF_BYTE, np.float32)
WRAPS = {"repeat": 0, "clamp": texture_records.SLOT_CLAMP, "mirror": texture_records.SLOT_MIRROR}


def pack_textures(
    scene: Scene, drawn: Scene, assets: Assets, cache: PackCache | None, limits: TexelLimits | None
) -> tuple[TextureArrays | None, list[TextureReference], PackedTexels, list[str]]:
    """The renderer's arrays or None of what is `drawn` of a scene, the references that they serve, and warnings.
    Raises InvalidDocument, for what is not drawn as well."""
    images = images_of(scene, assets)
    check_channels(uses_of(scene, images), images)
    uses = uses_of(drawn, images)
    used = {use.key: use.texture.content for use in uses if isinstance(use.texture, ImageTexture)}
    wanted = {use.texture.content: use.name for use in uses if isinstance(use.texture, ImageTexture)}
    averaged = {use.key: use.averaged for use in uses if isinstance(use.texture, ImageTexture) and use.averaged}
    texels = lay_out(
        {stored: (wanted[asset], images[asset]) for stored, asset in used.items()}, averaged, cache, limits
    )
    if not uses:
        return None, uses, texels, []
    slots = _slots(uses)
    stops = room_for_stops(uses)
    words = _words(len(drawn.materials), uses, slots, texels, stops)
    write_uses(words, drawn, slots)
    key = " ".join(f"{stored}@{first}:{averaged.get(stored)}" for stored, (first, _) in texels.places.items())
    key = key if all(map(lasting, texels.places)) else ""
    arrays = TextureArrays(slots, words, texels.texels, texels.floats, key, stops)
    return arrays, uses, texels, [*_image_warnings(wanted, images), *_warnings(uses, texels)]


def _slots(uses: list[TextureReference]) -> dict[str, int]:
    """Member -> slot. Members share a slot where no material reads two textures by them."""
    looks: dict[str, dict[int, tuple[str, bool]]] = {}
    for use in uses:
        looks.setdefault(use.member, {})[use.material] = use.sample_key
    surface = [name for name in (*texture_records.SURFACE_RANGES, *texture_records.NORMALS) if name in looks]
    slots: dict[str, int] = {}
    by_slot: list[dict[int, tuple[str, bool]]] = []
    for name in surface:
        mine = looks[name]
        fits = (all(others.get(m, look) == look for m, look in mine.items()) for others in by_slot)
        slots[name] = next((slot for slot, good in enumerate(fits) if good), len(by_slot))
        if slots[name] == len(by_slot):
            by_slot.append({})
        by_slot[slots[name]] |= mine
    for name in (*texture_records.OTHER_RANGES, texture_records.HEIGHT):
        if name in looks:
            slots[name] = len(by_slot)
            by_slot.append(looks[name])
    return slots


def _words(
    materials: int, uses: list[TextureReference], slots: dict[str, int], texels: PackedTexels, stops: int | None
) -> np.ndarray:
    """(materials, n) uint32: the slots and the recipes filled in, the uses still empty."""
    count = max(slots.values()) + 1
    records = np.zeros((materials, count), texture_records.TextureSlot.dtype)
    recipe_size = 0 if stops is None else texture_records.TextureRecipe.words + 4 * stops
    recipes = np.zeros((materials, count, recipe_size), np.uint32)
    for slot in range(count):
        mine = [use for use in uses if slots[use.member] == slot]
        for use in mine:
            records[use.material, slot] = record_of(use, texels)
            if stops is not None:
                records[use.material, slot]["flags"] |= recipe_flags(use, slot)
                recipes[use.material, slot] = recipe_words(use, stops)
        # Kernels sample the slots that a material does not use as well: those point at some texels and raise no flag.
        without = [m for m in range(materials) if all(use.material != m for use in mine)]
        records[without, slot] = records[mine[0].material, slot]
        recipes[without, slot] = recipes[mine[0].material, slot]
    blank = np.zeros((materials, len(slots) * texture_records.TextureUse.words), np.uint32)
    return np.concatenate(
        [records.view(np.uint32).reshape(materials, -1), blank, recipes.reshape(materials, -1)], axis=1
    )


def record_of(use: TextureReference, texels: PackedTexels) -> np.ndarray:
    record = np.zeros((), texture_records.TextureSlot.dtype)
    texture = use.texture
    if not isinstance(texture, ImageTexture):
        record["width"] = record["height"] = 1
        record["turn"] = (1, 0, 0, 1)
    if texture is None:
        return record
    if isinstance(texture, NoiseTexture):
        record["color_a"], record["color_b"] = texture.a, texture.b
        return record
    if isinstance(texture, CheckerTexture):
        record["flags"] = texture_records.SLOT_CHECKER | _projection(texture.mapping)
        record["turn"] = (texture.scale[0], 0, 0, texture.scale[1])
        record["color_a"], record["color_b"] = texture.a, texture.b
        return record
    first, image = texels.places[use.key]
    u, v = (WRAPS[wrap] for wrap in texture.wraps)
    flags = u | v << texture_records.SLOT_V_SHIFT
    flags |= texture_records.SLOT_SRGB if use.srgb else 0
    flags |= 0 if image.is_8bit else texture_records.SLOT_FLOATS
    flags |= texture_records.SLOT_UV_1 if texture.uv == 1 else 0
    flags |= _projection(texture.mapping)
    angle = math.radians(math.fmod(texture.rotation, 360.0))
    c, s = math.cos(angle), math.sin(angle)
    record["first"] = first
    height, width = record["height"], record["width"] = image.pixels.shape[:2]
    if use.key in texels.averaged:
        across, down = texture_records.level_powers(width, height)
        flags |= texture_records.SLOT_LEVELS
        record["color_a"] = across, down, 0
        flags |= texture_records.SLOT_NORMALS if texels.averaged[use.key] is Texels.NORMALS else 0
    record["flags"] = flags
    record["turn"] = (c * texture.scale[0], -s * texture.scale[1], s * texture.scale[0], c * texture.scale[1])
    record["offset_u"], record["offset_v"] = texture.offset
    return record


def _projection(mapping: str) -> int:
    projected = texture_records.SLOT_PROJECTED
    return {"uv": 0, "box": projected, "sphere": projected | texture_records.SLOT_ROUND}[mapping]


def write_uses(words: np.ndarray, scene: Scene, slots: dict[str, int]) -> None:
    """Write factors and channels, which an edit of a material may change, into the uses of `words`."""
    first = (max(slots.values()) + 1) * texture_records.TextureSlot.words
    last = first + len(slots) * texture_records.TextureUse.words
    records = words[:, first:last].copy().view(texture_records.TextureUse.dtype)
    records[:] = 0
    places = {member: i for i, member in enumerate(slots)}
    for i, material in enumerate(scene.materials.values()):
        for key, reference in sampled(material).items():
            record = records[i, places[member_of(material, key)]]
            record["channel"], record["factor"] = _channel(reference), _factor(reference)
    words[:, first:last] = records.view(np.uint32)


def _channel(reference: Reference) -> int:
    if isinstance(reference, NormalTexture) or reference.channel is None:
        return texture_records.CHANNEL_COLOR
    return texture_records.CHANNEL_R + "rgba".index(reference.channel)


def _factor(reference: Reference) -> tuple[float, float, float]:
    if isinstance(reference, NormalTexture | HeightTexture):
        return reference.scale, 0.0, 0.0
    return reference.factor if isinstance(reference, ColorTexture) else (reference.factor, 0.0, 0.0)


def repacked(textures: TextureArrays, scene: Scene) -> np.ndarray:
    """`textures.words` for a scene whose materials differ from the packed one in numbers only."""
    words = textures.words.copy()
    write_uses(words, scene, textures.slots)
    return words


def values_of(use: TextureReference, pixels: np.ndarray) -> np.ndarray:
    """(..., 3) float32: the colour that texels (..., channels), bytes or floats, give, before it is clamped."""
    if pixels.dtype == np.uint8:
        linear = pixels.astype(np.float32) / np.float32(255)
        if use.srgb:
            linear[..., :3] = LINEAR[pixels[..., :3]]
        pixels = linear
    channel = _channel(use.reference)
    if channel != texture_records.CHANNEL_COLOR:
        pixels = pixels[..., [min(channel - texture_records.CHANNEL_R, pixels.shape[-1] - 1)]]
    return np.asarray(pixels[..., :3] * np.array(_factor(use.reference), np.float32))


def _image_warnings(wanted: Mapping[str, str], images: Mapping[str, ImageData]) -> Iterator[str]:
    """Warnings about the images of these textures."""
    for asset, name in wanted.items():
        yield from (f"/textures/{escaped(name)}/asset: {warning}" for warning in images[asset].warnings)


def _warnings(uses: list[TextureReference], texels: PackedTexels) -> Iterator[str]:
    flat = [use for use in uses if isinstance(use.reference, NormalTexture) and not is_projected(use.texture)]
    charts = {use.material: getattr(use.texture, "uv", 0) for use in flat if use.member == "normal"}
    for use in uses:
        if isinstance(use.reference, NormalTexture):
            if use not in flat:
                continue
            uv_set = getattr(use.texture, "uv", 0)
            along = charts.get(use.material, uv_set)
            if uv_set != along:
                yield f"{use.pointer}: reads uv set {uv_set}, but runs along set {along}, that of the normal map"
            continue
        if isinstance(use.reference, HeightTexture):
            continue
        low, high = use.bounds
        pixels = listed(use)
        if pixels is not None:
            pass
        elif texels.places[use.key][1].is_8bit:
            continue  # 0..1: times the factor it stays in the range by definition
        else:
            pixels = texels.places[use.key][1].pixels
        values = values_of(use, pixels)
        if isinstance(use.reference, ScalarTexture):
            values = values[..., :1]
        beyond = int(np.count_nonzero(((values < low) | (values > high)).any(axis=-1)))
        if beyond:
            yield f"{use.pointer}: {beyond} texels of {use.reference.texture!r} are clamped to {low:g}..{high:g}"
