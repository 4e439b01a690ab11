"""OBJ with its materials and textures, read in the parsing child from a zip of its folder: a whole scene.

importer   the OBJ file -> a scene's document with its meshes and images as parts
libraries  the material libraries that it names
mtl        material libraries -> statements
materials  their materials -> the document's
textures   their maps -> the document's textures
"""
