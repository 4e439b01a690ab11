// Walks through shapes that may let rays pass. One walk down the tree meets all of them, in any order, and opaque ones
// end it or shorten it as they do elsewhere. At a surface that is not surely opaque the walk stops until the other
// lanes have found one, too: opacities that were read in the loop over a leaf's shapes would be read for all of them.
#if ANY_VEILS
// The chance that a ray meets the surface. `hides`: hidden shapes let it pass.
float transparency_opacity(SurfacePoint at, bool hides) {
#if HAS_TEXTURES
    float opacity = texture_opacity(at);
#else
    float opacity = material_pick(at.material).opacity;
#endif
#if HAS_HIDDEN_SHAPES
    if (hides && (at.shape & HIDDEN) != 0u) opacity = 0.0;
#endif
    return opacity;
}

#if HAS_BVH && OPACITY_WALK
// Whether all of a shape of the tree is opaque, as far as it is known without its texture coordinates. `straight`: light
// that goes straight through a surface passes it.
bool transparency_is_opaque(Tree tree, uint kind, uint index, bool hides, bool straight) {
#if HAS_VERTEX_COLORS && HAS_OPACITY
    return false;
#else
    uint material = 0u, shape = 0u;
#if HAS_BVH_SPHERES
    if (kind == SHAPE_SPHERE) {
        Sphere s = sphere_tree_load(index);
        material = s.material;
        shape = s.shape;
    }
#endif
#if HAS_BVH_QUADS
    if (kind == SHAPE_QUAD) {
        Quad s = quad_tree_load(index);
        material = s.material;
        shape = s.shape;
    }
#endif
#if HAS_BVH_BOXES
    if (kind == SHAPE_BOX) {
        Solid s = box_tree_load(index);
        material = s.material;
        shape = s.shape;
    }
#endif
#if HAS_BVH_ELLIPSOIDS
    if (kind == SHAPE_ELLIPSOID) {
        Solid s = ellipsoid_tree_load(index);
        material = s.material;
        shape = s.shape;
    }
#endif
#if HAS_BVH_TRIANGLES || HAS_INSTANCES
    if (kind == SHAPE_TRIANGLE) {
        Triangle s = traverse_triangle(tree, index);
        material = s.material;
        shape = tree.instance != NONE ? HIDDEN : s.shape; // of an instance it is not at hand
    }
#endif
    Material m = material_pick(material);
    bool opaque = m.opacity >= 1.0 && !(straight && material_goes_straight(m));
#if HAS_HIDDEN_SHAPES
    opaque = opaque && !(hides && (shape & HIDDEN) != 0u);
#endif
    return opaque;
#endif
}

// A walk that stops at surfaces which may let the ray pass.
struct Passage {
    Tree tree;
    TreeRay ray;
    Walk walk, scene_walk;
    Found found;     // leaves that are not yet tested, or an instance that is not yet entered
    LeafRange range; // the shapes that are left of the first of these leaves
};

Passage transparency_begin(vec3 o, vec3 d) {
    Passage on;
    on.tree = traverse_scene_tree();
    on.ray = traverse_ray(on.tree, o, d, triangle_shear(o, d));
    on.walk = on.scene_walk = traverse_begin(on.tree, on.ray.octant);
    on.found = Found(0u, 0u, NONE);
    on.range = LeafRange(0u, 0u, 0u);
    return on;
}

// Tests the next shape of a leaf: `hit` becomes the nearest one that is surely opaque, `veil` one before it that may
// not be.
void transparency_test(uvec2 skip, bool hides, bool straight, inout Passage on, inout Hit hit, inout Hit veil) {
    Hit next = Hit(hit.t, NONE, vec2(0.0));
    traverse_test(on.tree, on.ray, on.range.kind, on.range.index, skip, next);
    if (next.id != NONE) {
        if (transparency_is_opaque(on.tree, on.range.kind, on.range.index, hides, straight)) hit = next;
        else veil = next;
    }
    on.range.index++;
    budget_left--;
    if (on.range.index == on.range.end) {
        on.found.leaf = on.found.earlier;
        on.found.earlier = 0u;
        on.range = traverse_range(on.found.leaf);
    }
}

// Walks on to a surface before hit.t that may not be opaque, or to the end of the tree where there is none; with `any`
// also to an opaque one before `start`, as a ray to a light does.
Hit transparency_advance(uvec2 skip, float reach, bool any, float start, bool hides, inout Passage on, inout Hit hit) {
    Hit veil = Hit(0.0, NONE, vec2(0.0));
    do {
        if (on.found.leaf == 0u && on.found.instance == NONE && traverse_more(on.walk)) {
            on.found = traverse_boxes(on.tree, on.ray, hit.t * reach, on.walk);
            on.range = traverse_range(on.found.leaf);
        }
        if (on.found.leaf != 0u) {
            do transparency_test(skip, hides, any, on, hit, veil);
            while (on.found.leaf != 0u && veil.id == NONE && !(any && hit.t < start));
        }
    } while (veil.id == NONE && on.found.instance == NONE && traverse_more(on.walk) && !(any && hit.t < start));
    return veil;
}

// Goes on from the end of a tree; false where the walk has ended.
bool transparency_change_tree(vec3 o, vec3 d, inout Passage on) {
    bool more = traverse_change_tree(on.found.instance, o, d, on.tree, on.ray, on.walk, on.scene_walk);
    on.found.instance = NONE;
    return more;
}

// The next hit of the ray, which goes on `from` a surface that it passed, with that shape before t_max: it comes out of
// solids again. NONE after other shapes.
Hit transparency_again(Passage on, uint id, vec3 from, uvec2 skip, float t_max) {
    Hit hit = Hit(t_max, NONE, vec2(0.0));
#if HAS_BVH_SPHERES || HAS_BVH_BOXES || HAS_BVH_ELLIPSOIDS
    uint kind = id >> LEAF_KIND_SHIFT;
    on.ray.o = from;
    if (kind == SHAPE_SPHERE || kind == SHAPE_BOX || kind == SHAPE_ELLIPSOID) {
        traverse_test(on.tree, on.ray, kind, id & LEAF_FIRST_MASK, skip, hit);
    }
#endif
    return hit;
}
#endif
#endif
