"""Whether later commands see what a kernel wrote, with and without a barrier."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gpu import context as contexts
from tests.bench.device.part import Options, Row

WORDS = 1 << 21
WRITE = """#version 430
layout(local_size_x = 64) in;
layout(std430, binding = 0) buffer a_buffer { uint a[]; };
uniform uint turn;
void main() {
    uint i = gl_GlobalInvocationID.x, x = i;
    for (uint k = 0u; k < 64u; ++k) x = x * 1664525u + 1013904223u; // so that the last groups write late
    a[i] = turn + (x == 1u ? 1u : 0u) * 0u;
}
"""
CHECK = """#version 430
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer a_buffer { uint a[]; };
layout(std430, binding = 1) buffer b_buffer { uint wrong; };
uniform uint turn;
uniform uint count;
void main() {
    uint i = (gl_GlobalInvocationID.x * 2654435761u + count / 2u) % count; // another group's word
    if (a[i] != turn) atomicAdd(wrong, 1u);
}
"""


def rows(options: Options) -> Iterator[Row]:
    context = contexts.create(options.device)
    words = int(WORDS * options.scale) // 64 * 64
    turns = max(20, int(1000 * options.scale))
    data, wrong = context.buffer(reserve=4 * words), context.buffer(reserve=4)
    write, check = context.compute_shader(WRITE), context.compute_shader(CHECK)
    check["count"].value = words
    for barrier in (False, True):
        wrong.write(bytes(4))
        data.bind_to_storage_buffer(0)
        wrong.bind_to_storage_buffer(1)
        for turn in range(1, turns + 1):
            write["turn"].value = check["turn"].value = turn
            write.run(words // 64)
            if barrier:
                context.memory_barrier()
            check.run(words // 64)
            if barrier:
                context.memory_barrier()
        context.finish()
        count = int(np.frombuffer(wrong.read(), np.uint32)[0])
        yield {"what": "run, then run", "barrier": barrier, "turns": turns, "wrong": count}
        bad = 0
        for turn in range(1, turns // 10 + 1):
            write["turn"].value = turns + turn
            write.run(words // 64)
            if barrier:
                context.memory_barrier()
            bad += int(np.count_nonzero(np.frombuffer(data.read(), np.uint32) != turns + turn))
        yield {"what": "run, then read", "barrier": barrier, "turns": turns // 10, "wrong": bad}
