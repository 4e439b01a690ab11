#include "path/bodies.glsl"

// What is around a ray. The rates of bodies add up, so that nested or overlapping bodies may be entered and left in any
// order; a ray that is in two bodies loses light to both, unless some have priorities. Outside of bodies is what fills all
// other space.
struct Medium {
#if HAS_ATTENUATION
    vec3 rate;   // of extinction, 1/m: the sum over all bodies around the ray
    float depth; // the number of these bodies
#if ANY_MEDIA
    vec3 scattering; // 1/m
    float forward;   // the mean cosine of scattering, times the mean of its rate
    vec3 emission;   // W / (m^3 sr)
#endif
#if HAS_PRIORITIES
    Bodies bodies;   // of which all but the first are hidden
#endif
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

#if HAS_MEDIA
// The number of a shape's body.
uint medium_id(uint shape) { return 1u + (shape & ~SHAPE_BITS); }
#endif

// Whether the ray passes the surface because it is inside a higher body.
bool medium_hides(Medium m, SurfacePoint at, vec3 d) {
#if HAS_PRIORITIES
    Material material = material_pick(at.material);
    bool body = material_transmits(material) && !material_is_thin(material);
    return body && bodies_hide(m.bodies, medium_id(at.shape), dot(at.ng, d) > 0.0);
#else
    return false;
#endif
}

#if HAS_ATTENUATION
const float MEDIUM_WALL = 1e20; // 1/m; a rate above absorbs all light and would round away the others in a sum
const uint MEDIUM_LAYERS = 4096u; // surfaces that the search below passes at most
// The direction of the search, off the camera's axes, where meshes tend to have their edges.
const vec3 MEDIUM_SEARCH = vec3(0.1371, 0.0713, -1.0);

Medium medium_none() {
    Medium m;
    m.rate = vec3(0.0);
    m.depth = 0.0;
#if ANY_MEDIA
    m.scattering = m.emission = vec3(0.0);
    m.forward = 0.0;
#endif
#if HAS_PRIORITIES
    m.bodies = bodies_none();
#endif
    return m;
}

#if HAS_MEDIA
// Adds what fills a body, `times` times; the body 0 is all space outside of shapes.
void medium_fill(uint body, float times, inout Medium m) {
    Body b = body_load(body);
    m.rate += times * b.extinction;
    m.scattering += times * b.scattering;
    m.forward += times * b.g * dot(b.scattering, vec3(1.0 / 3.0));
    m.emission += times * b.emission;
}
#endif

// What is outside of all bodies.
Medium medium_outside() {
    Medium m = medium_none();
#if HAS_MEDIA
    medium_fill(0u, 1.0, m);
#endif
    return m;
}

// What that material fills a body with.
Medium medium_inside(Material material) {
    Medium m = medium_none();
    m.rate = surface_attenuation(material);
    m.depth = 1.0;
#if HAS_SCATTERING
    // Where it scatters more than it takes away, what it absorbs is raised by a grey until nothing is negative.
    vec3 scattering = vec3(0.0);
    if (material.attenuation_distance > 0.0) scattering = material.scatter_color / material.attenuation_distance;
    vec3 absorbed = m.rate - scattering;
    m.rate -= min(min(min(absorbed.x, absorbed.y), absorbed.z), 0.0);
    m.scattering = scattering;
    m.forward = material.scatter_g * dot(scattering, vec3(1.0 / 3.0));
#endif
    return m;
}

// A body of that material and shape.
Medium medium_body(Material material, uint shape) {
    Medium m = medium_inside(material);
#if HAS_PRIORITIES
    m.bodies = bodies_one(medium_id(shape), material_index(material), m.rate, m.scattering, m.forward);
#endif
#if HAS_MEDIA
    medium_fill(medium_id(shape), 1.0, m);
#endif
    return m;
}

#if HAS_PRIORITIES
// That of the highest of these bodies.
Medium medium_of(Bodies bodies) {
    Medium m = medium_none();
#if BODIES_TEXTURED
    m.rate = bodies.rates[0];
    m.scattering = bodies.scattering[0];
    m.forward = bodies.forward.x;
#else
    if (bodies.ids.x != 0u) m = medium_inside(material_pick(body_load(bodies.ids.x).material));
#endif
    m.bodies = bodies;
    m.depth = bodies_count(bodies);
    medium_fill(bodies.ids.x, 1.0, m);
    return m;
}
#endif

// The same medium, anew from the numbers of its bodies where these give all of it: nothing else of it is in registers then
// from where it was found to here.
Medium medium_again(Medium m) {
#if HAS_PRIORITIES && !BODIES_TEXTURED
    return medium_of(m.bodies);
#else
    return m;
#endif
}

Medium medium_sum(Medium a, Medium b, float times) {
    a.rate += times * b.rate;
    a.depth += times * b.depth;
#if ANY_MEDIA
    a.scattering += times * b.scattering;
    a.forward += times * b.forward;
    a.emission += times * b.emission;
#endif
    return a;
}

// Without what rounding leaves of bodies that were left.
Medium medium_real(Medium m) {
    m.rate = max(m.rate, vec3(0.0));
#if ANY_MEDIA
    m.scattering = max(m.scattering, vec3(0.0));
    m.emission = max(m.emission, vec3(0.0));
#endif
    return m;
}

Medium medium_entered(Medium m, Medium body) {
#if HAS_PRIORITIES
    return medium_of(bodies_with(m.bodies, body.bodies));
#elif ANY_MEDIA
    if (m.depth < 0.5) return body;
#endif
    return medium_sum(m, body, 1.0);
}

// Leaving the last body leaves nothing of it: a texture may have given the body another rate where it was entered.
Medium medium_left(Medium m, Medium body) {
#if HAS_PRIORITIES
    return medium_of(bodies_without(m.bodies, body.bodies.ids.x));
#endif
    if (m.depth > 1.5) return medium_real(medium_sum(m, body, -1.0));
    return medium_outside();
}

// What two searches both find.
Medium medium_least(Medium a, Medium b) {
#if ANY_MEDIA
    if (a.depth < b.depth) return a;
    return b;
#else
    return Medium(min(a.rate, b.rate), min(a.depth, b.depth));
#endif
}

// The medium around the place where a camera's ray begins: that of the bodies whose surface a straight line leaves more often than it enters.
// Opaque shapes do not count. The line goes backwards, where there are fewest surfaces. If it says that the camera is
// in a body, a second line forwards must agree, as an open sheet is no body.
Medium medium_at(vec3 from) {
    vec3 d = normalize(camera_to_world(MEDIUM_SEARCH));
    vec3 o = from;
    Medium sum = medium_none(), first = sum;
#if HAS_PRIORITIES
    Medium crossed = sum; // bodies that the line has entered and not left yet
#endif
    vec3 walls = vec3(0.0);
    uint skip = NONE, layer = 0u, side = 0u;
    bool more;
    do {
        Hit hit = shapes_nearest(o, d, skip);
        SurfacePoint at = shapes_point(hit, o, d);
        more = hit.id != NONE && layer < MEDIUM_LAYERS && budget_lasts();
        Material m = material_at(at);
        bool counts = more && material_transmits(m) && !material_is_thin(m);
#if HAS_HIDDEN_SHAPES
        counts = counts && (at.shape & HIDDEN) == 0u;
#endif
        if (counts) {
            float crossing = dot(at.ng, d) > 0.0 ? 1.0 : -1.0;
            Medium body = medium_body(m, at.shape);
#if HAS_PRIORITIES
            if (crossing < 0.0) crossed = medium_entered(crossed, body);
            else if (bodies_have(crossed.bodies, body.bodies.ids.x)) crossed = medium_left(crossed, body);
            else sum = medium_entered(sum, body);
#else
            vec3 wall = step(MEDIUM_WALL, body.rate);
            body.rate *= 1.0 - wall;
            sum = medium_sum(sum, body, crossing);
            walls += crossing * wall;
#endif
        }
        if (more) {
            o = shapes_leave(at, d);
            skip = at.flat_id;
        } else {
#if !HAS_PRIORITIES
            sum = medium_real(sum);
            sum.rate += MEDIUM_WALL * max(walls, vec3(0.0));
#endif
            if (sum.depth < 0.5) sum = medium_outside();
            more = side == 0u && sum.depth > 0.5 && budget_lasts();
            if (side == 0u) first = sum;
            side++;
            o = from;
            d = -d;
            skip = NONE;
            if (more) {
                sum = medium_none();
                walls = vec3(0.0);
#if HAS_PRIORITIES
                crossed = sum;
#endif
            }
        }
        layer++;
    } while (more);
    return medium_least(first, sum);
}
#else
Medium medium_none() { return Medium(0.0); }
Medium medium_outside() { return medium_none(); }
Medium medium_again(Medium m) { return m; }
Medium medium_at(vec3 from) { return medium_outside(); }
#endif
