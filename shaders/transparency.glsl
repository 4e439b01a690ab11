// Surfaces that a ray passes without being scattered: shapes that hide from the camera, and others by the chance that
// their opacity leaves.
const uint PAIR_TRANSPARENCY = 0x8000u; // the first pair, beyond those of any path; each bounce has TRANSPARENCY_MAX
const uint TRANSPARENCY_MAX = 4096u;    // layers that a ray passes at most; it ends on the next one

// The nearest surface that the ray does not pass; hit.t is its distance from o. `bounce` is how often the path was
// scattered before: 0 for a camera ray.
Hit transparency_nearest(vec3 o, vec3 d, uint skip, uint bounce, Sampler rng, out SurfacePoint at) {
#if HAS_OPACITY || HAS_HIDDEN_SHAPES
    Hit hit;
    float before = 0.0;
    uint layer = 0u;
    bool passes;
    do {
        hit = shapes_nearest(o, d, skip);
        at = shapes_point(hit, o, d);
        passes = false;
#if HAS_HIDDEN_SHAPES
        passes = bounce == 0u && (at.shape & HIDDEN) != 0u;
#endif
#if HAS_OPACITY
        float u = sobol_pair(rng, PAIR_TRANSPARENCY + bounce * TRANSPARENCY_MAX + layer).x;
#if HAS_TEXTURES
        passes = passes || u >= texture_opacity(at);
#else
        passes = passes || u >= material_pick(at.material).opacity;
#endif
#endif
        passes = passes && hit.id != NONE && layer < TRANSPARENCY_MAX;
        hit.t += before;
        if (passes) {
            before = hit.t;
            o = shapes_leave(at, d);
            skip = at.flat_id;
        }
        layer++;
    } while (passes);
#else
    Hit hit = shapes_nearest(o, d, skip);
    at = shapes_point(hit, o, d);
#endif
    return hit;
}

#if HAS_OPACITY
// The share of light that passes all surfaces in (0, t_max), which is the mean of what the rays above do. `skip` is as
// in shapes_occluded.
float transparency_share(vec3 o, vec3 d, float t_max, uvec2 skip) {
    float share = 1.0;
    uint layer = 0u;
    bool more;
    do {
        Hit hit = Hit(t_max, NONE, vec2(0.0));
        shapes_intersect(o, d, skip, false, hit);
        SurfacePoint at = shapes_point(hit, o, d);
        more = hit.id != NONE;
        if (more) {
#if HAS_TEXTURES
            share *= layer < TRANSPARENCY_MAX ? 1.0 - texture_opacity(at) : 0.0;
#else
            share *= layer < TRANSPARENCY_MAX ? 1.0 - material_pick(at.material).opacity : 0.0;
#endif
            o = shapes_leave(at, d);
            skip.x = at.flat_id;
            t_max -= hit.t;
        }
        layer++;
    } while (more && share > 0.0);
    return share;
}
#endif
