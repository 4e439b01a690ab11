"""The thickness of KHR_materials_iridescence, computed texel by texel where textures say them."""

from __future__ import annotations

from typing import Any

import numpy as np

from service.formats.read.gltf.json_view import JsonView
from service.formats.read.gltf.material_reader import MaterialReader
from service.formats.read.gltf.texture_bake import pixels, png
from service.formats.read.gltf.textures import Textures
from service.formats.surface.parts import HALF

MOST, LEAST, THICKEST = 400.0, 100.0, 1e4  # nm: the extension's defaults, and the thickest film of a document
LARGEST = 4096  # texels a side of a computed image


def thickness(read: MaterialReader, place: JsonView, is_masked: bool = False) -> Any:
    """In nm: a number, or a texture; with the mask, 0 where the film covers less than half of the surface."""
    share = place.number("iridescenceFactor", 0, 0, 1)
    mask = read.texture(place, "iridescenceTexture") if is_masked else None
    texture = read.texture(place, "iridescenceThicknessTexture")
    most = _nanometres(read, place, "iridescenceThicknessMaximum", MOST)
    if texture is None and mask is None:
        return most
    least = most if texture is None else _nanometres(read, place, "iridescenceThicknessMinimum", LEAST)
    if max(least, most) == 0:
        return 0.0
    if mask is None and least == 0:
        return {"texture": texture, "channel": "g", "factor": most}
    return _baked(read, place, (share, least, most), (mask, texture))


def _nanometres(read: MaterialReader, place: JsonView, name: str, default: float) -> float:
    found = place.number(name, default, 0)
    if found > THICKEST:
        read.notes.add(place.at(name), f"a film of {found:g} nm is not supported; {THICKEST:g} nm is used instead")
    return min(found, THICKEST)


def _baked(
    read: MaterialReader,
    place: JsonView,
    numbers: tuple[float, float, float],
    names: tuple[str | None, str | None],
) -> dict[str, Any]:
    """An image of thicknesses, whose factor is the largest one: a step of 8 bits is 0.4 % of that."""
    textures = read.textures
    infos = [place.object(name) for name in ("iridescenceTexture", "iridescenceThicknessTexture")]
    used = [(info, name) for info, name in zip(infos, names, strict=True) if info is not None and name is not None]
    settings = [{k: v for k, v in textures.documents[name].items() if k != "asset"} for _, name in used]
    if settings[0] != settings[-1]:
        detail = "this texture is placed like the film's other one, because the two are merged"
        read.notes.add(used[0][0].pointer, detail)
    key = f"film {numbers!r}", place.pointer
    if key not in textures.made:
        shown = [info if name is not None else None for info, name in zip(infos, names, strict=True)]
        textures.made[key] = [textures.store(_image(textures, shown, numbers), used[-1][0].pointer)]
    made = textures.add(textures.made[key][0], settings[-1], textures.file.follow(used[-1][0], "index", "textures"))
    return {"texture": made, "factor": max(numbers[1:])}


def _image(textures: Textures, infos: list[JsonView | None], numbers: tuple[float, float, float]) -> bytes:
    weight, least, most = numbers
    found = [pixels(textures, info) for info in infos]
    size = tuple(min(max(image.size[axis] for image in found if image), LARGEST) for axis in (0, 1))
    resized = [None if image is None else np.asarray(image.resize(size)) for image in found]
    shares = np.arange(256, dtype=np.float32) / 255
    bytes_of = np.rint(255 * (least + (most - least) * shares) / max(least, most)).astype(np.uint8)
    covered = (weight * shares >= HALF).astype(np.uint8)
    mask, thickness = resized
    texels = np.full(size[::-1], bytes_of[255], np.uint8) if thickness is None else bytes_of[thickness[..., 1]]
    return png(texels if mask is None else texels * covered[mask[..., 0]])
