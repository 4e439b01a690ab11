"""From a scene to compiled kernels: the flags of the code that it needs, the shader text, the compiled result.

flag            what is known of a flag
flag_table      a row for each flag: what needs it, and which sliders raise it
shape_kinds     a row for each kind of shapes' records
light_kinds     a row for each kind of light
caustics        what paths of light begin with: lights, and targets that mirror or refract
media           what fills a scene's bodies, and the space around them
deltas          which materials are perfectly specular
features        what kernels are compiled with: a scene's flags before and after edits, its numbers of records
layout_glsl     the records of `gpu.layout` as GLSL: structs, loaders and constants
textures_glsl   how materials read textures, as GLSL
recipes_glsl    how textures are computed, as GLSL
words_glsl      records read from words, as GLSL
bodies_glsl     what fills shapes, as GLSL
instances_glsl  records of instances as GLSL
measured_glsl  records and tables of the model `measured` as GLSL
microfacets_glsl  parameters and tables of the model `microfacet` as GLSL
models_glsl     the functions that pick those of a material's model, as GLSL
source          shader text with its includes and flags; errors by file and line
binaries        machine code on disk, where the driver is a GPU's
cache           compiled kernels, with a bound on how many are in memory
"""
