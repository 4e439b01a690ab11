"""Shapes -> records, triangles and the tree over them, relative to an origin near the camera.

assemble          the geometry of a whole scene, with parts of earlier ones
geometry          the dataclass of the result, and the finished arrays of all triangles
world             the document's shapes in world space: analytic ones, meshes and instances, in float64
analytic          spheres, quads, boxes and ellipsoids in world space
shape_kinds       a row for each kind of shape but meshes: what it becomes of these, and what others ask of it
meshes            meshes in world space, and their triangles as records
displacement      meshes that a height moves, cut until their edges are short enough
vertex_normals    smooth normals at the corners, and their codes
corner_angles     the loop over faces that finds these, as machine code
tangents          the directions that a material's highlights and normal maps run along
instances         meshes that several shapes share, each with a tree of its own, and the records of these shapes
scene_bvh         the tree over the scene, and the few shapes that stand in a loop instead
records           analytic shapes -> records with their bounds
shape_records     members of the records of all kinds: hidden shapes, lights, what fills shapes, solid coordinates
rebase            the origin that float32 coordinates are relative to
parallel          work over many rows, in threads
warnings          equal warnings about many shapes as one with a count; odd meshes whose materials show it
"""
