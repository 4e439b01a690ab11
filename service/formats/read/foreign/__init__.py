"""Files of programs whose formats are read by a library that writes glTF: what becomes of them is what the one glTF
reader makes of that.

assimp      FBX, COLLADA, 3DS, X3D and 3MF by Assimp, as a GLB with the cameras and lights that its writer leaves out
cad         STEP by OpenCASCADE
importer    the scene of either
glb         a GLB that is changed: its JSON, its bytes, and images that are put into it
"""
