"""Programs that make `energy.npz`, offline: `python -m gpu.tables.build.energy_tables`.

energy_tables      the program, and what each table holds
energy_quadrature  albedos of the lobes, by quadrature over visible normals
energy_fit         values on a grid whose linear interpolation follows a function
"""
