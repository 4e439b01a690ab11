"""Textures that hold numbers in a row: texels of images, coordinates of triangles; and those that scenes share."""

from __future__ import annotations

from typing import Any

import numpy as np

from gpu import context as contexts
from gpu.arrays import SceneArrays
from gpu.layout import bindings

BYTES = {"f1": 1, "f2": 2, "f4": 4, "u4": 4}
KINDS = {  # channels and dtype, by texture unit
    bindings.UVS_TEXTURES[0]: (2, "f4"),
    bindings.UVS_TEXTURES[1]: (2, "f4"),
    bindings.COLORS_TEXTURE: (4, "f2"),
    bindings.BYTES_TEXTURE: (4, "f1"),
    bindings.FLOATS_TEXTURE: (4, "f4"),
    bindings.LIGHT_TREE_TEXTURE: (4, "u4"),
    bindings.INSTANCES_TEXTURE: (4, "u4"),
    bindings.MICROFACETS_TEXTURE: (4, "u4"),
    bindings.MEASURED_TEXTURE: (4, "u4"),
    bindings.SPACES_TEXTURE: (4, "u4"),
    bindings.BODIES_TEXTURE: (4, "u4"),
}
IMAGE_UNITS = {bindings.BYTES_TEXTURE, bindings.FLOATS_TEXTURE}


def bound_textures(arrays: SceneArrays, flags: frozenset[str]) -> dict[int, np.ndarray]:
    """The values behind each texture unit that kernels with these flags read, where the scene has any: the triangles'
    corners, instances, spaces and bodies of shapes, records and tables of models, the lights' tree, images.

    KINDS has their formats.
    """
    colors = arrays.corner_colors if "HAS_VERTEX_COLORS" in flags else arrays.triangle_colors
    values = {
        bindings.UVS_TEXTURES[0]: arrays.triangle_uvs,
        bindings.UVS_TEXTURES[1]: arrays.triangle_uvs_1,
        bindings.COLORS_TEXTURE: colors,
        bindings.INSTANCES_TEXTURE: arrays.instances,
        bindings.MICROFACETS_TEXTURE: arrays.microfacets,
        bindings.MEASURED_TEXTURE: arrays.measured,
        bindings.SPACES_TEXTURE: arrays.spaces,
        bindings.BODIES_TEXTURE: arrays.bodies,
    }
    if arrays.textures is not None:
        values[bindings.BYTES_TEXTURE] = arrays.textures.texels
        values[bindings.FLOATS_TEXTURE] = arrays.textures.floats
    if "HAS_LIGHT_TREE" in flags:
        values[bindings.LIGHT_TREE_TEXTURE] = arrays.light_words
    return {unit: each for unit, each in values.items() if len(each)}


def rows(size: int, channels: int, dtype: str) -> int:
    """The height of the texture of `linear_texture` for that many bytes.

    Of records ("u4") it is a power of two: llvmpipe compiles a kernel anew where a height becomes or ceases to be
    one, and the number of records may change with an edit.
    """
    height = -(-size // (bindings.TEXELS_A_ROW * channels * BYTES[dtype]))
    return 1 << max(height - 1, 0).bit_length() if dtype == "u4" else height


def linear_texture(context: Any, values: np.ndarray, channels: int, dtype: str) -> Any:
    """A texture of `bindings.TEXELS_A_ROW` texels a row, in the order of `values`; the rest of it is undefined."""
    flat = np.ascontiguousarray(values).reshape(-1).view(np.uint8)
    pitch = bindings.TEXELS_A_ROW * channels * BYTES[dtype]
    height, rest = divmod(len(flat), pitch)
    size = (bindings.TEXELS_A_ROW, rows(len(flat), channels, dtype))
    texture = contexts.texture(context, size, channels, dtype)
    if height:
        texture.write(flat[: height * pitch], viewport=(0, 0, bindings.TEXELS_A_ROW, height))
    if rest:
        last = np.zeros(pitch, np.uint8)
        last[:rest] = flat[height * pitch :]
        texture.write(last, viewport=(0, height, bindings.TEXELS_A_ROW, 1))
    texture.filter = (context.NEAREST, context.NEAREST)
    return texture


def update_range(texture: Any, values: np.ndarray, part: slice) -> int:
    """Write a part of the values that `linear_texture` made a texture of: 32-bit numbers, four to a texel.

    Returns the bytes written."""
    words = np.ascontiguousarray(values[part]).view(np.uint32).reshape(-1, 4)
    texel = part.start * (values.itemsize // 16)
    sent = words.nbytes
    while len(words):
        x, y = texel % bindings.TEXELS_A_ROW, texel // bindings.TEXELS_A_ROW
        count = min(len(words), bindings.TEXELS_A_ROW - x)
        texture.write(np.ascontiguousarray(words[:count]), viewport=(x, y, count, 1))
        words, texel = words[count:], texel + count
    return sent


def placeholder(context: Any, unit: int) -> Any:
    """A texture of one texel, for a unit that needs some texture to be bound."""
    channels, dtype = KINDS[unit]
    texture = context.texture((1, 1), channels, bytes(channels * BYTES[dtype]), alignment=1, dtype=dtype)
    texture.filter = (context.NEAREST, context.NEAREST)
    return texture
