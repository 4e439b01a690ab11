// Entry: the terms of a surface of microfacets, as far as its model has them: the density of facets, the share of them
// that is neither masked nor shadowed, and the reflectance of one.
#include "layout.glsl"
layout(local_size_x = BSDF_GROUP) in;
#include "math/constants.glsl"
#include "math/sobol.glsl"
#include "math/sampling.glsl"
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
    Surface s = bsdf_alone_make(wo).s;
    Terms found = models_terms(s, wo, wi, w);
    terms[2u * i] = vec4(found.f, found.d);
    terms[2u * i + 1u] = vec4(4.0 * wo.z * wi.z * found.visibility, found.has_facets ? 1.0 : 0.0, 0.0, 0.0);
}
