// Surfaces that a ray passes without being scattered: shapes that are hidden from the camera, and other shapes with
// probability 1 - opacity.
const uint PAIR_TRANSPARENCY = 0x8000u; // the first pair, beyond those of any path; each bounce has TRANSPARENCY_MAX
const uint TRANSPARENCY_MAX = 4096u;    // most layers that a ray passes; it ends at the next one

#include "shapes/transparency_walk.glsl"

// Counts a layer, and returns whether the ray may pass it.
bool transparency_counts(inout uint layer) {
    budget_left -= BUDGET_LAYER;
    return layer++ < TRANSPARENCY_MAX && budget_lasts();
}

#if HAS_OPACITY
// Whether the ray passes the surface. Independent of the order of traversal, because every layer draws a fresh number.
bool transparency_passes(SurfacePoint at, uint bounce, Sampler rng, inout uint layer) {
    float u = sobol_pair(rng, PAIR_TRANSPARENCY + bounce * TRANSPARENCY_MAX + layer).x;
    return transparency_counts(layer) && u >= transparency_opacity(at, bounce == 0u);
}

// The next layer: a shape that stands in a loop. Kernels without OPACITY_WALK look for those of the tree here, too.
void transparency_next(vec3 o, vec3 d, uvec2 skip, inout Hit hit) {
    budget_left -= int(uint(SPHERE_LOOP) + uint(QUAD_LOOP) + uint(BOX_LOOP) + uint(ELLIPSOID_LOOP) + uint(TRIANGLE_LOOP));
#if OPACITY_WALK
    shapes_loops(o, d, triangle_shear(o, d), skip, hit);
#else
    shapes_intersect(o, d, skip, false, hit);
#endif
}

// The nearest of the shapes in loops that the ray does not pass.
Hit transparency_nearest_loop(vec3 o, vec3 d, uint skip, uint bounce, Sampler rng, inout uint layer,
                              out SurfacePoint at) {
    Hit hit;
    float before = 0.0;
    bool passes;
    do {
        hit = Hit(INFINITY_T, NONE, vec2(0.0));
        transparency_next(o, d, uvec2(skip, NONE), hit);
        at = shapes_point(hit, o, d);
        passes = hit.id != NONE && transparency_passes(at, bounce, rng, layer);
        hit.t += before;
        if (passes) {
            before = hit.t;
            o = shapes_leave(at, d);
            skip = at.flat_id;
        }
    } while (passes);
    return hit;
}

#if HAS_BVH && OPACITY_WALK
// Makes `hit` the nearest of the shapes in the tree that the ray does not pass, where one is before it.
void transparency_nearest_tree(vec3 o, vec3 d, uvec2 skip, uint bounce, Sampler rng, inout uint layer, inout Hit hit) {
    Passage on = transparency_begin(o, d);
    bool more;
    do {
        Hit veil = transparency_advance(skip, TRAVERSE_SLACK, false, INFINITY_T, bounce == 0u, on, hit);
        more = veil.id != NONE;
        if (more) {
            Hit next = veil;
            vec3 from = o;
            bool passes;
            do {
                SurfacePoint at = shapes_veil(next, from, d);
                passes = transparency_passes(at, bounce, rng, layer);
                if (!passes) hit = veil;
                from = shapes_leave(at, d);
                next = transparency_again(on, veil.id, from, skip, hit.t - veil.t);
                veil.t += next.t;
            } while (passes && next.id != NONE);
        } else {
            more = transparency_change_tree(o, d, on);
        }
    } while (more && budget_lasts());
}
#endif

#endif

// The nearest surface that the ray does not pass; hit.t is its distance from o. `bounce` is how often the path was
// scattered before: 0 for a camera ray.
Hit transparency_nearest(vec3 o, vec3 d, uint skip, uint bounce, Sampler rng, out SurfacePoint at) {
#if HAS_OPACITY
    Hit hit = Hit(INFINITY_T, NONE, vec2(0.0));
    uint layer = 0u;
#if !HAS_BVH || !OPACITY_WALK || HAS_SPHERES || HAS_QUADS || HAS_BOXES || HAS_ELLIPSOIDS || HAS_TRIANGLES
    hit = transparency_nearest_loop(o, d, skip, bounce, rng, layer, at);
#endif
#if HAS_BVH && OPACITY_WALK
    transparency_nearest_tree(o, d, uvec2(skip, NONE), bounce, rng, layer, hit);
    at = shapes_point(hit, o, d);
#endif
#elif HAS_HIDDEN_SHAPES
    Hit hit;
    float before = 0.0;
    vec3 from = o;
    uint layer = 0u;
    bool passes;
    do {
        hit = shapes_nearest(from, d, skip);
        at = shapes_point(hit, from, d);
        passes = bounce == 0u && (at.shape & HIDDEN) != 0u && hit.id != NONE && transparency_counts(layer);
        hit.t += before;
        if (passes) {
            before = hit.t;
            from = shapes_leave(at, d);
            skip = at.flat_id;
        }
    } while (passes);
#else
    Hit hit = shapes_nearest(o, d, skip);
    at = shapes_point(hit, o, d);
#endif
    return hit;
}
