"""The trees that make rays and lights quick to find. Public; runs without GL, and loads numba.

bvh                  boxes -> a bounding volume hierarchy as `layout.Node` records
bvh_build            the loop that grows it over boxes
sah                  the split of a range of boxes, by the surface area heuristic
bvh_thread           the same tree in the depth-first order of each octant of ray directions, with skip links
light_tree           bounded lights -> a tree by which they are picked in proportion to their importance
light_tree_build     the loops that grow that tree and bound its nodes
light_tree_clusters  nodes of that tree whose lights are drawn by intensity alone from far away
"""
