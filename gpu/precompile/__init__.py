"""Kernels that are compiled before they are needed, and those that serve until then. Public.

kernel_keys  everything that the machine code of a kernel depends on, and which kernels an edit will need
precompiler  a context that only compiles, into the driver's disk cache
fallback     a scene's superset kernel, for a scene whose own kernel is still being compiled
"""
