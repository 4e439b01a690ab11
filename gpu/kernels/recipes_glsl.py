"""The recipes of textures that are computed, as GLSL, and the spaces of shapes, in which solid ones and
projections lie."""

from __future__ import annotations

from gpu.arrays import TextureArrays
from gpu.kernels.words_glsl import fetched, unpacked
from gpu.layout import ShapeSpace, bindings, texture_records
from gpu.layout.record import Record
from gpu.layout.texture_records import TextureRecipe, TextureSlot

RECIPE_GROUPS = TextureRecipe.words // 4


def groups(textures: TextureArrays) -> int:
    """The number of groups of four words of each slot's recipe."""
    return 0 if textures.stops is None else RECIPE_GROUPS + textures.stops


def defines(textures: TextureArrays | None, first: int) -> dict[str, object]:
    """`first` is the group, among those of each material, with which the recipes begin."""
    has_recipes = textures is not None and textures.stops is not None
    return {
        "TEXTURE_RECIPE_FIRST": f"{first if has_recipes else 0}u",
        "TEXTURE_STOPS": textures.stops if textures is not None and has_recipes else 0,
        "TEXTURE_MADE_SLOTS": f"{_made(textures) if textures is not None and has_recipes else 0}u",
    }


def _made(textures: TextureArrays) -> int:
    """The slots that have a recipe in some material, as bits."""
    count = max(textures.slots.values(), default=-1) + 1
    at = [k * TextureSlot.words + TextureSlot.offsets["flags"] for k in range(count)]
    return sum(1 << k for k, i in enumerate(at) if (textures.words[:, i] & texture_records.SLOT_MADE).any())


def _struct(record: type[Record]) -> str:
    return f"struct {record.__name__} {{ {' '.join(f'{k.glsl} {n};' for n, k in record.members.items())} }};"


def text() -> str:
    """The structs and their loaders."""
    words = "\n".join(f"    uvec4 w{j} = material_words[first + {j}u];" for j in range(RECIPE_GROUPS))
    return f"""#if HAS_NOISES || HAS_RAMPS
{_struct(TextureRecipe)}
uint texture_recipe_first(uint i, uint k) {{
    return i * MATERIAL_GROUPS + TEXTURE_RECIPE_FIRST + ({RECIPE_GROUPS}u + uint(TEXTURE_STOPS)) * k;
}}
TextureRecipe texture_recipe_load(uint i, uint k) {{
    uint first = texture_recipe_first(i, k);
{words}
    return TextureRecipe({unpacked(TextureRecipe, 4)});
}}
// A stop of the ramp: its position and its colour.
vec4 texture_stop_load(uint i, uint k, uint stop) {{
    return uintBitsToFloat(material_words[texture_recipe_first(i, k) + {RECIPE_GROUPS}u + stop]);
}}
#endif
#if HAS_SOLID_TEXTURES || HAS_PROJECTIONS
{_struct(ShapeSpace)}
layout(binding = {bindings.SPACES_TEXTURE}) uniform usampler2D space_texels;
ShapeSpace shape_space_load(uint i) {{
{fetched("space_texels", ShapeSpace)}
    return ShapeSpace({unpacked(ShapeSpace, 4)});
}}
#endif"""
