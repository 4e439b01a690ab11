"""Kernels that are compiled before they are needed, and one that serves until then. Public.

kernel_keys  everything that the machine code of a kernel depends on, and which kernels an edit will need
precompiler  a context that only compiles, into the driver's disk cache
fallback     one kernel for many scenes, for a scene whose own kernel is still being compiled
"""
