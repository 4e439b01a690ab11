"""Arrays as OpenGL objects.

scene     a scene on the device: its buffers, its flags, and the edits that need no upload
buffers   the arrays of a scene as buffers, and their upload after shapes have moved
lamps     the lamps that distances in media are drawn towards
tables    the tables that kernels look up, as textures
textures  images and rows of numbers as textures
uploads   what several scenes read, uploaded once
blank     a dispatch after which a software driver has nothing of released scenes
pinned    buffers that are the caller's own memory, on a software renderer
"""
