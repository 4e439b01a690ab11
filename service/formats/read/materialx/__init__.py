"""MaterialX files -> materials with their textures, by the library of the extra `materialx`, in the parsing process.

importer    a `.mtlx` file, or a zip that has one, as a document with materials and textures
document    the text of a file, checked, as the library's document beside its standard definitions
graph       elements of the document as trees of operations (`service/formats/surface/trees.py`)
operations  what operations of graphs compute, for arrays of texels
noise       the standard library's noises
evaluation  trees as numbers, and what they are as functions of coordinates or of an image
images      the images that a file names
values      trees as numbers, colours and textures of a document
surface     one surface shader, as the models read it
"""
