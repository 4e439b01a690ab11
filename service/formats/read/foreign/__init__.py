"""Files of programs whose formats become glTF, mostly by a library: what becomes of them is what the one glTF reader
makes of that.

assimp      FBX, COLLADA, 3DS and X3D by Assimp, as a GLB with the cameras and lights that its writer leaves out
cad         STEP by OpenCASCADE
three_mf    3MF, by a reader of our own
three_mf_parts  what the XML of its parts says
importer    the scene of either
glb         a GLB that is changed: its JSON, its bytes, and images that are put into it
"""
