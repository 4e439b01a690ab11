"""Textures that are computed: their recipes as words, and the colours that they can have."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from gpu.layout import texture_records
from gpu.layout.texture_records import TextureRecipe
from service.document.procedural import NoiseTexture, RampInput, RampTexture
from service.document.texture import CheckerTexture
from service.pack.textures.uses import TextureReference

EVEN = 65  # places along a ramp at which its colours are counted


def room_for_stops(uses: list[TextureReference]) -> int | None:
    """The number of stops that each recipe has room for; a power of two, so that few numbers need kernels of their
    own. None where no use has a recipe."""
    if not any(use.ramp is not None or isinstance(use.texture, NoiseTexture) for use in uses):
        return None
    most = max((len(use.ramp.stops) for use in uses if use.ramp is not None), default=0)
    return most and 1 << (most - 1).bit_length()


def recipe_flags(use: TextureReference, slot: int) -> int:
    """The bits of a slot that has a recipe; 0 where it has none."""
    flags, r = 0, texture_records
    if isinstance(use.texture, NoiseTexture):
        flags |= r.SLOT_NOISE
        flags |= r.SLOT_SOLID if use.texture.space == "object" else 0
        flags |= r.SLOT_TURBULENCE if use.texture.turbulence else 0
    if use.texture is None:
        flags |= r.SLOT_COORDINATES
    if use.ramp is not None:
        flags |= r.SLOT_RAMP
        flags |= {"linear": 0, "constant": r.SLOT_RAMP_CONSTANT, "smooth": r.SLOT_RAMP_SMOOTH}[use.ramp.interpolation]
        flags |= {"clamp": 0, "repeat": r.SLOT_RAMP_REPEAT, "mirror": r.SLOT_RAMP_MIRROR}[use.ramp.wrap]
    return flags and flags | slot << r.SLOT_NUMBER_SHIFT


def recipe_words(use: TextureReference, stops: int) -> np.ndarray:
    """A `TextureRecipe` and its stops as words."""
    recipe = np.zeros((), TextureRecipe.dtype)
    noise, ramp = use.texture, use.ramp
    if isinstance(noise, NoiseTexture):
        for name in ("scale", "offset", "octaves", "seed", "lacunarity", "gain"):
            recipe[name] = getattr(noise, name)
        recipe["amplitude"] = noise.contrast / sum(noise.gain**i for i in range(noise.octaves))
    placed = np.zeros((stops, 4), np.float32)
    if ramp is not None:
        recipe["ramp_offset"] = ramp.offset
        recipe["ramp_reads"][channel_of(ramp)] = ramp.scale
        rows = [(stop.position, *stop.color) for stop in ramp.sorted_stops]
        placed[:] = rows + rows[-1:] * (stops - len(rows))
    return np.concatenate([recipe.reshape(1).view(np.uint32), placed.reshape(-1).view(np.uint32)])


def channel_of(ramp: RampTexture) -> int:
    """The channel of the texel that the ramp reads: that of coordinates has u in red and v in green."""
    return "rgba".index(ramp.input.channel) if isinstance(ramp.input, RampInput) else "uv".index(ramp.input)


def ramp_colors(ramp: RampTexture, t: np.ndarray) -> np.ndarray:
    """(n, 3): its colours at places (n,) from 0 to 1."""
    placed = ramp.sorted_stops
    out = np.tile(np.array(placed[0].color), (len(t), 1))
    for last, stop in pairwise(placed):
        width, passed = stop.position - last.position, (t >= stop.position).astype(float)
        w = np.clip((t - last.position) / width, 0, 1) if width > 0 else passed
        if ramp.interpolation == "smooth":
            w = w * w * (3 - 2 * w)
        if ramp.interpolation == "constant":
            w = passed
        out += w[:, None] * (np.array(stop.color) - out)
    return out


def listed(use: TextureReference) -> np.ndarray | None:
    """(1, n, 3) float32: colours of a texture that is computed, its extremes among them; None of an image."""
    if use.ramp is not None:
        even = ramp_colors(use.ramp, np.linspace(0, 1, EVEN))
        return np.concatenate([even, [stop.color for stop in use.ramp.stops]]).astype(np.float32)[None]
    if isinstance(use.texture, CheckerTexture | NoiseTexture):
        return np.array([[use.texture.a, use.texture.b]], np.float32)
    return None
