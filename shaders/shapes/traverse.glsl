// The tree is threaded: it has one depth-first order for each octant of ray directions, nearer children first, so that
// a walk needs no stack. A box that the ray misses names the node where the walk goes on; after a box that it hits, the
// walk goes on at the next node. Small subtrees, treelets, are stored once for all octants and walked in one order; a
// register remembers where the walk goes on after them. Boxes are 16-bit coordinates on the tree's grid, rounded
// outwards.
//
// An instance is a leaf of the scene's tree with a tree of its own, through which the ray goes in its space.
//
// One loop finds leaves and another tests them, as llvmpipe runs both sides of every `if`, but ends loops early. A ray
// that has found a leaf walks on to a second one while its neighbours still look for their first: in a mesh's bounces
// this takes 1.7 times fewer turns of the outer loop, for 4 % more boxes.

// The factor by which far distances grow against rounding in the slab test [Ize 2013]: 1 + 2 gamma(3), twice, as GLSL
// allows a division 2.5 ulp and GPUs take up to 2.
const float TRAVERSE_SLACK = 1.0000014;
// The share of the way to a lamp up to which boxes are entered. Else every shadow ray would walk down the boxes of the
// lamp and its neighbours, which are a whole step of the grid larger than the lamps: half the time of a room with 1 000
// lamps. A shape nearer to a lamp than 2^-16 of the distance casts no shadow.
const float TRAVERSE_REACH = 0.9999847;

#include "shapes/budget.glsl"

struct Hit {
    float t;
    uint id; // kind << LEAF_KIND_SHIFT | index; in an instance: see instance_id
    vec2 uv; // barycentric, triangles only
};

#if HAS_BVH
struct LeafRange {
    uint kind;
    uint index;
    uint end;
};

LeafRange traverse_range(uint leaf) {
    uint first = leaf & LEAF_FIRST_MASK;
    return LeafRange((leaf >> LEAF_KIND_SHIFT) & 7u, first, first + ((leaf >> LEAF_COUNT_SHIFT) & 15u) + 1u);
}

// The tree that a walk is in: that of an instance, or the scene's.
struct Tree {
    uint instance; // the number of the instance, or NONE
    uint node_first;
    uint node_count; // in one octant's order
    vec3 grid_origin;
    vec3 grid_scale;
    uint triangle_first;
    uint material; // that an instance gives its triangles
};

Tree traverse_scene_tree() {
    Tree tree = Tree(NONE, 0u, uniforms.node_count, uniforms.node_origin, uniforms.node_scale, 0u, 0u);
#if HAS_INSTANCES
    tree.node_first = uniforms.node_first;
#endif
    return tree;
}

// A ray in the space of a tree, ready for the tests of boxes and shapes.
struct TreeRay {
    vec3 o;
    vec3 d;
    Shear shear;
    vec3 scale, bias;            // on each axis the ray comes to the grid's coordinate x after t = x * scale + bias
    uvec3 near_shift, far_shift; // to those halves of a node's words that are its box's nearer and farther sides
    uint octant;
};

TreeRay traverse_ray(Tree tree, vec3 o, vec3 d, Shear shear) {
    vec3 safe = mix(d, vec3(1e-20), lessThan(abs(d), vec3(1e-20)));
    vec3 inv = 1.0 / safe;
    uvec3 shift = 16u * uvec3(lessThan(safe, vec3(0.0)));
    uint octant = (safe.x < 0.0 ? 1u : 0u) | (safe.y < 0.0 ? 2u : 0u) | (safe.z < 0.0 ? 4u : 0u);
    return TreeRay(o, d, shear, tree.grid_scale * inv, (tree.grid_origin - o) * inv, shift, 16u - shift, octant);
}

// Whether the ray is in the box somewhere in [0, t_max].
bool traverse_box(TreeRay ray, uvec3 box, float t_max) {
    vec3 lo = vec3((box >> ray.near_shift) & 0xffffu) * ray.scale + ray.bias;
    vec3 hi = vec3((box >> ray.far_shift) & 0xffffu) * ray.scale + ray.bias;
    float near = max(max(lo.x, lo.y), max(lo.z, 0.0));
    float far = min(min(min(hi.x, hi.y), hi.z) * TRAVERSE_SLACK, t_max);
    return near <= far;
}

// How far a walk down a tree is.
struct Walk {
    uint node, end;   // the next node, and the end of the order that it is in
    uint treelets;    // the tree's first treelet
    uint after, last; // where the walk goes on after a treelet, and where that ends; `last` is NONE outside treelets
};

Walk traverse_begin(Tree tree, uint octant) {
    uint first = octant * tree.node_count;
    return Walk(first, first + tree.node_count, 8u * tree.node_count, 0u, NONE);
}

bool traverse_more(Walk walk) { return walk.node < walk.end || walk.last != NONE; }

// Goes on to the next node, from one whose box the ray `hits` or misses.
void traverse_step(uint link, bool hits, inout Walk walk) {
    bool is_leaf = (link & LEAF_BIT) != 0u, is_treelet = (link & (LEAF_BIT | TREELET_BIT)) == TREELET_BIT;
    uint next = hits || is_leaf || is_treelet ? walk.node + 1u : link;
    if (hits && is_treelet) {
        walk.after = next;
        next = walk.treelets + (link & LEAF_FIRST_MASK);
        walk.last = next + ((link >> LEAF_COUNT_SHIFT) & TREELET_MAX_NODES);
    }
    if (next == walk.last) {
        next = walk.after;
        walk.last = NONE;
    }
    walk.node = next;
}

// What a walk has found: links of leaves, 0 where there is none, and the instance that it stops at, or NONE.
struct Found {
    uint leaf, earlier; // the last leaf, and the one before it
    uint instance;
};

