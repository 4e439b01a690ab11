"""Bytes shared with the shaders: every member of every record is echoed from the GPU, bit for bit."""

from __future__ import annotations

import numpy as np
import pytest

from gpu import Renderer, layout
from gpu.device.textures import linear_texture
from gpu.kernels import features, instances_glsl, layout_glsl
from gpu.kernels.features import COUNTS, FEW, defines, everything
from gpu.kernels.flag_table import FLAGS
from gpu.kernels.source import KernelSource
from gpu.layout import BUFFERS, bindings
from gpu.layout.bindings import COUNTED
from gpu.layout.record import LayoutError, Record, f32, vec3
from tests.rendering import document, picture


@pytest.mark.parametrize("name", [*BUFFERS, "instance"])
@pytest.mark.parametrize("block", [False, True])
def test_every_member_arrives(gpu: Renderer, name: str, block: bool) -> None:
    record, slot = (layout.Instance, None) if name == "instance" else BUFFERS[name]
    if block and name not in COUNTED:
        pytest.skip("this buffer is always a storage buffer")
    count = 3 if slot is not None else 2000  # those of instances are texels of several rows
    rng = np.random.default_rng(5)
    # Any bits but those of a NaN's or denormal's exponent, which some GPUs do not keep in float registers.
    words = rng.integers(0x00800000, 0x7F000000, (count, record.words), np.uint32)
    values = words.view(record.dtype)[:, 0]
    out_words = sum(kind.words for kind in record.members.values())
    lines, at = [], 0
    for member, kind in record.members.items():
        for axis in "xyzw"[: kind.words]:
            value = f"r.{member}" + (f".{axis}" if kind.words > 1 else "")
            bits = value if kind.base is np.uint32 else f"floatBitsToUint({value})"
            lines.append(f"    echo[i * {out_words}u + {at}u] = {bits};")
            at += 1
    known = defines(frozenset({"HAS_INSTANCES"} if slot is None else ()))
    known |= {f"{name.upper()}_COUNT": count} if block else {}
    head = "\n".join(f"#define {k} {v}" for k, v in known.items())
    kernel = gpu.context.compute_shader(
        f"#version 430\n{head}\nlayout(local_size_x = 8) in;\n{layout_glsl.text()}\n"
        "layout(std430, binding = 15) writeonly buffer echo_buffer { uint echo[]; };\n"
        f"void main() {{\n    uint i = gl_GlobalInvocationID.x;\n    if (i >= {count}u) return;\n"
        f"    {record.__name__} r = {name}_load(i);\n" + "\n".join(lines) + "\n}\n"
    )
    data = linear_texture(gpu.context, words, 4, "u4") if slot is None else gpu.context.buffer(words.tobytes())
    echo = gpu.context.buffer(reserve=4 * count * out_words)
    if slot is None:
        data.use(bindings.INSTANCES_TEXTURE)
    elif block:
        data.bind_to_uniform_block(COUNTED[name])
    else:
        data.bind_to_storage_buffer(int(slot))
    echo.bind_to_storage_buffer(15)
    kernel.run(-(-count // 8))
    got = np.frombuffer(echo.read(), np.uint32).reshape(count, out_words)
    members = [np.ascontiguousarray(values[m]).view(np.uint32).reshape(count, -1) for m in record.members]
    assert (got == np.concatenate(members, axis=1)).all()
    for thing in (kernel, data, echo):
        thing.release()


def test_uniform_block_arrives(gpu: Renderer) -> None:
    record = layout.Uniforms
    words = np.random.default_rng(6).integers(0x00800000, 0x7F000000, record.words, np.uint32)
    lines, expected = [], []
    camera = {
        f"camera.{member}": (kind, layout.Camera.offsets[member]) for member, kind in layout.Camera.members.items()
    }
    members = {member: (kind, record.offsets[member]) for member, kind in record.members.items()}
    assert members.pop("camera") == (layout.Camera, 0)
    for member, (kind, offset) in {**camera, **members}.items():
        for k, axis in enumerate("xyzw"[: kind.words]):
            value = f"uniforms.{member}" + (f".{axis}" if kind.words > 1 else "")
            bits = value if kind.base is np.uint32 else f"floatBitsToUint({value})"
            lines.append(f"    echo[{len(expected)}] = {bits};")
            expected.append(words[offset + k])
    head = "\n".join(f"#define {k} {v}" for k, v in defines(frozenset({"HAS_INSTANCES"})).items())
    kernel = gpu.context.compute_shader(
        f"#version 430\n{head}\nlayout(local_size_x = 8) in;\n{layout_glsl.text()}\n"
        "layout(std430, binding = 15) writeonly buffer echo_buffer { uint echo[]; };\n"
        "void main() {\n    if (gl_GlobalInvocationID.x > 0u) return;\n" + "\n".join(lines) + "\n}\n"
    )
    data, echo = gpu.context.buffer(words.tobytes()), gpu.context.buffer(reserve=4 * len(expected))
    data.bind_to_uniform_block(bindings.UNIFORM_BLOCK)
    echo.bind_to_storage_buffer(15)
    kernel.run(1)
    assert np.frombuffer(echo.read(), np.uint32).tolist() == [int(x) for x in expected]
    for thing in (kernel, data, echo):
        thing.release()


def test_what_only_some_kernels_have_comes_last() -> None:
    """Else what follows would lie elsewhere in the others."""
    assert tuple(layout.Uniforms.members)[-len(instances_glsl.UNIFORMS) :] == instances_glsl.UNIFORMS


def test_a_hole_is_refused() -> None:
    with pytest.raises(LayoutError, match="hole"):
        type("Holed", (Record,), {"__annotations__": {"a": "f32", "b": "vec3"}})
    with pytest.raises(LayoutError, match="unknown type"):
        type("Odd", (Record,), {"__annotations__": {"a": "f64"}})
    with pytest.raises(LayoutError, match="a hole after it"):
        type("Pair", (Record,), {"__annotations__": {"a": "f32"}})
        type("Outer", (Record,), {"__annotations__": {"a": "Pair", "b": "f32"}})
    assert (f32.words, vec3.words) == (1, 3)


def test_every_flag_and_count_is_defined() -> None:
    known = defines(frozenset())
    assert {name for name in everything() if not FLAGS[name].of_settings} <= set(known)
    assert {*COUNTS, *FEW} == {f"{name.upper()}_COUNT" for name in COUNTED}


@pytest.mark.llvmpipe
def test_few_records_are_read_alike_from_storage_buffers(gpu: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    """The kernels of `python -m tests.bench device --part blocks`; two materials, a lamp, and shapes in loops."""
    materials = {"m": {"type": "diffuse", "albedo": 0.5}, "lamp": {"type": "diffuse", "albedo": 0, "emission": 3}}
    shapes = [
        {"type": "box", "min": [-1, -1, -1], "max": [1, 1, 1], "material": "m"},
        {"type": "sphere", "center": [0, 3, 2], "radius": 0.5, "material": "lamp"},
    ]
    seen, texts = [], set()
    for blocks in (1, 0):
        monkeypatch.setattr(features, "UNIFORM_BLOCKS", blocks)
        made = picture(gpu, document(shapes, materials), 4)
        texts.add(KernelSource("pathtrace.comp", made.scene.defines(made.settings)).text.split("void main")[0])
        seen.append(made.read())
    assert len(texts) == 2 and seen[0].any() and np.array_equal(*seen)
