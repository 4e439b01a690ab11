"""The bits of words that link: a node of a tree to its children or its shapes, a ray to what it has hit."""

# A leaf's link: bit 31 set, kind << 28, (count - 1) << 24, first: index into the array of that kind
LEAF_BIT = 0x80000000
LEAF_KIND_SHIFT = 28
LEAF_COUNT_SHIFT = 24
LEAF_FIRST_MASK = 0x00FFFFFF
LEAF_MAX_COUNT = 16
# A hit: kind << LEAF_KIND_SHIFT, index. One in an instance: this, its number << frame.instance_shift, the triangle's
INSTANCED = 0x80000000
# A treelet's link: bit 31 not set, bit 30 set, nodes << LEAF_COUNT_SHIFT, first: from where the octants' orders end
TREELET_BIT = 0x40000000
TREELET_MAX_NODES = 63
# A link of the lights' tree: the pair of a node that is a cluster
CLUSTER_BIT = 0x40000000

LIGHT_CODES = 1 << 30  # numbers that lights are picked by, in a scene with a tree of them
