"""Media that fill shapes, as GLSL: records in a texture, that of what is outside first."""

from __future__ import annotations

from gpu.kernels.words_glsl import fetched, unpacked
from gpu.layout import Body, bindings


def text() -> str:
    """The struct and its loader: 0 is what is outside, 1 + i the shape i of the document."""
    members = " ".join(f"{kind.glsl} {name};" for name, kind in Body.members.items())
    return f"""#if HAS_MEDIA
struct Body {{ {members} }};
layout(binding = {bindings.BODIES_TEXTURE}) uniform usampler2D body_texels;
Body body_load(uint i) {{
{fetched("body_texels", Body)}
    return Body({unpacked(Body, 4)});
}}
#endif"""
