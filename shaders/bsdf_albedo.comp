// Entry: directional albedo by sampling. Each invocation takes one batch of samples of one wo, and adds up what they
// multiply radiance by; the host adds up the batches, in double precision. Transmitted light counts as basic radiance.
#include "layout.glsl"
layout(local_size_x = BSDF_GROUP) in;
#include "math/constants.glsl"
#include "math/sobol.glsl"
#include "math/sampling.glsl"
#include "bsdf/bsdf.glsl"
#include "bsdf/bsdf_alone.glsl"
layout(std430, binding = SLOT_SUM) readonly buffer direction_buffer { vec4 directions[]; };
layout(std430, binding = SLOT_OUTPUT) writeonly buffer sum_buffer { vec4 sums[]; }; // of weights; of their squares
uniform uint first; // of the batches
uniform uint count;
uniform uint batches; // of each wo
uniform uint batch;   // samples in each of them ...
uniform uint samples; // ... but the last one of a wo, which ends with these

void main() {
    if (gl_GlobalInvocationID.x >= count) return;
    uint place = first + gl_GlobalInvocationID.x;
    uint row = place / batches, from = (place - row * batches) * batch;
    vec3 wo = directions[row].xyz;
    BsdfAlone alone = bsdf_alone_make(wo);
    vec3 sum = vec3(0.0), squares = vec3(0.0);
    uint k = from, end = min(from + batch, samples);
    do {
        Sampler rng = sobol_begin(uvec2(row, 0u), k, 0u);
        LobeSample lobe = bsdf_sample(alone.s, wo, sobol_pair(rng, PAIR_CHOICE).y, sobol_pair(rng, PAIR_BSDF));
        Scatter scatter = bsdf_eval(alone.s, wo, lobe.wi);
        if (lobe.is_delta) scatter = lobe.scatter;
        vec3 weight = scatter.pdf > 0.0 ? scatter.f / scatter.pdf : vec3(0.0);
        sum += weight;
        squares += weight * weight;
    } while (++k < end);
    sums[2u * gl_GlobalInvocationID.x] = vec4(sum, 0.0);
    sums[2u * gl_GlobalInvocationID.x + 1u] = vec4(squares, 0.0);
}
