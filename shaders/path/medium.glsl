// Bodies that absorb light. Their rates add up, so that nested or overlapping bodies may be entered and left in any
// order; a ray that is in two bodies loses light to both.
struct Medium {
#if HAS_ATTENUATION
    vec3 rate;   // of attenuation, 1/m: the sum over all bodies around the ray
    float depth; // the number of these bodies
#else
    float unused; // a struct must have a member; every kernel passes media on
#endif
};

// The share of light that is left after t metres.
vec3 medium_share(Medium m, float t) {
#if HAS_ATTENUATION
    return exp(-m.rate * t);
#else
    return vec3(1.0);
#endif
}

// Whether the ray is inside a body.
bool medium_around(Medium m) {
#if HAS_ATTENUATION
    return m.depth > 0.5;
#else
    return false;
#endif
}

#if HAS_ATTENUATION
const float MEDIUM_WALL = 1e20; // 1/m; a rate above absorbs all light and would round away the others in a sum
const uint MEDIUM_LAYERS = 4096u; // surfaces that the search below passes at most
// The direction of the search, off the camera's axes, where meshes tend to have their edges.
const vec3 MEDIUM_SEARCH = vec3(0.1371, 0.0713, -1.0);

Medium medium_entered(Medium m, vec3 rate) { return Medium(m.rate + rate, m.depth + 1.0); }

// Leaving the last body leaves no rate at all: a texture may have given the body another rate where it was entered.
Medium medium_left(Medium m, vec3 rate) {
    if (m.depth > 1.5) return Medium(max(m.rate - rate, vec3(0.0)), m.depth - 1.0);
    return Medium(vec3(0.0), 0.0);
}

// The medium around the place where a camera's ray begins: that of the bodies whose surface a straight line leaves more often than it enters.
// Opaque shapes do not count. The line goes backwards, where there are fewest surfaces. If it says that the camera is
// in a body, a second line forwards must agree, as an open sheet is no body.
Medium medium_at(vec3 from) {
    vec3 d = normalize(camera_to_world(MEDIUM_SEARCH));
    vec3 o = from;
    Medium sum = Medium(vec3(0.0), 0.0), first = sum;
    vec3 walls = vec3(0.0);
    uint skip = NONE, layer = 0u, side = 0u;
    bool more;
    do {
        Hit hit = shapes_nearest(o, d, skip);
        SurfacePoint at = shapes_point(hit, o, d);
        more = hit.id != NONE && layer < MEDIUM_LAYERS && budget_lasts();
        Material m = texture_material(at);
        bool counts = more && material_transmits(m) && !material_is_thin(m);
#if HAS_HIDDEN_SHAPES
        counts = counts && (at.shape & HIDDEN) == 0u;
#endif
        if (counts) {
            float crossing = dot(at.ng, d) > 0.0 ? 1.0 : -1.0;
            vec3 rate = surface_attenuation(m), wall = step(MEDIUM_WALL, rate);
            sum.rate += crossing * (1.0 - wall) * rate;
            walls += crossing * wall;
            sum.depth += crossing;
        }
        if (more) {
            o = shapes_leave(at, d);
            skip = at.flat_id;
        } else {
            sum.rate = sum.depth > 0.5 ? max(sum.rate, vec3(0.0)) + MEDIUM_WALL * max(walls, vec3(0.0)) : vec3(0.0);
            sum.depth = max(sum.depth, 0.0);
            more = side == 0u && sum.depth > 0.5 && budget_lasts();
            if (side == 0u) first = sum;
            side++;
            o = from;
            d = -d;
            skip = NONE;
            if (more) {
                sum = Medium(vec3(0.0), 0.0);
                walls = vec3(0.0);
            }
        }
        layer++;
    } while (more);
    return Medium(min(first.rate, sum.rate), min(first.depth, sum.depth));
}
#else
Medium medium_at(vec3 from) { return Medium(0.0); }
#endif
