"""glTF 2.0, GLB or JSON, read in the parsing child: its triangles as one mesh, or the whole as a scene.

This reader is our own. trimesh's allocates whatever an accessor claims, reads sparse accessors as zeros and
normalised positions as integers, and skips triangle fans.

importer              a file -> a scene's document with its meshes and images as parts
merged_mesh           a file -> one mesh
document              the file: its JSON, buffers, views and limits
beside                the files of a zip to which its URIs lead
json_view             a place in the JSON, with its values by type and errors that name it
extensions            which extensions are supported, and the warnings about the others
accessors             accessors -> arrays
draco                 meshes that are compressed with KHR_draco_mesh_compression
meshopt_views         buffer views that are compressed with EXT_ or KHR_meshopt_compression
nodes                 nodes and their transforms
primitives            primitives -> triangles with normals, colours and texture coordinates
bad_rows              what of a primitive is left out
deform                morph targets and skins, in the pose of the nodes
animations            the pose of the nodes at one time of an animation
variants              KHR_materials_variants
materials             materials -> the document's
material_inputs       the inputs of one material, as its model reads them
material_reader       the numbers and textures of one material
specular_glossiness   KHR_materials_pbrSpecularGlossiness
textures              textures and samplers -> the document's
ktx2_images           images of KHR_texture_basisu as PNG files
texture_bake          pixels of textures that are computed from others
anisotropy_texture    KHR_materials_anisotropy's texture
iridescence           weights and thicknesses of KHR_materials_iridescence
lights_and_camera     lights and cameras -> the document's
"""
