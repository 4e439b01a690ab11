"""A zip is what is in it: a model with its parts, materials, or images that make materials.

contents   which models and materials a zip holds, and which of them is meant
importer   that one -> a scene's document, one mesh, or a file of its own
meshes     an STL file of a zip as a scene, and the triangles of PLY or STL there
"""
