"""The bits of words that link: a node of a tree to its children or its shapes, a ray to what it has hit."""

# A leaf's link has bit 31 set, kind << 28, (count - 1) << 24, and the index of its first shape in the kind's array.
LEAF_BIT = 0x80000000
LEAF_KIND_SHIFT = 28
LEAF_COUNT_SHIFT = 24
LEAF_FIRST_MASK = 0x00FFFFFF
LEAF_MAX_COUNT = 16
# A hit's id is kind << LEAF_KIND_SHIFT with the shape's index. In an instance it is this bit with the instance's
# number << uniforms.instance_shift and the triangle's index.
INSTANCED = 0x80000000
# A treelet's link has bit 31 clear, bit 30 set, its number of nodes << LEAF_COUNT_SHIFT, and the place of its first
# node, counted from the end of the octants' orders.
TREELET_BIT = 0x40000000
TREELET_MAX_NODES = 63
# In the lights' tree this bit marks the link of a node that is a cluster; the rest is the pair of its children.
CLUSTER_BIT = 0x40000000

LIGHT_CODES = 1 << 30  # how many random numbers there are by which lights are picked from a tree
