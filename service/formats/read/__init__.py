"""Readers of single formats and importers of whole scenes, which run in the parsing child.

archive      the files of a zip, whose sizes are bounded before any is unpacked
references   finds the files that others name
zips         a zip is what is in it
gltf         glTF
obj_mesh     OBJ: vertices and faces
obj          OBJ files with materials and textures
obj_lines    the lines of an OBJ text by keyword, in blocks
obj_rows     their numbers: rows of vertices and the corners of faces
obj_colors   colours of an OBJ file's vertices
ply          PLY, text and binary
ply_header   its elements, and what lies where
ply_body     its data, element by element
stl          STL, binary and text
polygons     polygons -> triangles
corners      vertices for the corners of faces
raw_mesh     the result of a reader
numbers      numbers in texts, also those that are none
bad_elements  what is left out of a mesh, and how it is told
mesh_checks  oddities of a mesh: repeated triangles, edges of too many, inside out
rendered     OpenEXR files that Sunbox wrote: colour, its variance and its samples
cube         tables of colours, one or three axes
image        PNG, JPEG, WebP, OpenEXR and Radiance HDR
png_chunks   the chunks of PNG: those that would refuse a sound picture, and what they say of colours
other_images  images in formats of other programs as PNG
exr_layers   the layers of an OpenEXR file, and which of them is shown
exr_cube     OpenEXR files of six faces -> latitude-longitude images
hdr_lines    Radiance HDR: flat scan lines and the older run lengths
measured     measured reflection
foreign      FBX, COLLADA, 3DS, X3D, 3MF and STEP as glTF
usd          USD
usd_names    the files that a USD layer names, found without its library
materialx    MaterialX
texture_sets  images that make materials by their names
scenes       parts that the importers of whole scenes share
"""
