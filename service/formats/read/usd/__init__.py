"""USD, read in the parsing child by the library `pxr` of the extra `usd`.

Nothing of this folder is imported but there: the library takes 0.2 s and 50 MB.

importer         a file -> a scene's document with its meshes and images as parts, or one mesh
package          the file: its layers in memory, and the images beside them
materialx_layer  a MaterialX file -> a layer
walk             the prims that are shown, and where they stand
meshes           a mesh -> triangles with normals, colours and texture coordinates
subdivision      whether it would change the shape of a mesh
solids           spheres, boxes, cylinders, cones, capsules and planes
materials        materials -> the document's
material_reader  the inputs of one surface, as the models read them
pictures         nodes that read images
networks         inputs of shaders, and what they lead to
textures         images and how they lie on a surface -> the document's textures
lights           UsdLux -> lights, glowing shapes and the environment
cameras          cameras -> the document's
"""
