// Entry: the terms of a surface of microfacets, as far as its model has them: the density of facets, the share of them
// that is neither masked nor shadowed, and the reflectance of one.
#include "layout.glsl"
layout(local_size_x = BSDF_GROUP) in;
#include "math/constants.glsl"
#include "math/sobol.glsl"
#include "math/sampling.glsl"
#include "material/surface.glsl"
#include "bsdf/bsdf.glsl"
#include "bsdf/bsdf_alone.glsl"
layout(std430, binding = SLOT_SUM) readonly buffer direction_buffer { vec4 directions[]; }; // wo, then every w
layout(std430, binding = SLOT_OUTPUT) writeonly buffer term_buffer { vec4 terms[]; };       // F and D; G, whether facets
uniform uint first; // of the w to evaluate
uniform uint count;

void main() {
    if (gl_GlobalInvocationID.x >= count) return;
    uint i = first + gl_GlobalInvocationID.x;
    vec3 wo = directions[0].xyz, w = directions[i + 1u].xyz, wi = vec3(-w.xy, w.z);
    Surface s = lone_make(wo).s;
    vec3 f = vec3(0.0);
    float d = 0.0, visibility = 0.0; // G over 4 cos cos
    bool facets = true;
#if HAS_DISNEY || HAS_METAL_ROUGH
    if (s.model == MODEL_DISNEY || s.model == MODEL_METAL_ROUGH) {
        f = disney_specular_fresnel(s, w.z);
        d = ggx_d(bsdf_turn(s, w), s.alpha);
        visibility = disney_specular_visibility(s, wo, wi);
    }
#endif
#if HAS_PRINCIPLED
    if (s.model == MODEL_PRINCIPLED) {
        f = microfacet_fresnel(s, w.z);
        d = ggx_d(bsdf_turn(s, w), s.alpha);
        visibility = ggx_visibility(bsdf_turn(s, wo), bsdf_turn(s, wi), s.alpha);
        facets = !s.is_delta;
    }
#endif
#if HAS_MICROFACET
    if (s.model == MODEL_MICROFACET) {
        vec3 sum = wo + wi;
        float cos_d = 0.5 * length(sum);
        f = fresnel_term(s, w.z);
        d = distribution_d(s, w);
        visibility = geometry_term(s, wo, wi, sum / (2.0 * cos_d), cos_d);
    }
#endif
    terms[2u * i] = vec4(f, d);
    terms[2u * i + 1u] = vec4(4.0 * wo.z * wi.z * visibility, facets ? 1.0 : 0.0, 0.0, 0.0);
}
