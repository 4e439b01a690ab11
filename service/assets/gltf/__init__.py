"""glTF 2.0, GLB or JSON, read in the parsing child: its triangles as one mesh, or the whole as a scene.

Our own, and not trimesh's: that one gives an accessor the memory it asks for, reads sparse accessors as zeros and
normalised positions as integers, and skips fans.
"""
