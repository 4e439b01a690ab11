"""MaterialX 1.39: materials as the surface model that has most of their parameters, their images beside the file.

writer  the materials of a scene, or one, as a .mtlx
models  `principled` as standard_surface, and `openpbr` as open_pbr_surface
graph   nodes for textures
"""
