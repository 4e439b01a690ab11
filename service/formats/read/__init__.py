"""Readers of single formats and importers of whole scenes, which run in the parsing child.

archive      the files of a zip, whose sizes are bounded before any is unpacked
references   finds the files that others name
zips         a zip is what is in it
gltf         glTF
obj_mesh     OBJ: vertices and faces
obj          OBJ files with materials and textures
obj_lines    the lines of an OBJ text by keyword, in blocks
ply          PLY, text and binary
stl          STL, binary and text
polygons     polygons -> triangles
raw_mesh     the result of a reader, and the checks that every mesh has to pass
mesh_checks  oddities of a mesh: repeated triangles, edges of too many, inside out
rendered     OpenEXR files that Sunbox wrote: colour, its variance and its samples
cube         tables of colours, one or three axes
image        PNG, JPEG, WebP, OpenEXR and Radiance HDR
measured     measured reflection
usd          USD
materialx    MaterialX
texture_sets  images that make materials by their names
scenes       parts that the importers of whole scenes share
"""
