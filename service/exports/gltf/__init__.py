"""glTF 2.0, written so that our own importer reads the same picture from it, to the bit where nothing is lost.

writer           a scene as a GLB; a material, on a ball, as a .gltf
builder          the JSON and the binary part of a file: views, accessors, extensions
meshes           the document's meshes -> primitives
tessellated      spheres, quads, disks and boxes -> primitives
placing          nodes for shapes, the camera and lights
materials        the document's materials -> glTF's
material_writer  what all materials have: colour, alpha, normal map
extensions       KHR_materials_*
textures         images and their placing, packed into glTF's channels
pixels           computed images: channels moved, colours encoded, a checker painted
"""
