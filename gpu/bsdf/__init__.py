"""One material's BSDF as numbers, from the functions that render.

lobes      the lobes of each model, of which a kernel can show one alone
kernels    which kernels answer for a material
evaluator  values, densities and albedos, in slices of bounded time
"""
