// Picks a light and a direction towards it, and tells the density with which a direction would have been picked.
struct LightSample {
    vec3 wi;       // towards the light, in world space
    float t;       // the distance; INFINITY_T for what lies at infinity
    vec3 radiance; // arriving, not divided by pdf; of a point light divided by d^2; while a shape's sample is made, the
                   // share of its emission that leaves the shape itself
    float pdf;     // per solid angle, with the chance of picking the light; 0: there is no sample
    bool extended; // false: only direct sampling finds this light
    uint id;       // the shape that shines, or NONE
};

LightSample lights_none() { return LightSample(vec3(0.0, 0.0, 1.0), 0.0, vec3(0.0), 0.0, true, NONE); }

#include "lights/point.glsl"
#include "lights/spot.glsl"
#include "lights/directional.glsl"
uniform sampler2D environment_texels; // rgb radiance; a: density of picking a direction here, per steradian
#include "lights/cubemap.glsl"
#include "lights/sun.glsl"
#include "lights/environment.glsl"
#include "lights/sphere.glsl"
#include "lights/quad.glsl"
#include "lights/triangle.glsl"
#include "lights/ellipsoid.glsl"
#include "light_tree.glsl"

#if HAS_LIGHT_TREE
// Picks a light by all 32 bits, as one among many has a chance too small for the 24 bits of a float. `probability` of
// the light that comes back is the whole chance of picking it from there.
Light lights_pick(uint bits, LightContext context) {
    uvec4 head = light_tree_head();
    uint code = bits >> 2u, far = frame.light_count - head.w;
    bool near = code < head.x, even = code < head.y;
    float x = float(code - head.x) * (float(far) / float(max(LIGHT_CODES - head.x, 1u)));
    uint i = head.w + min(uint(x), far - 1u), first = near ? (even ? code >> head.z : 0u) : i;
    Light drawn = light_pick(first);
    LightTreeEnd end = light_tree_walk(near, even, code, drawn.alias, context);
    uint other = fract(x) >= drawn.threshold ? drawn.alias : i;
    Light l = light_pick(near ? (even ? first : end.found) : other);
    if (near) l.probability += light_tree_chance(end, l);
    return l;
}
#else
Light lights_pick(uint bits, LightContext context) {
#if HAS_MANY_LIGHTS
    float x = sobol_unit(bits) * float(frame.light_count);
    uint i = min(uint(x), frame.light_count - 1u);
    Light drawn = light_pick(i); // two of its words are used: loading all of it would cost as much again
    return light_pick(x - float(i) >= drawn.threshold ? drawn.alias : i);
#else
    return light_load(0u);
#endif
}
#endif

#if HAS_QUAD_LIGHTS
// Loads from a constant place where only one quad emits, as in many a room: this saves a third of a frame's time there.
Quad lights_quad(uint i) {
#if QUAD_LAMP >= 0
    return quad_load(uint(QUAD_LAMP));
#else
    return quad_pick(i);
#endif
}
#endif

// What lights_sample and lights_pdf need of a shape's material.
struct Emitter {
    vec3 radiance;
    uint sides; // 1: the outward one shines; 2: both do
    float transparency; // the chance that a ray passes through
};

Emitter lights_emitter(Light l) {
    Emitter e = Emitter(vec3(0.0), 1u, 0.0);
#if HAS_EMISSION
    Material m = material_pick(l.material);
    e.radiance = m.emission;
#if HAS_TEXTURED_LIGHTS
    e.radiance = vec3(1.0); // it depends on the place that is sampled: see lights_emission
#endif
#if HAS_EMISSION_BOTH
    e.sides = m.emission_sides;
#endif
#if HAS_OPACITY
#if !HAS_TEXTURED_LIGHTS
    e.radiance *= m.opacity;
#endif
#if HAS_TEXTURED_LIGHTS
    e.transparency = m.opacity < 1.0 ? 1.0 : 0.0; // it depends on the place that is passed: see lights_emission
#else
    e.transparency = 1.0 - m.opacity;
#endif
#endif
#endif
    return e;
}

#if HAS_TEXTURED_LIGHTS
// The emission of the place that was sampled, times the opacity there.
vec3 lights_emission(LightSample s, vec3 p) {
    vec3 q = p + s.t * s.wi;
    Hit hit = Hit(0.0, s.id, vec2(0.0));
#if HAS_TRIANGLE_LIGHTS
    if (s.id >> LEAF_KIND_SHIFT == SHAPE_TRIANGLE) {
        Triangle tri = triangle_pick(s.id & LEAF_FIRST_MASK);
        vec3 e1 = tri.v1 - tri.v0, e2 = tri.v2 - tri.v0, w = q - tri.v0, c = cross(e1, e2);
        hit.uv = vec2(dot(cross(w, e2), c), dot(cross(e1, w), c)) / dot(c, c);
    }
#endif
    SurfacePoint at = shapes_point(hit, q, vec3(0.0, 0.0, 1.0));
    float share = 1.0;
#if HAS_EMISSION_BOTH && HAS_OPACITY && (HAS_SPHERE_LIGHTS || HAS_ELLIPSOID_LIGHTS)
    // The inside of a ball's far half is seen through the near half, as far as that is transparent.
    uint index = s.id & LEAF_FIRST_MASK, kind = s.id >> LEAF_KIND_SHIFT;
    float near = 0.0;
#if HAS_SPHERE_LIGHTS
    if (kind == SHAPE_SPHERE) near = 2.0 * dot(sphere_pick(index).center - p, s.wi) - s.t;
#endif
#if HAS_ELLIPSOID_LIGHTS
    if (kind == SHAPE_ELLIPSOID) {
        Solid ball = ellipsoid_pick(index);
        vec3 f = solid_rows(ball, ball.center - p), g = solid_rows(ball, s.wi);
        near = 2.0 * dot(f, g) / dot(g, g) - s.t;
    }
#endif
    SurfacePoint through = shapes_point(hit, p + near * s.wi, vec3(0.0, 0.0, 1.0));
    if (near > 0.0 && dot(s.wi, at.ng) > 0.0) share = 1.0 - texture_opacity(through);
#endif
#if HAS_OPACITY
    return texture_emission(at) * (share * texture_opacity(at));
#else
    return texture_emission(at);
#endif
}
#endif