bool traverse_is_instance(uint link) {
#if HAS_INSTANCES
    return (link ^ LEAF_BIT) >> LEAF_KIND_SHIFT == SHAPE_INSTANCE;
#else
    return false;
#endif
}

// Walks on through boxes to two leaves, to an instance or to the end of the tree.
Found traverse_boxes(Tree tree, TreeRay ray, float t_max, inout Walk walk) {
    Found found = Found(0u, 0u, NONE);
    do {
        uvec4 node = node_words[tree.node_first + walk.node];
        bool hits = traverse_box(ray, node.xyz, t_max);
        bool is_instance = traverse_is_instance(node.w);
        if (hits && is_instance) found.instance = node.w & LEAF_FIRST_MASK;
        if (hits && (node.w & LEAF_BIT) != 0u && !is_instance) {
            found.earlier = found.leaf;
            found.leaf = node.w;
        }
        traverse_step(node.w, hits, walk);
        budget_left--;
    } while (found.earlier == 0u && found.instance == NONE && traverse_more(walk));
    return found;
}

uint traverse_id(Tree tree, uint kind, uint index) {
    uint id = (kind << LEAF_KIND_SHIFT) | index;
#if HAS_INSTANCES
    if (tree.instance != NONE) id = instance_id(tree.instance, index);
#endif
    return id;
}

Triangle traverse_triangle(Tree tree, uint index) {
    Triangle tri = triangle_tree_load(tree.triangle_first + index);
    if (tree.instance != NONE) tri.material = tree.material;
    return tri;
}

// Tests one shape of a leaf.
void traverse_test(Tree tree, TreeRay ray, uint kind, uint index, uvec2 skip, inout Hit hit) {
    uint id = traverse_id(tree, kind, index);
    float t = hit.t;
    vec2 uv = hit.uv;
#if HAS_BVH_SPHERES
    if (kind == SHAPE_SPHERE) t = sphere_hit(sphere_tree_load(index), ray.o, ray.d, hit.t);
#endif
#if HAS_BVH_QUADS
    if (kind == SHAPE_QUAD) t = quad_hit(quad_tree_load(index), ray.o, ray.d, hit.t);
#endif
#if HAS_BVH_BOXES
    if (kind == SHAPE_BOX) t = box_hit(box_tree_load(index), ray.o, ray.d, hit.t);
#endif
#if HAS_BVH_ELLIPSOIDS
    if (kind == SHAPE_ELLIPSOID) t = ellipsoid_hit(ellipsoid_tree_load(index), ray.o, ray.d, hit.t);
#endif
#if HAS_BVH_TRIANGLES || HAS_INSTANCES
    if (kind == SHAPE_TRIANGLE) t = triangle_hit(traverse_triangle(tree, index), ray.shear, ray.d, hit.t, uv);
#endif
    if (t < hit.t && id != skip.x && id != skip.y) hit = Hit(t, id, uv);
}

// Tests the shapes of the leaves that were found; with `any` it ends at the first hit before `start`.
void traverse_leaves(Tree tree, TreeRay ray, Found found, uvec2 skip, bool any, float start, inout Hit hit) {
    if (found.leaf != 0u) {
        LeafRange range = traverse_range(found.leaf);
        do {
            traverse_test(tree, ray, range.kind, range.index, skip, hit);
            range.index++;
            budget_left--;
            if (range.index == range.end) {
                found.leaf = found.earlier;
                found.earlier = 0u;
                range = traverse_range(found.leaf);
            }
        } while (found.leaf != 0u && !(any && hit.t < start));
    }
}

// Where a walk has stopped, enters the tree of the instance that was found, or returns from one to the scene's; false
// where the walk has ended. o and d are the ray in world space, where t is the same; scene_walk is where the walk goes
// on in the scene's tree. All lanes change trees together: inside the loops every leaf would pay for it, masked.
bool traverse_change_tree(uint instance, vec3 o, vec3 d, inout Tree tree, inout TreeRay ray, inout Walk walk,
                          inout Walk scene_walk) {
#if HAS_INSTANCES
    bool enters = instance != NONE;
    if (enters || (!traverse_more(walk) && tree.instance != NONE)) {
        Instance it = instance_load(instance);
        tree = traverse_scene_tree();
        if (enters) {
            tree = Tree(instance, it.node_first, it.node_count, it.node_origin, it.node_scale, it.first, it.material);
            o = instance_rows(it, o - it.center);
            d = instance_rows(it, d);
            scene_walk = walk;
        }
        ray = traverse_ray(tree, o, d, triangle_shear(o, d));
        walk = scene_walk;
        if (enters) walk = traverse_begin(tree, ray.octant);
    }
    return traverse_more(walk);
#else
    return false;
#endif
}

// Finds the nearest hit before hit.t, or with `any` some hit.
void traverse_scene(vec3 o, vec3 d, Shear shear, uvec2 skip, bool any, inout Hit hit) {
    Tree tree = traverse_scene_tree();
    TreeRay ray = traverse_ray(tree, o, d, shear);
    Walk walk = traverse_begin(tree, ray.octant), scene_walk = walk;
    float start = hit.t, reach = any && skip.y != NONE ? TRAVERSE_REACH : TRAVERSE_SLACK;
    Found found;
    do {
        do {
            found = traverse_boxes(tree, ray, hit.t * reach, walk);
            traverse_leaves(tree, ray, found, skip, any, start, hit);
        } while (traverse_more(walk) && found.instance == NONE && !(any && hit.t < start) && budget_lasts());
    } while (budget_lasts() && traverse_change_tree(found.instance, o, d, tree, ray, walk, scene_walk)
             && !(any && hit.t < start));
}
#endif
