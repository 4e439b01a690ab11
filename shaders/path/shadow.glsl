// Rays to lights. Surfaces with an opacity below 1 let a share of the light pass, and so do those that light goes straight
// through; all others hide it.
#if ANY_VEILS
// The type of a share of light: a colour where panes or media may tint it.
#if HAS_STRAIGHT || SHADOW_MEDIA
#define VEIL_SHARE vec3
#else
#define VEIL_SHARE float
#endif

struct Shadow {
    VEIL_SHARE share; // of the light that passes the surfaces so far
    Medium medium;    // around the ray
    uint layer;       // surfaces that it has passed
    uint left;        // those that it may yet go straight through
};

bool shadow_lit(float share) { return share > 0.0; }
bool shadow_lit(vec3 share) { return max_component(share) > 0.0; }

// Takes the ray past a surface, which may stop it.
void shadow_pass(SurfacePoint at, vec3 d, inout Shadow ray) {
    bool counts = transparency_counts(ray.layer);
    float opacity = 1.0;
#if HAS_PRIORITIES
    if (medium_hides(ray.medium, at, d)) {
        Medium body = medium_body(material_at(at), at.shape);
        if (dot(at.ng, d) > 0.0) ray.medium = medium_left(ray.medium, body);
        else ray.medium = medium_entered(ray.medium, body);
        return;
    }
#endif
#if HAS_OPACITY
    opacity = transparency_opacity(at, false);
#endif
    VEIL_SHARE passed = VEIL_SHARE(1.0 - opacity);
#if HAS_STRAIGHT
    vec3 straight = opacity * straight_share(at, d, ray.medium);
    if (ray.left == 0u) straight = vec3(0.0);
    else if (shadow_lit(straight)) ray.left--;
    passed += straight;
#endif
    ray.share *= counts ? passed : VEIL_SHARE(0.0);
}

// Whether the ray may pass a surface of that material.
bool shadow_may_pass(uint material) {
#if HAS_VERTEX_COLORS && HAS_OPACITY
    return true;
#elif HAS_PRIORITIES
    return true;
#elif HAS_STRAIGHT
    Material m = material_pick(material);
    return m.opacity < 1.0 || material_goes_straight(m);
#else
    return true;
#endif
}

// The next surface: of those in loops alone where another walk goes through the tree. There is none where the ray must
// come to the surfaces in their order, to know in which bodies it is (SHADOW_MEDIA).
void shadow_next(vec3 o, vec3 d, uvec2 skip, inout Hit hit) {
    budget_left -= int(uint(SPHERE_LOOP) + uint(QUAD_LOOP) + uint(BOX_LOOP) + uint(ELLIPSOID_LOOP) + uint(TRIANGLE_LOOP));
#if !HAS_BVH || !OPACITY_WALK || SHADOW_MEDIA
    shapes_intersect(o, d, skip, false, hit);
#else
    shapes_loops(o, d, triangle_shear(o, d), skip, hit);
#endif
}

// Goes through the shapes in loops, or through all of them in order.
void shadow_loop(vec3 o, vec3 d, float t_max, uvec2 skip, inout Shadow ray) {
    bool more;
    do {
        Hit hit = Hit(t_max, NONE, vec2(0.0));
        shadow_next(o, d, skip, hit);
#if SHADOW_MEDIA
        ray.share *= medium_share(ray.medium, hit.t);
#endif
        more = hit.id != NONE && shadow_may_pass(shapes_material(hit));
        if (hit.id != NONE && !more) ray.share = VEIL_SHARE(0.0);
        // As a loop, because llvmpipe runs the body of an `if` for rays that pass nothing, too.
        for (bool passes = more; passes; passes = false) {
            SurfacePoint at = shapes_point(hit, o, d);
            shadow_pass(at, d, ray);
            o = shapes_leave(at, d);
            skip.x = at.flat_id;
            t_max -= hit.t;
        }
    } while (more && shadow_lit(ray.share));
}

#if HAS_BVH && OPACITY_WALK && !SHADOW_MEDIA
// Goes through the shapes of the tree.
void shadow_tree(vec3 o, vec3 d, float t_max, uvec2 skip, inout Shadow ray) {
    Passage on = transparency_begin(o, d);
    Hit hit = Hit(t_max, NONE, vec2(0.0));
    float reach = skip.y != NONE ? TRAVERSE_REACH : TRAVERSE_SLACK;
    bool more;
    do {
        Hit veil = transparency_advance(skip, reach, true, t_max, false, on, hit);
        if (hit.id != NONE) ray.share = VEIL_SHARE(0.0);
        more = veil.id != NONE;
        float left = t_max;
        vec3 from = o;
        while (veil.id != NONE && shadow_lit(ray.share)) {
#if HAS_STRAIGHT
            SurfacePoint at = shapes_point(veil, from, d);
#else
            SurfacePoint at = shapes_veil(veil, from, d);
#endif
            shadow_pass(at, d, ray);
            left -= veil.t;
            from = shapes_leave(at, d);
            veil = transparency_again(on, veil.id, from, skip, left);
        }
        if (!more) more = transparency_change_tree(o, d, on);
    } while (more && shadow_lit(ray.share) && budget_lasts());
}
#endif
#endif

// Whether light comes to o from the distance t along d; c loses what surfaces and bodies on the way take. `skip` is as in
// shapes_occluded; `left` is how many surfaces the ray may go straight through.
bool shadow_arrives(vec3 o, vec3 d, float t, uvec2 skip, Medium medium, uint left, inout vec3 c) {
#if ANY_VEILS
    Shadow ray = Shadow(VEIL_SHARE(1.0), medium, 0u, left);
#if !HAS_BVH || !OPACITY_WALK || SHADOW_MEDIA || HAS_SPHERES || HAS_QUADS || HAS_BOXES || HAS_ELLIPSOIDS || HAS_TRIANGLES
    shadow_loop(o, d, t, skip, ray);
#endif
#if HAS_BVH && OPACITY_WALK && !SHADOW_MEDIA
    if (shadow_lit(ray.share)) shadow_tree(o, d, t, skip, ray);
#endif
#if !SHADOW_MEDIA
    c *= medium_share(medium, t);
#endif
    c *= ray.share;
    return budget_lasts();
#else
    c *= medium_share(medium, t);
    return !shapes_occluded(o, d, t, skip) && budget_lasts();
#endif
}
