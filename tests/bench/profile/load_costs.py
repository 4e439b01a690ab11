"""What loads cost, each lane of a vector loading from a place of its own, by kind of memory and number of lanes."""

from __future__ import annotations

import statistics
import time
from typing import Any

import numpy as np

from gpu import context as contexts

KINDS = {
    "storage buffer, uvec4": "nodes[i]",
    "storage buffer, four uints": "uvec4(words[4u * i], words[4u * i + 1u], words[4u * i + 2u], words[4u * i + 3u])",
    "uniform block, uvec4": "block[i]",
    "texelFetch, rgba32ui": "texelFetch(texels, ivec2(i, 0), 0)",
}
NOTHING = "no load"  # the same loop with arithmetic in place of the load
ACTIVE = (8, 4, 2, 1)  # lanes
RECORDS = 1024  # of 16 bytes: they fit into the least uniform block
_TURNS, _GROUPS = 400, 64

_KERNEL = """#version 430
layout(local_size_x = 8, local_size_y = 8) in;
layout(std430, binding = 0) buffer node_buffer { uvec4 nodes[]; };
layout(std430, binding = 1) buffer word_buffer { uint words[]; };
layout(std430, binding = 2) buffer out_buffer { uint sums[]; };
layout(std140, binding = 0) uniform node_block { uvec4 block[RECORDS]; };
layout(binding = 0) uniform usampler2D texels;
uniform uint active_lanes;
void main() {
    uint at = gl_GlobalInvocationID.y * 8u + gl_LocalInvocationID.x, i = (at * 37u) % RECORDS, turn = 0u, sum = 0u;
    bool takes_part = gl_LocalInvocationID.x < active_lanes;
    do {
        uvec4 v = uvec4(i, 1u, 2u, 3u);
        if (takes_part) v = LOAD;
        sum += v.y ^ v.z ^ v.w;
        i = v.x;
    } while (++turn < TURNS);
    sums[at] = sum;
}
"""


def load_costs(runs: int = 9, groups: int = _GROUPS) -> dict[str, list[float]]:
    """For each of KINDS and NOTHING, nanoseconds of one core for a turn of a vector of 8 lanes with a load, for each
    number of ACTIVE lanes: medians, in turns. It makes a context of its own. Raises ContextError."""
    context = contexts.create(None)
    try:
        bound = _bind(context, groups)
        kernels = {name: _kernel(context, load) for name, load in KINDS.items()}
        kernels[NOTHING] = _kernel(context, f"uvec4((5u * i + 1u) % {RECORDS}u, i, i >> 1, i ^ 3u)")
        for kernel in kernels.values():
            _nanoseconds(kernel, bound[-1], ACTIVE[0], groups)
        rounds = [
            [[_nanoseconds(kernel, bound[-1], lanes, groups) for lanes in ACTIVE] for kernel in kernels.values()]
            for _ in range(runs)
        ]
        medians = [[statistics.median(cell) for cell in zip(*row, strict=True)] for row in zip(*rounds, strict=True)]
        for made in (*bound, *kernels.values()):
            made.release()
        return dict(zip(kernels, medians, strict=True))
    finally:
        contexts.release(context)


def _bind(context: Any, groups: int) -> list[Any]:
    """A cycle through all records, bound in every way; the last buffer takes the sums."""
    order = np.random.default_rng(1).permutation(RECORDS).astype(np.uint32)
    records = np.zeros((RECORDS, 4), np.uint32)
    records[order, 0] = np.roll(order, 1)
    records[:, 1:] = np.arange(RECORDS)[:, None]
    buffer, sums = context.buffer(records.tobytes()), context.buffer(reserve=4 * 64 * groups)
    texture = context.texture((RECORDS, 1), 4, records.tobytes(), dtype="u4")
    texture.filter = (0x2600, 0x2600)  # GL_NEAREST
    buffer.bind_to_storage_buffer(0)
    buffer.bind_to_storage_buffer(1)
    sums.bind_to_storage_buffer(2)
    buffer.bind_to_uniform_block(0)
    texture.use(0)
    return [buffer, texture, sums]


def _kernel(context: Any, load: str) -> Any:
    text = _KERNEL.replace("LOAD", load).replace("RECORDS", f"{RECORDS}u").replace("TURNS", f"{_TURNS}u")
    return context.compute_shader(text)


def _nanoseconds(kernel: Any, sums: Any, lanes: int, groups: int) -> float:
    kernel["active_lanes"] = lanes
    began = time.process_time()
    kernel.run(1, groups)
    sums.read(4)  # waits for the kernel
    return (time.process_time() - began) * 1e9 / (_TURNS * 8 * groups)
