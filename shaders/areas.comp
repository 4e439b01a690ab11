// Entry: for each area of 8 x 8 pixels and each class of its rows (gpu/picture/sample_plan.py), the variance of a
// sample's luminance, summed over the pixels, and the number of samples that they have. The rows of the moments are
// bound from the first row of an area on.
#include "layout_constants.glsl"
layout(local_size_x = WORK_GROUP, local_size_y = WORK_GROUP) in;
#include "accumulate/luminance_variance.glsl"
layout(std430, binding = SLOT_MOMENTS) readonly buffer moment_buffer { vec4 moments[]; };
layout(std430, binding = SLOT_OUTPUT) writeonly buffer output_buffer { vec4 seen[]; };
uniform uvec2 size; // of the bound rows

void main() {
    uvec2 a = gl_GlobalInvocationID.xy, areas = (size + PLAN_AREA - 1u) / PLAN_AREA;
    if (a.x >= areas.x || a.y >= areas.y) return;
    vec4 sum = vec4(0.0), counts = vec4(0.0);
    uint y = PLAN_AREA * a.y;
    uint right = min(PLAN_AREA * (a.x + 1u), size.x), low = min(y + PLAN_AREA, size.y);
    do {
        uint x = PLAN_AREA * a.x;
        vec4 own = vec4(equal(uvec4(y % PLAN_CLASSES), uvec4(0u, 1u, 2u, 3u)));
        do {
            vec4 moment = moments[y * size.x + x];
            if (moment.w > 1.0) sum += own * luminance_variance(moment.rgb) / (moment.w - 1.0);
            counts = max(counts, own * moment.w);
        } while (++x < right);
    } while (++y < low);
    seen[2u * (a.y * areas.x + a.x)] = sum;
    seen[2u * (a.y * areas.x + a.x) + 1u] = counts;
}
