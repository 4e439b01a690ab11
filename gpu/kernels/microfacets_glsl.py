"""Parameters and tables of the model `microfacet` as GLSL: a texture's texels, all guarded by HAS_MICROFACET."""

from __future__ import annotations

from gpu.kernels.words_glsl import unpacked
from gpu.layout import bindings
from gpu.layout.microfacet_records import TERMS, Microfacet
from gpu.tables import microfacet

GROUPS = Microfacet.words // 4


def text() -> str:
    """The names of the terms, the struct, its loader, and `microfacet_texel(i)`, any texel as four floats."""
    members = " ".join(f"{kind.glsl} {name};" for name, kind in Microfacet.members.items())
    words = "\n".join(f"    uvec4 w{k} = microfacet_words(i * {GROUPS}u + {k}u);" for k in range(GROUPS))
    terms = "\n".join(
        f"const uint {kind.upper()}_{e.name} = {int(e)}u;" for kind, terms in TERMS.items() for e in terms
    )
    return f"""#if HAS_MICROFACET
{terms}
const uint MICROFACET_INTERVALS = {microfacet.INTERVALS}u;
struct Microfacet {{ {members} }};
layout(binding = {bindings.MICROFACETS_TEXTURE}) uniform usampler2D microfacet_texels;
uvec4 microfacet_words(uint i) {{
    return texelFetch(microfacet_texels, ivec2(i & {bindings.TEXELS_A_ROW - 1}u, i / {bindings.TEXELS_A_ROW}u), 0);
}}
vec4 microfacet_texel(uint i) {{ return uintBitsToFloat(microfacet_words(i)); }}
Microfacet microfacet_load(uint i) {{
{words}
    return Microfacet({unpacked(Microfacet, 4)});
}}
#endif"""
