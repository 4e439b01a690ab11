"""Records as GLSL: structs, buffers with their loaders, constants. Shaders include it as `layout.glsl`. Those that
read no scene include the constants alone, `layout_constants.glsl`: drivers count the buffers that are declared."""

from __future__ import annotations

from gpu import layout
from gpu.kernels import bodies_glsl, instances_glsl, measured_glsl, microfacets_glsl, models_glsl, textures_glsl
from gpu.kernels.light_kinds import POINTS
from gpu.kernels.words_glsl import unpacked
from gpu.layout import CameraKind, LightKind, ShapeBit, ShapeKind, Uniforms, bindings
from gpu.layout.bindings import BlockSlot, GuessSlot, Slot
from gpu.layout.models import MODELS
from gpu.layout.pixel_layers import COVER_RANKS
from gpu.layout.record import Record
from gpu.tables import energy, film, half_space


def _struct(record: type[Record]) -> str:
    body = " ".join(f"{k.glsl} {name};" for name, k in record.members.items())
    return f"struct {record.__name__} {{ {body} }};"


def _loader(name: str, record: type[Record], slot: Slot) -> str:
    """The buffer of a record and its `NAME_load(i)`.

    Where a kernel knows the number of records, they are in a uniform block: llvmpipe loads from a block once for all
    lanes where the index is constant, as in unrolled loops, but from a storage buffer lane by lane wherever control
    flow has diverged. UNIFORM_BLOCKS 0 makes a storage buffer of each, as blocks of GPUs are made for one index in
    all lanes: `python -m tests.bench device --part blocks` measures both. Where the first shapes of a kind stand in a
    loop and the others in the tree, there are both, and `NAME_tree_load(i)` reads any of them.
    """
    storage = _storage(name, record, slot, "words")
    if name not in bindings.COUNTED:
        return "\n".join([storage, _load(name, record, "load", "words")])
    count, stride = f"{name.upper()}_COUNT", _stride(name, record)
    block = f"layout(std140, binding = {bindings.COUNTED[name]}) uniform {name}_block"
    lines = [
        f"#if UNIFORM_BLOCKS && {count} > 0",
        f"{block} {{ uvec4 {name}_words[{count} * {stride}]; }};",
        "#else",
        storage,
        "#endif",
        _load(name, record, "load", "words"),
    ]
    if name in _SHAPES:
        lines += [
            f"#if {_split(name)}",
            _storage(name, record, slot, "stored"),
            _load(name, record, "tree_load", "stored"),
            "#else",
            f"#define {name}_tree_load {name}_load",
            "#endif",
        ]
    return "\n".join(lines)


_SHAPES = frozenset(kind.name.lower() for kind in ShapeKind if kind != ShapeKind.INSTANCE)


def _split(name: str) -> str:
    """The condition under which a kernel's loop has some shapes of a kind and its tree the others."""
    return f"UNIFORM_BLOCKS && {name.upper()}_COUNT > 0 && HAS_BVH_{layout.BUFFERS[name][1].name}"


def _stride(name: str, record: type[Record]) -> str:
    if name == "material":
        return "MATERIAL_GROUPS"  # textures follow a material's numbers
    return f"{record.words // (4 if record.words % 4 == 0 else 2)}u"


def _storage(name: str, record: type[Record], slot: Slot, words: str) -> str:
    group = 4 if record.words % 4 == 0 else 2
    return f"layout(std430, binding = {int(slot)}) readonly buffer {name}_buffer {{ uvec{group} {name}_{words}[]; }};"


