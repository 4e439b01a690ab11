"""Records and tables of the model `measured` as GLSL: a texture's texels, all guarded by HAS_MEASURED."""

from __future__ import annotations

from gpu.kernels.words_glsl import unpacked
from gpu.layout import bindings
from gpu.layout.measured_records import COLUMNS_BITS, HALF_DIFFERENCE_SHAPE, LIMIT_ANGLES, Measured, MeasuredKind

GROUPS = Measured.words // 4


def text() -> str:
    """The struct, its loader, and `measured_words(i)`, any texel as four words."""
    members = " ".join(f"{kind.glsl} {name};" for name, kind in Measured.members.items())
    words = "\n".join(f"    uvec4 w{k} = measured_words(i * {GROUPS}u + {k}u);" for k in range(GROUPS))
    kinds = "\n".join(f"const uint MEASURED_{kind.name} = {int(kind)}u;" for kind in MeasuredKind)
    h, d, p = HALF_DIFFERENCE_SHAPE
    return f"""#if HAS_MEASURED
{kinds}
const uint MEASURED_LIMIT_ANGLES = {LIMIT_ANGLES}u;
const uvec3 MEASURED_SHAPE = uvec3({h}u, {d}u, {p}u);
struct Measured {{ {members} }};
layout(binding = {bindings.MEASURED_TEXTURE}) uniform usampler2D measured_texels;
uvec4 measured_words(uint i) {{
    return texelFetch(measured_texels, ivec2(i & {bindings.TEXELS_A_ROW - 1}u, i / {bindings.TEXELS_A_ROW}u), 0);
}}
vec4 measured_texel(uint i) {{ return uintBitsToFloat(measured_words(i)); }}
uvec2 measured_size(uint size) {{ return uvec2(size & {(1 << COLUMNS_BITS) - 1}u, size >> {COLUMNS_BITS}u); }}
Measured measured_load(uint i) {{
{words}
    return Measured({unpacked(Measured, 4)});
}}
#endif"""
