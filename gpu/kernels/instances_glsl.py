"""Records of instances as GLSL, all of it guarded by HAS_INSTANCES: a texture's texels, nine to a record."""

from __future__ import annotations

from gpu import layout
from gpu.kernels.words_glsl import fetched, unpacked
from gpu.layout import Instance, ShapeKind, bindings

UNIFORMS = ("node_first", "instance_shift")  # the last members of `layout.Uniforms`, which only these kernels have


def text() -> str:
    """The struct, its loader, and the number of an instance in the id of a hit."""
    members = " ".join(f"{kind.glsl} {name};" for name, kind in Instance.members.items())
    return f"""#if HAS_INSTANCES
const uint SHAPE_INSTANCE = {int(ShapeKind.INSTANCE)}u;
const uint INSTANCED = {layout.INSTANCED}u;
struct Instance {{ {members} }};
layout(binding = {bindings.INSTANCES_TEXTURE}) uniform usampler2D instance_texels;
Instance instance_load(uint i) {{
{fetched("instance_texels", Instance)}
    return Instance({unpacked(Instance, 4)});
}}
#endif"""
