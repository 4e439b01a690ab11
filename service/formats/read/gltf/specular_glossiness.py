"""KHR_materials_pbrSpecularGlossiness as metal and roughness, texel by texel where there are textures.

The extension's own conversion: metallic solves for the brightness of the diffuse and the specular colour together,
where a dielectric reflects 4 % head-on.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from service.colorimetry import decode_srgb, encode_srgb
from service.formats.read.gltf.json_view import JsonView
from service.formats.read.gltf.material_reader import MaterialReader
from service.formats.read.gltf.texture_bake import pixels, png
from service.formats.types import Floats

F0 = 0.04
LARGEST = 4096  # texels a side of a computed image
CHUNK = 1 << 18  # texels at once: float copies of a whole image take gigabytes


def converted(read: MaterialReader, place: JsonView) -> dict[str, Any]:
    """Colour, metallic and roughness."""
    diffuse = read.share(place, "diffuseFactor", (1.0,) * 4)
    specular = read.share(place, "specularFactor", (1.0, 1.0, 1.0))
    glossiness = place.number("glossinessFactor", 1, 0, 1)
    textured = _textured(read, place, (diffuse[:3], specular, glossiness))
    if textured:
        return textured
    base, metal = metallic_roughness(np.array([diffuse[:3]], np.float32), np.array([specular], np.float32))
    return {
        "base_color": tuple(base[0].tolist()),
        "metallic": float(metal[0]),
        "roughness": 1 - glossiness,
    }


def metallic_roughness(diffuse: Floats, specular: Floats) -> tuple[Floats, Floats]:
    """(base colour (n, 3), metallic (n,)) of linear colours (n, 3)."""
    one_minus = 1 - specular.max(axis=1)
    d, s = _brightness(diffuse), _brightness(specular)
    # F0 m^2 + b m + c = 0 says that both models reflect the same amount of light [the extension's appendix].
    b = d * one_minus / (1 - F0) + s - 2 * F0
    c = F0 - s
    root = np.sqrt(np.maximum(b * b - 4 * F0 * c, 0))
    metallic = np.where(s < F0, 0, np.clip((root - b) / (2 * F0), 0, 1))[:, None]
    matte = diffuse * (one_minus / (1 - F0) / np.maximum(1 - metallic[:, 0], 1e-6))[:, None]
    shiny = (specular - F0 * (1 - metallic)) / np.maximum(metallic, 1e-6)
    share = metallic * metallic
    base = np.clip(matte * (1 - share) + shiny * share, 0, 1)
    return base.astype(np.float32), metallic[:, 0].astype(np.float32)


def _brightness(color: Floats) -> Floats:
    """Perceived [the extension's appendix]."""
    squares: Floats = np.sqrt(color**2 @ np.array([0.299, 0.587, 0.114], np.float32))
    return squares


def _textured(read: MaterialReader, place: JsonView, factors: tuple[Any, Any, float]) -> dict[str, Any]:
    """Two images that take the place of the file's: colour with alpha, and metallic (blue) with roughness."""
    textures = read.textures
    names = ("diffuseTexture", "specularGlossinessTexture")
    infos = [info for info in (place.object(name) for name in names) if info]
    placings = [textures.documents[name] for info in infos if (name := textures.use(info, "srgb", read.charts))]
    if not placings:
        return {}
    placing = [{k: p.get(k) for k in ("uv", "scale", "offset", "rotation", "wrap")} for p in placings]
    if placing[0] != placing[-1]:
        read.notes.add(
            infos[1].pointer, "this texture is transformed like the diffuse texture, because the two are merged"
        )
    settings = {name: value for name, value in placings[0].items() if name not in ("asset", "color_space")}
    key = "specular glossiness", place.pointer
    if key not in textures.made:
        textures.made[key] = [textures.store(data, place.pointer) for data in _bake(read, place, factors)]
    texture = textures.file.follow(infos[0], "index", "textures")
    color, rough = textures.made[key]
    one = textures.add(color, {**settings, "color_space": "srgb"}, texture)
    two = textures.add(rough, {**settings, "color_space": "linear"}, texture)
    return {
        "base_color": {"texture": one},
        "metallic": {"texture": two, "channel": "b"},
        "roughness": {"texture": two, "channel": "g"},
    }


def _bake(read: MaterialReader, place: JsonView, factors: tuple[Any, Any, float]) -> list[bytes]:
    from PIL import Image

    found = [pixels(read.textures, place.object(name)) for name in ("diffuseTexture", "specularGlossinessTexture")]
    width = min(max(image.width for image in found if image), LARGEST)
    height = min(max(image.height for image in found if image), LARGEST)
    white = Image.new("RGBA", (1, 1), (255, 255, 255, 255))
    first, second = (np.asarray((image or white).resize((width, height))).reshape(-1, 4) for image in found)
    made = np.empty((2, width * height, 4), np.uint8)
    diffuse, specular, glossiness = factors
    decode = decode_srgb(np.arange(256) / 255).astype(np.float32)
    for at in range(0, width * height, CHUNK):
        a, b = first[at : at + CHUNK], second[at : at + CHUNK]
        base, metallic = metallic_roughness(
            decode[a[:, :3]] * np.float32(diffuse[:3]), decode[b[:, :3]] * np.float32(specular)
        )
        rough = 1 - b[:, 3] / 255 * glossiness
        made[0, at : at + CHUNK, :3] = (encode_srgb(base) * 255).round()
        made[0, at : at + CHUNK, 3] = a[:, 3]
        made[1, at : at + CHUNK] = (np.stack([0 * rough, rough, metallic, 0 * rough], axis=1) * 255).round()
    shaped = made.reshape(2, height, width, 4)
    return [png(shaped[0]), png(shaped[1, :, :, :3])]
