"""Programs that make `energy.npz` and `facets.npy`, offline: `python -m gpu.tables.build.NAME`, of two.

energy_tables      a program, and what each table holds
energy_quadrature  albedos of the lobes, by quadrature over visible normals
facet_rules        a program: which facets reflect light, as a few cosines and weights
energy_fit         values on a grid whose linear interpolation follows a function
"""
