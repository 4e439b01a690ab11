"""How materials read textures, as GLSL: their slots and uses, and which member of a material gets which texel.

A kernel knows by its defines which members are textured in its scene: for each one TEXTURE_MEMBER, the slot that its
texel comes from, or -1, and TEXTURE_MEMBER_USE, its place among the uses. Slots and uses follow each material's own
numbers in the same buffer, so that they arrive the same way: at constant places where materials are few.
"""

from __future__ import annotations

import numpy as np

from gpu import layout
from gpu.arrays import TextureArrays
from gpu.kernels import recipes_glsl
from gpu.kernels.words_glsl import unpacked
from gpu.layout import bindings, texture_records
from gpu.layout.record import Record
from gpu.layout.texture_records import TextureSlot, TextureUse

BASE = layout.Material.words // 4  # groups of four words of a material without textures
SLOT_GROUPS, USE_GROUPS = TextureSlot.words // 4, TextureUse.words // 4
ALL = (*texture_records.TEXTURABLE, *texture_records.NORMALS, texture_records.HEIGHT)
APART = (*texture_records.OTHER_RANGES, texture_records.HEIGHT)  # not sampled with what a surface is made from
OF_BODIES = ("attenuation_color", "attenuation_distance", "ior", "specular")  # what gives rates and an index
POINTWISE = ("opacity", "cutoff", texture_records.HEIGHT)  # looked up at single points


def records(textures: TextureArrays) -> tuple[np.ndarray, np.ndarray]:
    """The slots (materials, k) and the uses (materials, members) of a scene's materials."""
    first = (max(textures.slots.values(), default=-1) + 1) * TextureSlot.words
    last = first + len(textures.slots) * TextureUse.words
    slots, uses = textures.words[:, :first], textures.words[:, first:last]
    slots, uses = np.ascontiguousarray(slots), np.ascontiguousarray(uses)
    return slots.view(TextureSlot.dtype), uses.view(TextureUse.dtype)


def defines(textures: TextureArrays | None) -> dict[str, object]:
    """The defines of a scene with these textures."""
    slots = {} if textures is None else textures.slots
    count = max(slots.values(), default=-1) + 1
    out: dict[str, object] = {f"TEXTURE_{name.upper()}": slots.get(name, -1) for name in ALL}
    out |= {f"TEXTURE_{name.upper()}_USE": f"{i}u" for i, name in enumerate(slots)}
    surface = [slot for name, slot in slots.items() if name not in APART]
    out["ANY_FOOTPRINTS"] = int(any(name not in POINTWISE for name in slots))
    flags = np.bitwise_or.reduce(records(textures)[0]["flags"], axis=None) if textures is not None and slots else 0
    wraps = flags | flags >> texture_records.SLOT_V_SHIFT
    out["ANY_CLAMPED"] = int(wraps & texture_records.SLOT_CLAMP > 0)
    out["ANY_MIRRORED"] = int(wraps & texture_records.SLOT_MIRROR > 0)
    out["BODIES_TEXTURED"] = int(any(name in slots for name in OF_BODIES))
    out["TEXTURE_SLOTS"] = count
    out["TEXTURE_SURFACE_SLOTS"] = out["TEXTURE_SURFACE_LOOP"] = max(surface, default=-1) + 1
    out["MATERIAL_GROUPS"] = f"{BASE + groups(textures)}u"
    out["TEXTURE_OPACITY_IN_ALPHA"] = int(textures is not None and _opacity_is_in_alpha(textures))
    return out | recipes_glsl.defines(textures, BASE + count * SLOT_GROUPS + len(slots) * USE_GROUPS)


def _opacity_is_in_alpha(textures: TextureArrays) -> bool:
    """True if no material takes its opacity from another channel than alpha."""
    if "opacity" not in textures.slots:
        return False
    channels = records(textures)[1]["channel"][:, list(textures.slots).index("opacity")]
    return bool(np.isin(channels, (texture_records.CHANNEL_NONE, texture_records.CHANNEL_R + 3)).all())


def groups(textures: TextureArrays | None) -> int:
    """The number of groups of four words that follow each material."""
    if textures is None:
        return 0
    count = max(textures.slots.values(), default=-1) + 1
    return count * (SLOT_GROUPS + recipes_glsl.groups(textures)) + len(textures.slots) * USE_GROUPS


