// What the pixels of the bound part have accumulated: the total, and the block of samples under way, if there is one.
#include "accumulate/accumulated.glsl"
layout(std430, binding = SLOT_SUM) readonly buffer sum_buffer { vec4 sums[]; };
layout(std430, binding = SLOT_COMPENSATION) readonly buffer compensation_buffer { vec4 compensations[]; };
layout(std430, binding = SLOT_MOMENTS) readonly buffer moment_buffer { vec4 moments[]; };
layout(std430, binding = BLOCK_SLOT_SUM) readonly buffer block_sum_buffer { vec4 block_sums[]; };
layout(std430, binding = BLOCK_SLOT_COMPENSATION) readonly buffer block_compensation_buffer { vec4 block_compensations[]; };
layout(std430, binding = BLOCK_SLOT_MOMENTS) readonly buffer block_moment_buffer { vec4 block_moments[]; };
uniform uint block_stride; // 1; 0 where there is no block, and a single zero is bound in its place
uniform float moment_scale; // second moments are of radiance times this

// The sum of a pixel's samples and their number. The rounding errors of the parts are not taken off: they are
// less than that of this sum, and reading them would double the time that showing a picture takes.
vec4 accumulators_sum(uint slot, out float n) {
    uint b = slot * block_stride;
    n = moments[slot].w + block_moments[b].w;
    return sums[slot] + block_sums[b];
}

// All that is known of a pixel's samples.
Accumulated accumulators_load(uint slot) {
    uint b = slot * block_stride;
    Accumulated total = Accumulated(sums[slot], compensations[b], moments[slot]);
    return accumulated_merge(total, Accumulated(block_sums[b], block_compensations[b], block_moments[b]), moment_scale);
}
