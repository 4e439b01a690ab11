"""Zipped images whose names say what they are -> materials with their textures.

names      what the image of a file name is of, and of which material
sets       the images of each material: which is taken where several are of one thing
real_size  how large what they show is, where names or notes say it
importer   a zip of images as a document with materials and textures
baking     images that must be turned into another: gloss into roughness, DirectX normals into OpenGL's
"""
