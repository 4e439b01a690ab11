// Entry: the mean radiance and alpha of the bound pixels. It is computed in double precision, so that it is rounded once on
// every device: the bits are those of `Accumulators.means`.
#include "layout_constants.glsl"
layout(local_size_x = WORK_GROUP, local_size_y = WORK_GROUP) in;
#include "accumulate/accumulators.glsl"
#include "accumulate/splats_mean.glsl"
layout(std430, binding = SLOT_OUTPUT) writeonly buffer output_buffer { vec4 means[]; };
uniform uint count;

void main() {
    uvec2 g = gl_GlobalInvocationID.xy;
    uint slot = g.y * uint(LINE) + g.x;
    if (slot >= count) return;
    float n;
    dvec4 sum = dvec4(accumulators_sum(slot, n));
    vec4 mean = vec4(sum / double(max(n, 1.0)));
#if CAUSTICS
    mean.rgb += splats_mean(slot);
#endif
    means[slot] = mean;
}
