// The tree is threaded: it has one depth-first order for each octant of ray directions, nearer children first, so that
// a walk needs no stack. A missed box names the node where the walk goes on; after a met one it goes on at the next
// node. Small subtrees, treelets, are stored once for all octants and walked in one order; a register remembers where
// the walk goes on after them. Boxes are 16-bit coordinates on the scene's grid, rounded outwards.
//
// An instance is a leaf of the scene's tree with a tree of its own, through which the ray goes in its space.
//
// One loop finds leaves and another tests them, as llvmpipe runs both sides of every `if`, but ends loops early. A ray
// that has met a leaf walks on to a second one while its neighbours have still to meet their first: in a mesh's bounces
// this takes 1.7 times fewer turns of the outer loop, for 4 % more boxes.

// The factor by which far distances grow against rounding in the slab test [Ize 2013]: 1 + 2 gamma(3), rounded up.
const float TRAVERSE_SLACK = 1.0000007;
// The share of the way to a lamp up to which boxes are entered. Else every shadow ray would walk down the boxes of the
// lamp and its neighbours, which are a whole step of the grid larger than the lamps: half the time of a room with 1 000
// lamps. A shape nearer to a lamp than 2^-16 of the distance casts no shadow.
const float TRAVERSE_REACH = 0.9999847;

struct Hit {
    float t;
    uint id; // kind << 28 | index; in an instance: see instance_id
    vec2 uv; // barycentric, triangles only
};

struct LeafRange {
    uint kind;
    uint index;
    uint end;
};

LeafRange traverse_range(uint leaf) {
    uint first = leaf & LEAF_FIRST_MASK;
    return LeafRange((leaf >> LEAF_KIND_SHIFT) & 7u, first, first + ((leaf >> LEAF_COUNT_SHIFT) & 15u) + 1u);
}

#if HAS_INSTANCES
// The tree that a walk is in: that of an instance, or the scene's where `number` is NONE.
struct Within {
    uint number;
    uint node_first;
    uint first; // triangle
    uint material;
};

