"""Records as GLSL: structs, buffers with their loaders, constants. Shaders include it as `layout.glsl`."""

from __future__ import annotations

from gpu import energy, glsl_textures, layout
from gpu.layout import Frame, LightKind, Model, Record, ShapeKind, Slot


def _struct(record: type[Record]) -> str:
    body = " ".join(f"{k.glsl} {name};" for name, k in record.members.items())
    return f"struct {record.__name__} {{ {body} }};"


def _loader(name: str, record: type[Record], slot: Slot) -> str:
    """The buffer of a record and its `NAME_load(i)`.

    A buffer of which kernels know the count is a uniform block: llvmpipe loads those once for all lanes where the
    index is constant, as in unrolled loops, and storage buffers lane by lane wherever control flow has diverged.
    """
    group = 4 if record.words % 4 == 0 else 2
    groups = record.words // group
    stride = "MATERIAL_GROUPS" if name == "material" else f"{groups}u"  # textures follow a material's numbers
    storage = (
        f"layout(std430, binding = {int(slot)}) readonly buffer {name}_buffer {{ uvec{group} {name}_words[]; }};"
    )
    lines = [storage]
    if name in layout.COUNTED:
        count = f"{name.upper()}_COUNT"
        block = f"layout(std140, binding = {layout.COUNTED[name]}) uniform {name}_block"
        lines = [
            f"#if {count} > 0",
            f"{block} {{ uvec4 {name}_words[{count} * {stride}]; }};",
            "#else",
            storage,
            "#endif",
        ]
    lines.append(f"{record.__name__} {name}_load(uint i) {{")
    for k in range(groups):
        lines.append(f"    uvec{group} w{k} = {name}_words[i * {stride} + {k}u];")
    lines.append(f"    return {record.__name__}({glsl_textures.unpacked(record, group)});\n}}")
    return "\n".join(lines)


def _picker(name: str, record: type[Record]) -> str:
    """`NAME_pick(i)`: as `_load`, but where there are very few, chosen among loads at constant places."""
    count = f"{name.upper()}_COUNT"
    return f"""
{record.__name__} {name}_pick(uint i) {{
#if {count} == 0 || {count} > PICK_MAX
    return {name}_load(i);
#else
    {record.__name__} r = {name}_load(0u);
    for (uint k = 1u; k < uint({count}); k++) {{
        {record.__name__} other = {name}_load(k);
        if (i == k) r = other;
    }}
    return r;
#endif
}}"""


def _constants() -> str:
    out = []
    for prefix, enum in (("SHAPE", ShapeKind), ("LIGHT", LightKind), ("MODEL", Model)):
        out += [f"const uint {prefix}_{e.name} = {int(e)}u;" for e in enum]
    out += [f"#define SLOT_{s.name} {int(s)}" for s in Slot]
    out += [f"#define FRAME_BLOCK {layout.FRAME_BLOCK}", f"#define FILTER_BLOCK {layout.FILTER_BLOCK}"]
    for name in (
        "NONE",
        "SINGLE_SIDED",
        "HIDDEN",
        "LEAF_BIT",
        "LEAF_KIND_SHIFT",
        "LEAF_COUNT_SHIFT",
        "LEAF_FIRST_MASK",
    ):
        out.append(f"const uint {name} = {getattr(layout, name)}u;")
    out += [f"#define ENERGY_{name.upper()}_TEXTURE {unit}" for name, unit in layout.ENERGY_TEXTURES.items()]
    out.append(f"#define ENERGY_ASPECTS {energy.ASPECT_SHAPE[0]}")
    for name in ("ROUGHNESS_END", "LEAST_ASPECT", "LARGEST_ETA", "COMMON_ETA", "LEAST_SHEEN_ROUGHNESS"):
        out.append(f"const float ENERGY_{name} = {getattr(energy, name)!r};")
    return "\n".join(out)


def text() -> str:
    """The text of `layout.glsl`: constants, structs, buffers with their loaders, and the uniform block `frame`."""
    structs = [_struct(r) for r in dict.fromkeys(r for r, _ in layout.BUFFERS.values())]
    loaders = [_loader(name, r, slot) for name, (r, slot) in layout.BUFFERS.items()]
    loaders += [_picker(name, layout.BUFFERS[name][0]) for name in layout.COUNTED]
    nodes = f"layout(std430, binding = {int(Slot.NODES)}) readonly buffer node_buffer {{ uvec4 node_words[]; }};"
    body = " ".join(f"{k.glsl} {name};" for name, k in Frame.members.items())
    frame = f"layout(std140, binding = {layout.FRAME_BLOCK}) uniform frame_block {{ {body} }} frame;"
    return "\n".join([_constants(), *structs, *loaders, nodes, frame, glsl_textures.text()]) + "\n"
