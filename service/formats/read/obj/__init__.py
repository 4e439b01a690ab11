"""OBJ with its materials and textures, read in the parsing child from a zip of its folder: a whole scene.

importer   the zip -> a scene's document with its meshes and images as parts
archive    the files of a zip, whose sizes are bounded before any is unpacked
paths      resolves references from one file to another
mtl        material libraries -> statements
materials  their materials -> the document's
textures   their maps -> the document's textures
"""