def _reader(record: type[Record], name: str, first: str, size: int) -> str:
    """`NAME_load(i, k)`, the k-th record of material i, and `NAME_pick(i, k)`, which needs no varying index where
    there are few materials."""
    words = "\n".join(
        f"    uvec4 w{j} = material_words[i * MATERIAL_GROUPS + {first} + {size}u * k + {j}u];" for j in range(size)
    )
    return f"""{record.__name__} {name}_load(uint i, uint k) {{
{words}
    return {record.__name__}({unpacked(record, 4)});
}}
{record.__name__} {name}_pick(uint i, uint k) {{
#if MATERIAL_COUNT == 0 || MATERIAL_COUNT > PICK_MAX
    return {name}_load(i, k);
#else
    {record.__name__} r = {name}_load(0u, k);
    for (uint j = 1u; j < uint(MATERIAL_COUNT); j++) {{
        {record.__name__} other = {name}_load(j, k);
        if (i == j) r = other;
    }}
    return r;
#endif
}}"""


def _use(name: str, low: float, high: float, texel: str, target: str) -> str:
    kind = layout.Material.members[name].glsl
    flag = f"TEXTURE_{name.upper()}"
    return f"""#if {flag} >= 0
    texture_use_{kind}(texture_use_pick(i, {flag}_USE), {texel.format(flag)}, {low!r}, {high!r}, {target});
#endif"""


def text() -> str:
    """Structs and functions, all of it guarded by HAS_TEXTURES."""
    surface = "\n".join(
        _use(name, *bounds, "texels[{}]", f"m.{name}") for name, bounds in texture_records.SURFACE_RANGES.items()
    )
    others = "\n".join(
        f"void texture_use_{name}(uint i, vec4 texel, inout {layout.Material.members[name].glsl} x) {{\n"
        f"{_use(name, *bounds, 'texel', 'x')}\n}}"
        for name, bounds in texture_records.OTHER_RANGES.items()
    )
    structs = "\n".join(
        f"struct {r.__name__} {{ {' '.join(f'{k.glsl} {n};' for n, k in r.members.items())} }};"
        for r in (TextureSlot, TextureUse)
    )
    names = [n for n in vars(texture_records) if n.startswith(("SLOT_", "CHANNEL_"))]
    constants = "\n".join(f"const uint TEXTURE_{n} = {getattr(texture_records, n)}u;" for n in names)
    units = {
        "BYTES": bindings.BYTES_TEXTURE,
        "FLOATS": bindings.FLOATS_TEXTURE,
        "UVS": bindings.UVS_TEXTURES[0],
        "UVS_1": bindings.UVS_TEXTURES[1],
        "COLORS": bindings.COLORS_TEXTURE,
    }
    defined = "\n".join(f"#define TEXTURE_{name}_UNIT {unit}" for name, unit in units.items())
    return f"""#if HAS_TEXTURES
{defined}
{constants}
const uint TEXTURE_ROW = {bindings.TEXELS_A_ROW}u;
{structs}
{_reader(TextureSlot, "texture_slot", f"{BASE}u", SLOT_GROUPS)}
{_reader(TextureUse, "texture_use", f"{BASE}u + {SLOT_GROUPS}u * uint(TEXTURE_SLOTS)", USE_GROUPS)}

void texture_use_float(TextureUse use, vec4 texel, float low, float high, inout float x) {{
    vec4 one = mix(vec4(0.0), vec4(1.0), equal(uvec4(use.channel), TEXTURE_CHANNEL_R + uvec4(0u, 1u, 2u, 3u)));
    if (use.channel != TEXTURE_CHANNEL_NONE) x = clamp(dot(texel, one) * use.factor.x, low, high);
}}

void texture_use_vec3(TextureUse use, vec4 texel, float low, float high, inout vec3 x) {{
    vec4 one = mix(vec4(0.0), vec4(1.0), equal(uvec4(use.channel), TEXTURE_CHANNEL_R + uvec4(0u, 1u, 2u, 3u)));
    vec3 c = use.channel == TEXTURE_CHANNEL_COLOR ? texel.rgb : vec3(dot(texel, one));
    if (use.channel != TEXTURE_CHANNEL_NONE) x = clamp(c * use.factor, low, high);
}}

// The members that a surface is made from, given the texels of its slots.
void texture_members(uint i, vec4 texels[max(TEXTURE_SURFACE_SLOTS, 1)], inout Material m) {{
{surface}
}}

{others}
#endif
{recipes_glsl.text()}
"""
