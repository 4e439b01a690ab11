"""Uploaded files are parsed in a child process, within limits of memory and time.

sandbox     the parent's side: starts the child, hands it a file, takes its arrays
child       the child's side: `python -m service.formats.sandbox.child`
wire        messages between both, and arrays in shared memory
parse_mesh  a mesh file -> arrays that the rest may trust
parse_usd   a USD file -> a scene or its triangles, where the extra is installed
parse_zip   a zip, or MaterialX -> a scene, or materials with their textures
"""
