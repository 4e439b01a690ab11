"""Where the time of a path goes on the processor's driver, llvmpipe: `python -m tests.bench profile`.

run           all parts of a profile, scene by scene
scenes        the scenes that are profiled
hooks         the lines of the shaders at which is counted
counts        rays, boxes and turns of loops of a path, and how many lanes of a vector take part in them
knockouts     the time of a path without its bounces, textures, materials ...
machine_code  the time by loops of the kernel's machine code, sampled by perf
loops         the loops of disassembled code
load_costs    what loads cost, by kind of memory and by lanes of a vector
instrumented  a renderer whose kernels also count, at lines of their shaders that are named
drivers       another Mesa beside the system's
page          tables, and their section of llvmpipe.md
"""