// Samples a light for the point `context`. The bits of one random number choose the light, those of two more the
// direction.
LightSample lights_sample(LightContext context, uint pick_bits, uvec2 bits) {
    LightSample s = lights_none();
    vec3 p = context.p;
    vec2 u = sobol_units(bits);
    Light l = lights_pick(pick_bits, context);
#if HAS_POINT_LIGHTS
    if (l.kind == LIGHT_POINT) s = point_light_sample(l, p);
#endif
#if HAS_SPOT_LIGHTS
    if (l.kind == LIGHT_SPOT) s = spot_light_sample(l, p);
#endif
#if HAS_DIRECTIONAL_LIGHTS
    if (l.kind == LIGHT_DIRECTIONAL) s = directional_light_sample(l, u);
#endif
#if HAS_ENVIRONMENT
    if (l.kind == LIGHT_ENVIRONMENT) s = environment_light_sample(bits);
#endif
    Emitter e = lights_emitter(l);
#if HAS_SPHERE_LIGHTS
    if (l.kind == LIGHT_SPHERE) {
        s = sphere_light_sample(sphere_pick(l.index), p, u, e.sides, e.transparency);
        s.id = (SHAPE_SPHERE << LEAF_KIND_SHIFT) | l.index;
    }
#endif
#if HAS_QUAD_LIGHTS
    if (l.kind == LIGHT_QUAD) {
        s = quad_light_sample(lights_quad(l.index), p, u, e.sides);
        s.id = (SHAPE_QUAD << LEAF_KIND_SHIFT) | l.index;
    }
#endif
#if HAS_TRIANGLE_LIGHTS
    if (l.kind == LIGHT_TRIANGLE) {
        s = triangle_light_sample(triangle_pick(l.index), p, u, e.sides);
        s.id = (SHAPE_TRIANGLE << LEAF_KIND_SHIFT) | l.index;
    }
#endif
#if HAS_ELLIPSOID_LIGHTS
    if (l.kind == LIGHT_ELLIPSOID) {
        s = ellipsoid_light_sample(ellipsoid_pick(l.index), p, u, e.sides, e.transparency);
        s.id = (SHAPE_ELLIPSOID << LEAF_KIND_SHIFT) | l.index;
    }
#endif
#if HAS_EMISSION
    if (l.kind >= LIGHT_SPHERE) s.radiance *= e.radiance;
#if HAS_TEXTURED_LIGHTS
    if (l.kind >= LIGHT_SPHERE && s.pdf > 0.0) s.radiance *= lights_emission(s, p);
#endif
#endif
    s.pdf *= l.probability;
    return s;
}

// The density with which lights_sample gives the direction wi, in which `context` sees the emitting shape hit.id at the
// distance hit.t.
float lights_pdf(uint light, Hit hit, SurfacePoint at, LightContext context, vec3 wi) {
#if HAS_EMISSION
    vec3 p = context.p;
    Light l = light_pick(light);
#if HAS_LIGHT_TREE
    bool near = light != NONE && light_tree_head().x > 0u;
    l.probability += light_tree_chance(light_tree_walk(near, true, 0u, l.alias, context), l);
#endif
    Emitter e = lights_emitter(l);
    uint kind = hit.id >> LEAF_KIND_SHIFT, index = hit.id & LEAF_FIRST_MASK; // as the light has them, without a load
    float pdf = 0.0;
#if HAS_SPHERE_LIGHTS
    if (kind == SHAPE_SPHERE) pdf = sphere_light_pdf(sphere_pick(index), p, e.sides, e.transparency);
#endif
#if HAS_QUAD_LIGHTS
    if (kind == SHAPE_QUAD) pdf = quad_light_pdf(lights_quad(index), p, hit.t, wi, e.sides);
#endif
#if HAS_TRIANGLE_LIGHTS
    if (kind == SHAPE_TRIANGLE) pdf = triangle_light_pdf(triangle_pick(index), p, hit.t, at.ng, wi, e.sides);
#endif
#if HAS_ELLIPSOID_LIGHTS
    if (kind == SHAPE_ELLIPSOID) pdf = ellipsoid_light_pdf(ellipsoid_pick(index), hit.t, at, wi, e.sides);
#endif
    return pdf * l.probability;
#else
    return 0.0;
#endif
}
