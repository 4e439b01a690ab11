"""The bytes of textures as materials use them, and which numbers of a material they may give.

`records` declares the rest. Slots and uses follow each material's own numbers in the same buffer.
"""

from __future__ import annotations

import enum
import math

from gpu.layout.record import Record, f32, u32, vec3, vec4

# How an image wraps along u, and SLOT_V_SHIFT bits further along v; with neither it repeats.
SLOT_CLAMP, SLOT_MIRROR, SLOT_V_SHIFT = 1, 2, 2
SLOT_WRAPS = SLOT_CLAMP | SLOT_MIRROR
SLOT_SRGB, SLOT_FLOATS, SLOT_CHECKER, SLOT_UV_1 = (1 << i for i in range(4, 8))
SLOT_NORMALS, SLOT_LEVELS = 1 << 19, 1 << 20  # an image of normals, and one with mip levels
# Of slots that have a recipe: noise, solid or not, with creases or not; coordinates as colours; and a ramp over these
# or over an image or a checker. The number of the recipe, that of the slot, stands above them.
SLOT_NOISE, SLOT_SOLID, SLOT_TURBULENCE, SLOT_COORDINATES = (1 << i for i in range(8, 12))
SLOT_RAMP, SLOT_RAMP_CONSTANT, SLOT_RAMP_SMOOTH, SLOT_RAMP_REPEAT, SLOT_RAMP_MIRROR = (1 << i for i in range(12, 17))
# Coordinates by the shape's own space: by the side of a box that the surface faces, or all round a ball.
SLOT_PROJECTED, SLOT_ROUND = 1 << 17, 1 << 18
SLOT_NUMBER_SHIFT = 24
SLOT_MADE = SLOT_NOISE | SLOT_COORDINATES | SLOT_RAMP  # a slot with one of these has a recipe
CHANNEL_NONE, CHANNEL_COLOR, CHANNEL_R = 0, 1, 2  # then g, b and a

# The numbers of a material that a texture may give, with their ranges: those that a surface is made from, which are
# read together with the normals, and those that are read elsewhere along a path.
UNIT, LARGE = (0.0, 1.0), (0.0, 1e20)
SURFACE_RANGES: dict[str, tuple[float, float]] = {
    name: UNIT
    for name in (
        "base_color", "roughness", "metallic", "subsurface", "specular", "specular_tint", "anisotropic", "sheen",
        "sheen_tint", "clearcoat", "clearcoat_gloss", "sheen_roughness", "phong_specular", "transmission",
        "attenuation_color", "specular_color", "clearcoat_roughness", "sheen_color", "coat_color", "base_weight",
        "diffuse_roughness", "coat_darkening", "coat_anisotropy",
        "diffuse_transmission", "diffuse_transmission_color", "film_weight", "subsurface_color",
    )
} | {
    "shininess": LARGE,
    "attenuation_distance": (1e-45, 1e9),
    "anisotropic_rotation": (-1e9, 1e9),
    "ior": (1.0, 4.0),
    "coat_ior": (1.0, 4.0),
    "film_ior": (1.0, 4.0),
    "film_thickness": (0.0, 1e4),
    "alpha": LARGE,  # what the distribution allows comes later, in bsdf/models/microfacet.glsl
}  # fmt: skip
NORMALS = ("normal", "coat_normal")
HEIGHT = "height"  # whose slopes bend both normals; sampled around a point, and not together with the others
OTHER_RANGES = {"emission": LARGE, "opacity": UNIT, "cutoff": UNIT, "ambient": LARGE}
TEXTURABLE = {**SURFACE_RANGES, **OTHER_RANGES}


class Texels(enum.Enum):
    """The meaning of an image's numbers."""

    LINEAR = enum.auto()
    SRGB = enum.auto()  # bytes whose colours are decoded; alpha is linear
    NORMALS = enum.auto()


class TextureSlot(Record):
    """A texture as one material uses it. uv' = turn (u, v) + offset."""

    first: u32  # its first texel among those of its kind
    width: u32
    height: u32
    flags: u32  # SLOT_*
    turn: vec4  # 2 x 2, row by row
    color_a: vec3  # of a checker or a noise; x and y of an image with mip levels are its `level_powers`
    offset_u: f32
    color_b: vec3
    offset_v: f32


class TextureUse(Record):
    """How a texel becomes a member of a material: that channel (or all three), times the factor."""

    factor: vec3  # of a normal map x is its strength, of a height metres
    channel: u32  # CHANNEL_*


class TextureRecipe(Record):
    """How a slot's texel is computed. The ramp's stops follow, four words each: position, colour."""

    scale: vec3  # of a noise, cells a metre or a unit of u and v
    octaves: u32
    offset: vec3
    seed: u32
    lacunarity: f32
    gain: f32
    amplitude: f32  # factor on the sum of the octaves
    ramp_offset: f32
    ramp_reads: vec4  # factors on the channels that the ramp reads


def level_powers(width: int, height: int) -> tuple[int, int]:
    """The logarithms of the powers of two nearest to an image's sides, as ratios."""
    return round(math.log2(width)), round(math.log2(height))


def level_sizes(width: int, height: int) -> list[tuple[int, int]]:
    """(width, height) of each mip level, from the first one below the image down to a single texel. They stand one
    after another behind the image; shaders compute where."""
    across, down = level_powers(width, height)
    return [(1 << max(across - k, 0), 1 << max(down - k, 0)) for k in range(1, max(across, down) + 1)]


def level_texels(width: int, height: int) -> int:
    """The texels of all mip levels: 1 / 3 of its own where its sides are powers of two, else up to 2 / 3."""
    return sum(w * h for w, h in level_sizes(width, height))
