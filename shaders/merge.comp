// Entry: merges a block of samples into the total, for pixels [first, first + count) of the bound part, and clears it.
#include "layout_constants.glsl"
layout(local_size_x = WORK_GROUP, local_size_y = WORK_GROUP) in;
#include "accumulate/accumulated.glsl"
layout(std430, binding = SLOT_SUM) buffer sum_buffer { vec4 sums[]; };
layout(std430, binding = SLOT_COMPENSATION) buffer compensation_buffer { vec4 compensations[]; };
layout(std430, binding = SLOT_MOMENTS) buffer moment_buffer { vec4 moments[]; };
layout(std430, binding = BLOCK_SLOT_SUM) buffer block_sum_buffer { vec4 block_sums[]; };
layout(std430, binding = BLOCK_SLOT_COMPENSATION) buffer block_compensation_buffer { vec4 block_compensations[]; };
layout(std430, binding = BLOCK_SLOT_MOMENTS) buffer block_moment_buffer { vec4 block_moments[]; };
uniform uint first;
uniform uint count;
uniform float moment_scale; // second moments are of radiance times this

void main() {
    uvec2 g = gl_GlobalInvocationID.xy;
    uint at = g.y * uint(LINE) + g.x, slot = first + at;
    if (at >= count) return;
    Accumulated total = Accumulated(sums[slot], compensations[slot], moments[slot]);
    Accumulated block = Accumulated(block_sums[slot], block_compensations[slot], block_moments[slot]);
    total = accumulated_merge(total, block, moment_scale);
    sums[slot] = total.sum;
    compensations[slot] = total.lost;
    moments[slot] = total.moments;
    block_sums[slot] = block_compensations[slot] = block_moments[slot] = vec4(0.0);
}
