"""Uploaded files are parsed in a child process, within limits of memory and time.

sandbox     the parent's side: starts the child, hands it a file, takes its arrays
child       the child's side: `python -m service.formats.sandbox.child`
cad_child   the same for STEP, whose library writes files in memory
readers     a mesh file -> arrays that the rest may trust; USD, a zip or MaterialX -> a scene
wire        messages between both, and arrays in shared memory
"""
