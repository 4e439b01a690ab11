// What a ray passes through without being scattered: shapes that hide from the camera, and surfaces by the chance that
// they are not met.
const uint PAIR_PASSING = 0x8000u; // beyond the pairs of any path; then PASSING_MAX a bounce
const uint PASSING_MAX = 4096u;    // layers; a ray that has met so many ends on the next

// Nearest thing that the ray meets, n.t from o. `bounce`: how often the path was scattered before; 0: a camera ray.
Nearest passing_nearest(vec3 o, vec3 d, uint skip, uint bounce, Sampler rng, out Point at) {
#if HAS_OPACITY || HAS_HIDDEN_SHAPES
    Nearest n;
    float before = 0.0;
    uint layer = 0u;
    bool passes;
    do {
        n = shapes_nearest(o, d, skip);
        at = shapes_point(n, o, d);
        passes = false;
#if HAS_HIDDEN_SHAPES
        passes = bounce == 0u && (at.shape & HIDDEN) != 0u;
#endif
#if HAS_OPACITY
        float u = sobol_pair(rng, PAIR_PASSING + bounce * PASSING_MAX + layer).x;
#if HAS_TEXTURES
        passes = passes || u >= texture_opacity(at);
#else
        passes = passes || u >= material_pick(at.material).opacity;
#endif
#endif
        passes = passes && n.id != NONE && layer < PASSING_MAX;
        n.t += before;
        if (passes) {
            before = n.t;
            o = shapes_leave(at, d);
            skip = at.flat_id;
        }
        layer++;
    } while (passes);
#else
    Nearest n = shapes_nearest(o, d, skip);
    at = shapes_point(n, o, d);
#endif
    return n;
}

#if HAS_OPACITY
// Share of light that comes through all surfaces in (0, t_max): the mean of what the ray above would meet. `skip` as
// in shapes_occluded.
float passing_share(vec3 o, vec3 d, float t_max, uvec2 skip) {
    float share = 1.0;
    uint layer = 0u;
    bool more;
    do {
        Nearest n = Nearest(t_max, NONE, vec2(0.0));
        shapes_intersect(o, d, skip, false, n);
        Point at = shapes_point(n, o, d);
        more = n.id != NONE;
        if (more) {
#if HAS_TEXTURES
            share *= layer < PASSING_MAX ? 1.0 - texture_opacity(at) : 0.0;
#else
            share *= layer < PASSING_MAX ? 1.0 - material_pick(at.material).opacity : 0.0;
#endif
            o = shapes_leave(at, d);
            skip.x = at.flat_id;
            t_max -= n.t;
        }
        layer++;
    } while (more && share > 0.0);
    return share;
}
#endif