def _load(name: str, record: type[Record], function: str, words: str) -> str:
    group = 4 if record.words % 4 == 0 else 2
    stride = _stride(name, record)
    lines = [f"{record.__name__} {name}_{function}(uint i) {{"]
    for k in range(record.words // group):
        lines.append(f"    uvec{group} w{k} = {name}_{words}[i * {stride} + {k}u];")
    lines.append(f"    return {record.__name__}({unpacked(record, group)});\n}}")
    return "\n".join(lines)


def _none(name: str, record: type[Record]) -> str:
    """`NAME_none()`, a record of zeros."""
    zeros = ", ".join(f"{kind.glsl}(0)" for kind in record.members.values())
    return f"{record.__name__} {name}_none() {{ return {record.__name__}({zeros}); }}"


def _picker(name: str, record: type[Record]) -> str:
    """`NAME_pick(i)`, which is `NAME_load(i)`, but chooses among loads at constant places where records are few."""
    count = f"{name.upper()}_COUNT"
    tree = f"#if {_split(name)}\n    return {name}_tree_load(i);\n#elif" if name in _SHAPES else "#if"
    return f"""
{record.__name__} {name}_pick(uint i) {{
{tree} {count} == 0 || {count} > PICK_MAX
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


def constants() -> str:
    """The text of `layout_constants.glsl`, with which that of `layout.glsl` begins."""
    out = []
    for prefix, enum in (("SHAPE", ShapeKind), ("LIGHT", LightKind), ("CAMERA", CameraKind)):
        out += [f"const uint {prefix}_{e.name} = {int(e)}u;" for e in enum if e is not ShapeKind.INSTANCE]
    is_point = " || ".join(f"(kind) == LIGHT_{kind.name}" for kind in POINTS)
    out.append(f"#define LIGHT_IS_POINT(kind) ({is_point})")
    out += [f"const uint MODEL_{model.name.upper()} = {model.number}u;" for model in MODELS]
    out += [f"#define SLOT_{name} {int(slot)}" for name, slot in Slot.__members__.items()]
    out += [f"#define BLOCK_SLOT_{s.name} {int(s)}" for s in BlockSlot]
    out += [f"#define GUESS_SLOT_{s.name} {int(s)}" for s in GuessSlot]
    out.append(f"#define COVER_RANKS {COVER_RANKS}")
    out += [f"#define {name} {getattr(layout, name)}" for name in ("WORK_GROUP", "BSDF_GROUP")]
    out.append(f"#define FILTER_BLOCK {bindings.FILTER_BLOCK}")
    out += [f"const uint {bit.name} = {int(bit)}u;" for bit in ShapeBit]
    for name in (
        "NONE",
        "SHAPE_BITS",
        "SOLID_BITS",
        "NORMALS_SMOOTH",
        "NORMALS_LEFT",
        "TANGENT_SHIFT",
        "TANGENT_BITS",
        "TANGENT_STEPS",
        "LEAF_BIT",
        "LEAF_KIND_SHIFT",
        "LEAF_COUNT_SHIFT",
        "LEAF_FIRST_MASK",
        "TREELET_BIT",
        "TREELET_MAX_NODES",
        "CLUSTER_BIT",
        "LIGHT_CODES",
        "METER_REPLICATES",
        "PLAN_AREA",
        "PLAN_CLASSES",
    ):
        out.append(f"const uint {name} = {getattr(layout, name)}u;")
    out += [f"const float {name} = {getattr(layout, name)!r};" for name in ("LEAST_ROUGHNESS", "TEXTURED")]
    out.append(f"const vec3 LUMINANCE = vec3({', '.join(map(repr, layout.LUMINANCE))});")
    out.append(f"#define LIGHT_TREE_TEXTURE {bindings.LIGHT_TREE_TEXTURE}")
    out.append(f"const uint LIGHT_TREE_ROW = {bindings.TEXELS_A_ROW}u;")
    out += [f"#define ENERGY_{name.upper()}_TEXTURE {unit}" for name, unit in bindings.ENERGY_TEXTURES.items()]
    sizes = ("ETAS", "ASPECTS", "STEPS", "AZIMUTHS", "COSINES")
    out += [f"#define ENERGY_{name} {size}" for name, size in zip(sizes, energy.STRETCHED_SHAPE, strict=True)]
    for name in ("LEAST_ASPECT", "LARGEST_ETA", "AZIMUTH_POWER", "LEAST_SHEEN_ROUGHNESS"):
        out.append(f"const float ENERGY_{name} = {getattr(energy, name)!r};")
    for name in ("NUMERATOR", "DENOMINATOR"):
        out.append(f"const vec2 HALF_SPACE_{name} = vec2{getattr(half_space, name)!r};")
    out += [*_film(), f"#define FILM_TEXTURE {bindings.FILM_TEXTURE}"]
    return "\n".join(out)


def _film() -> list[str]:
    """The constants of `gpu.tables.film`."""
    waves = {
        "DECAY": -film.EXPONENTS.real, "TURN": film.EXPONENTS.imag,
        "REAL": film.AMPLITUDES.real, "IMAGINARY": film.AMPLITUDES.imag,
    }  # fmt: skip
    out = []
    for name, rows in waves.items():
        vectors = ", ".join(f"vec3({', '.join(map(repr, row))})" for row in rows.tolist())
        out.append(f"const vec3 FILM_{name}[] = vec3[]({vectors});")
    return [*out, f"const int FILM_WAVES = {len(film.AMPLITUDES)};", f"const float FILM_FADING = {film.FADING!r};"]


def text() -> str:
    """The text of `layout.glsl`: constants, structs, buffers with their loaders, and the uniform block `uniforms`."""
    structs = [_struct(r) for r in dict.fromkeys(r for r, _ in layout.BUFFERS.values())]
    loaders = [_loader(name, r, slot) for name, (r, slot) in layout.BUFFERS.items()]
    loaders += [_picker(name, layout.BUFFERS[name][0]) for name in bindings.COUNTED]
    loaders.append(f"#if ANY_CHAINS\n{_none('material', layout.Material)}\n#endif")
    nodes = f"layout(std430, binding = {int(Slot.NODES)}) readonly buffer node_buffer {{ uvec4 node_words[]; }};"
    parts = [constants(), *structs, *loaders, nodes, _uniforms(), instances_glsl.text(), textures_glsl.text()]
    parts += [bodies_glsl.text(), models_glsl.predicates(), microfacets_glsl.text(), measured_glsl.text()]
    return "\n".join(parts)


def _uniforms() -> str:
    structs = "\n".join(_struct(kind) for kind in Uniforms.members.values() if issubclass(kind, Record))
    members = {name: f"{kind.glsl} {name};" for name, kind in Uniforms.members.items()}
    last = " ".join(members.pop(name) for name in instances_glsl.UNIFORMS)
    body = " ".join(members.values())
    return f"""{structs}
layout(std140, binding = {bindings.UNIFORM_BLOCK}) uniform uniform_block {{ {body}
#if HAS_INSTANCES
{last}
#endif
}} uniforms;"""
