"""MaterialX 1.39: materials as the surface model that has most of their parameters, their images beside the file.

writer  the materials of a scene, or one, as a .mtlx
graph   nodes for textures
"""
