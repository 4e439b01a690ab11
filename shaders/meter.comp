// Entry: reductions of the accumulators, of which a part is bound, for the noise meter. METER_WEIGH 1 estimates the
// error of each block of pixels from its own samples and its neighbours'; 0 computes sums over all pixels, and the
// values of the metered pixels; variances only with METER_VARIANCE.
#include "layout_constants.glsl"
layout(local_size_x = WORK_GROUP, local_size_y = WORK_GROUP) in;
#include "accumulate/luminance_variance.glsl"
#include "accumulate/accumulators.glsl"

#if METER_WEIGH
layout(std430, binding = SLOT_OUTPUT) writeonly buffer output_buffer { float weights[]; };
uniform uvec2 size; // of the bound rows
uniform uint block; // pixels a side
uniform uint rim;   // pixels around it that count, too: where few samples found a thin edge, its neighbours lie on it

void main() {
    uvec2 b = gl_GlobalInvocationID.xy, blocks = (size + block - 1u) / max(block, 1u);
    if (block == 0u || b.x >= blocks.x || b.y >= blocks.y) return;
    uvec2 low = uvec2(max(ivec2(b * block) - int(rim), ivec2(0))), high = min((b + 1u) * block + rim, size);
    float sum = 0.0;
    uint y = low.y;
    do {
        uint x = low.x;
        do sum += luminance_variance(moments[y * size.x + x].rgb); // times n - 1, of n samples, all in the total
        while (++x < high.x);
    } while (++y < high.y);
    weights[b.y * blocks.x + b.x] = sum / float((high.x - low.x) * (high.y - low.y));
}
#else
layout(std430, binding = SLOT_METER_PLACES) readonly buffer place_buffer { vec4 places[]; };
layout(std430, binding = SLOT_OUTPUT) writeonly buffer output_buffer { vec4 results[]; };
uniform uint first; // pixel of the bound part
uniform uint count; // of its pixels
uniform uint width; // of the picture
uniform uint lines; // of METER_LINE invocations

float meter_luminance(uint slot) {
    float n;
    vec3 sum = accumulators_sum(slot, n).rgb;
    return dot(sum, LUMINANCE) / max(n, 1.0);
}

// The variance of the mean luminance, from the pixel's own samples.
float meter_variance(uint slot) {
#if METER_VARIANCE
    vec4 moments = accumulators_load(slot).moments;
    return moments.w > 1.0 ? luminance_variance(moments.rgb) / (moments.w * (moments.w - 1.0)) : 0.0;
#else
    return 0.0;
#endif
}

void main() {
    uvec2 g = gl_GlobalInvocationID.xy;
    if (g.x >= uint(METER_LINE) || g.y >= lines) return;
    uint i = g.y * uint(METER_LINE) + g.x, k = i;
    vec4 result = vec4(0.0); // luminance, its variance, both summed; and the metered pixel's, where it is bound
    if (k < count) {
        do {
            result.xy += vec2(meter_luminance(k), meter_variance(k));
            k += uint(METER_LINE) * lines;
        } while (k < count);
    }
    uint pixel = uint(places[i].y) * width + uint(places[i].x) - first;
    if (pixel < count) result.z = meter_luminance(pixel);
    results[i] = result;
}
#endif