void traverse_test(uint kind, uint index, vec3 o, vec3 d, Shear shear, Within at, uvec2 skip, inout Hit hit) {
    uint id = at.number != NONE ? instance_id(at.number, index) : (kind << LEAF_KIND_SHIFT) | index;
#else
void traverse_test(uint kind, uint index, vec3 o, vec3 d, Shear shear, uvec2 skip, inout Hit hit) {
    uint id = (kind << LEAF_KIND_SHIFT) | index;
#endif
    float t = hit.t;
    vec2 uv = hit.uv;
#if HAS_BVH_SPHERES
    if (kind == SHAPE_SPHERE) t = sphere_hit(sphere_tree_load(index), o, d, hit.t);
#endif
#if HAS_BVH_QUADS
    if (kind == SHAPE_QUAD) t = quad_hit(quad_tree_load(index), o, d, hit.t);
#endif
#if HAS_BVH_BOXES
    if (kind == SHAPE_BOX) t = box_hit(box_tree_load(index), o, d, hit.t);
#endif
#if HAS_BVH_ELLIPSOIDS
    if (kind == SHAPE_ELLIPSOID) t = ellipsoid_hit(ellipsoid_tree_load(index), o, d, hit.t);
#endif
#if HAS_INSTANCES
    if (kind == SHAPE_TRIANGLE) {
        Triangle tri = triangle_tree_load(at.first + index);
        if (at.number != NONE) tri.material = at.material;
        t = triangle_hit(tri, shear, d, hit.t, uv);
    }
#elif HAS_BVH_TRIANGLES
    if (kind == SHAPE_TRIANGLE) t = triangle_hit(triangle_tree_load(index), shear, d, hit.t, uv);
#endif
    if (t < hit.t && id != skip.x && id != skip.y) hit = Hit(t, id, uv);
}

// Finds the nearest hit before hit.t, or with `any` some hit.
void traverse_tree(vec3 o, vec3 d, Shear shear, uvec2 skip, bool any, inout Hit hit) {
    vec3 safe = mix(d, vec3(1e-20), lessThan(abs(d), vec3(1e-20)));
    vec3 inv = 1.0 / safe;
    vec3 scale = frame.node_scale * inv, bias = (frame.node_origin - o) * inv;
    uvec3 swap = 16u * uvec3(lessThan(safe, vec3(0.0))); // which half is the nearer side
    uvec3 swap_far = 16u - swap;
    uint octant = (safe.x < 0.0 ? 1u : 0u) | (safe.y < 0.0 ? 2u : 0u) | (safe.z < 0.0 ? 4u : 0u);
    uint i = octant * frame.node_count;
    uint end = i + (any && hit.id != NONE ? 0u : frame.node_count); // the loops may have met something already
    uint treelets = 8u * frame.node_count;
    uint after = 0u, last = NONE; // where the walk goes on after a treelet, and where that ends; NONE: it is in none
    bool more;
    float start = hit.t;
#if HAS_INSTANCES
    // In an instance o and d are the ray in the instance's space, where t is the same. `on` and its kin say where the
    // walk goes on in the scene's tree.
    vec3 o_w = o, d_w = d;
    Within at = Within(NONE, frame.node_first, 0u, 0u);
    bool ended = any && hit.id != NONE; // the walk ended before it began
    uint on = 0u, on_after = 0u, on_last = NONE;
#endif
    float reach = any && skip.y != NONE ? TRAVERSE_REACH : TRAVERSE_SLACK;
#if HAS_INSTANCES
    uint met_instance = NONE; // the instance that ends a stretch of the walk; NONE: the end of a tree does
    do {
    met_instance = NONE;
#endif
    do {
        uint leaf = 0u, earlier = 0u; // the last two leaves that were met
        do {
#if HAS_INSTANCES
            uvec4 w = node_words[at.node_first + i];
#else
            uvec4 w = node_words[i];
#endif
            vec3 lo = vec3((w.xyz >> swap) & 0xffffu) * scale + bias;
            vec3 hi = vec3((w.xyz >> swap_far) & 0xffffu) * scale + bias;
            float near = max(max(lo.x, lo.y), max(lo.z, 0.0));
            float far = min(min(min(hi.x, hi.y), hi.z) * TRAVERSE_SLACK, hit.t * reach);
            bool met = near <= far;
            bool is_leaf = (w.w & LEAF_BIT) != 0u;
#if HAS_INSTANCES
            bool is_instance = (w.w ^ LEAF_BIT) >> LEAF_KIND_SHIFT == SHAPE_INSTANCE;
            if (met && is_instance && !ended) met_instance = w.w & LEAF_FIRST_MASK;
            if (met && is_leaf && !is_instance) {
#else
            if (met && is_leaf) {
#endif
                earlier = leaf;
                leaf = w.w;
            }
            bool is_treelet = (w.w & (LEAF_BIT | TREELET_BIT)) == TREELET_BIT;
            uint next = met || is_leaf || is_treelet ? i + 1u : w.w;
            if (met && is_treelet) {
                after = next;
                next = treelets + (w.w & LEAF_FIRST_MASK);
                last = next + ((w.w >> LEAF_COUNT_SHIFT) & TREELET_MAX_NODES);
            }
            if (next == last) {
                next = after;
                last = NONE;
            }
            i = next;
            more = i < end || last != NONE;
#if HAS_INSTANCES
        } while (earlier == 0u && more && met_instance == NONE);
#else
        } while (earlier == 0u && more);
#endif
        if (leaf != 0u) {
            LeafRange range = traverse_range(leaf);
            do {
#if HAS_INSTANCES
                traverse_test(range.kind, range.index, o, d, shear, at, skip, hit);
#else
                traverse_test(range.kind, range.index, o, d, shear, skip, hit);
#endif
                range.index++;
                if (range.index == range.end) {
                    leaf = earlier;
                    earlier = 0u;
                    range = traverse_range(leaf);
                }
            } while (leaf != 0u && !(any && hit.t < start));
        }
#if HAS_INSTANCES
    } while (more && met_instance == NONE && !(any && hit.t < start));
    // All lanes change trees together: inside the loop above every leaf would pay for it, masked.
    bool enters = met_instance != NONE;
    if (enters || (!more && at.number != NONE)) {
        Instance it = instance_load(met_instance);
        if (enters) {
            on = i;
            on_after = after;
            on_last = last;
        }
        o = enters ? instance_rows(it, o_w - it.center) : o_w;
        d = enters ? instance_rows(it, d_w) : d_w;
        at = enters ? Within(met_instance, it.node_first, it.first, it.material)
                    : Within(NONE, frame.node_first, 0u, 0u);
        shear = triangle_shear(o, d);
        safe = mix(d, vec3(1e-20), lessThan(abs(d), vec3(1e-20)));
        inv = 1.0 / safe;
        scale = (enters ? it.node_scale : frame.node_scale) * inv;
        bias = ((enters ? it.node_origin : frame.node_origin) - o) * inv;
        swap = 16u * uvec3(lessThan(safe, vec3(0.0)));
        swap_far = 16u - swap;
        octant = (safe.x < 0.0 ? 1u : 0u) | (safe.y < 0.0 ? 2u : 0u) | (safe.z < 0.0 ? 4u : 0u);
        uint count = enters ? it.node_count : frame.node_count;
        i = enters ? octant * count : on;
        end = octant * count + count;
        treelets = 8u * count;
        after = on_after;
        last = enters ? NONE : on_last;
        more = i < end || last != NONE;
    }
    } while (more && !(any && hit.t < start));
#else
    } while (more && !(any && hit.t < start));
#endif
}
