// Picks a light and a direction towards it, and gives the density with which a direction would have been picked.
struct LightSample {
    vec3 wi;       // towards the light, in world space
    float t;       // the distance; INFINITY_T for a light at infinity
    vec3 radiance; // arriving, not divided by pdf; of a point light divided by d^2; while a shape's sample is made, the
                   // share of its emission that leaves the shape itself
    float pdf;     // per solid angle, with the chance of picking the light; 0: there is no sample
    bool extended; // false: only direct sampling finds this light
    uint id;       // the shape that shines, or NONE
};

LightSample lights_none() { return LightSample(vec3(0.0, 0.0, 1.0), 0.0, vec3(0.0), 0.0, true, NONE); }

#if CAUSTICS
// A place on a shape that shines.
struct LightPlace {
    vec3 p;
    vec2 uv;        // its weights on a triangle
    uint id;        // the shape
    float pdf_area; // its density per area
};
#endif

#include "lights/point.glsl"
#include "lights/spot.glsl"
#include "lights/directional.glsl"
uniform sampler2D environment_texels; // rgb radiance; a: density of picking a direction here, per steradian
#include "lights/cubemap.glsl"
#include "lights/sun.glsl"
#include "lights/environment.glsl"
#include "lights/emitter.glsl"
#include "lights/sphere.glsl"
#include "lights/disk.glsl"
#include "lights/quad.glsl"
#include "lights/triangle.glsl"
#include "lights/ellipsoid.glsl"
#include "lights/cylinder.glsl"
#include "lights/light_tree.glsl"

// Picks a light from the alias table of all.
Light lights_table_pick(uint bits) {
    float x = sobol_unit(bits) * float(uniforms.light_count);
    uint i = min(uint(x), uniforms.light_count - 1u);
    Light drawn = light_pick(i); // two of its words are used: loading all of it would cost as much again
    return light_pick(x - float(i) >= drawn.threshold ? drawn.alias : i);
}

// Picks a light; its `probability` is the whole chance of that.
Light lights_pick(uint bits, LightContext context) {
#if HAS_LIGHT_TREE
    return light_tree_pick(bits, context);
#elif HAS_MANY_LIGHTS
    return lights_table_pick(bits);
#else
    return light_load(0u);
#endif
}

// Samples a light for the point `context`. The bits of one random number choose the light, those of two more the
// direction. Of the functions below only the one of the light's kind changes s.
LightSample lights_sample(LightContext context, uint pick_bits, uvec2 bits) {
    LightSample s = lights_none();
    vec3 p = context.p;
    vec2 u = sobol_units(bits);
    Light l = lights_pick(pick_bits, context);
    point_light_sample_case(l, p, s);
    spot_light_sample_case(l, p, s);
    directional_light_sample_case(l, u, s);
    environment_light_sample_case(l, bits, s);
    Emitter e = emitter_make(l);
    sphere_light_sample_case(l, p, u, e, s);
    quad_light_sample_case(l, p, u, e, s);
    triangle_light_sample_case(l, p, u, e, s);
    ellipsoid_light_sample_case(l, p, u, e, s);
    cylinder_light_sample_case(l, p, u, e, s);
    emitter_shine(l, e, p, s);
    s.pdf *= l.probability;
    return s;
}

// The density with which lights_sample gives the direction wi, in which `context` sees the emitting shape hit.id at the
// distance hit.t.
float lights_pdf(uint light, Hit hit, SurfacePoint at, LightContext context, vec3 wi) {
    vec3 p = context.p;
    Light l = light_pick(light);
    light_tree_add_chance(light, context, l);
    Emitter e = emitter_make(l);
    float pdf = 0.0;
    sphere_light_pdf_case(hit, p, e, pdf);
    quad_light_pdf_case(hit, p, wi, e, pdf);
    triangle_light_pdf_case(hit, p, at, wi, e, pdf);
    ellipsoid_light_pdf_case(hit, at, wi, e, pdf);
    cylinder_light_pdf_case(hit, p, at, wi, e, pdf);
    return pdf * l.probability;
}

#if CAUSTICS
// Draws a place on a shape that shines. Of the functions below only the one of the light's kind changes `at`.
LightPlace lights_place(Light l, vec2 u) {
    LightPlace at = LightPlace(vec3(0.0), vec2(0.0), NONE, 0.0);
    sphere_light_place_case(l, u, at);
    quad_light_place_case(l, u, at);
    triangle_light_place_case(l, u, at);
    ellipsoid_light_place_case(l, u, at);
    cylinder_light_place_case(l, u, at);
    return at;
}

// The part of a point's intensity that it sends against the direction wi.
float lights_share(Light l, vec3 wi) {
    float share = 1.0;
    spot_light_share_case(l, wi, share);
    return share;
}
#endif

#if HAS_TEXTURED_LIGHTS
// The distance from p to the near half of a round shape whose far half is sampled; 0 for other shapes.
float lights_near(LightSample s, vec3 p) {
    float near = 0.0;
    sphere_light_near_case(s, p, near);
    ellipsoid_light_near_case(s, p, near);
    cylinder_light_near_case(s, p, near);
    return near;
}
#endif
