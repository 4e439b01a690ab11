"""Textures -> texels, and which number of which material reads which of them.

uses     the references of materials to textures, and the charts that they need
recipes  textures that are computed -> their recipes, and the colours that they can have
images   images -> texels one after another
heights  heights as numbers, where they move meshes
words    everything that kernels read of textures behind each material, as words
"""
