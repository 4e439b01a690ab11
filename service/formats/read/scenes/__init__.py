"""Parts that the importers of whole scenes share.

part_files  meshes and images that become assets of their own, equal ones once
ply_writer  a mesh as a PLY file, for the store
placements  the transforms of all meshes, for the camera and the metering
looks       how a document's materials look from far
metering    the exposure that suits a file's lights
framing     a camera that shows everything
room        a camera inside of closed rooms
rays        rays against a file's triangles
plain_mesh  the scene around a single mesh
wrapping    images beyond their edges, and whether a mesh reads them there
names       names for materials and textures
warnings    warnings about a file, equal ones once
"""
