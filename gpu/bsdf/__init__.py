"""One material's BSDF as numbers, from the functions that render.

lobes      defines of the kernel that can show one lobe alone
kernels    which kernels answer for a material
evaluator  values, densities and albedos, in slices of bounded time
"""
