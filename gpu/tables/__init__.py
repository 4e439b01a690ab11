"""Tables that kernels draw from and look up. Public; runs without GL.

alias_table        weights -> which light, and which texels of an environment, in constant time
environment_cells  a map of weights -> cells of equal probability, along Morton's curve
mip_levels         images -> their mip levels: means of light, of normals with what is lost of their spread
sky                the analytic clear sky and its sun, from the numbers in `hosek_wilkie.txt`
microfacet         factors of distributions of facets, and the area of facets that a direction sees
film               what thin films reflect, whatever they lie on
half_space         the albedo of single scattering by which much of a medium shows a colour
energy             the energy that microfacet lobes lose, from `energy.npz`, which the folder `build` makes
build              the offline programs behind `energy.npz`; no other module imports them
"""
