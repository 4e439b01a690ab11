// Entry: turns the accumulators into an exposed, tone-mapped picture with straight alpha, encoded for its display.
#include "layout_constants.glsl"
layout(local_size_x = WORK_GROUP, local_size_y = WORK_GROUP) in;
#include "math/constants.glsl"
#include "accumulate/accumulators.glsl"
#include "accumulate/splats_mean.glsl"
#include "tonemap/linear.glsl"
#include "tonemap/exponential.glsl"
#include "tonemap/reinhard.glsl"
#include "tonemap/aces.glsl"
#include "tonemap/agx.glsl"
#include "tonemap/pbr_neutral.glsl"
#include "tonemap/tables.glsl"
#if OUTPUT_FLOAT
layout(std430, binding = SLOT_OUTPUT) writeonly buffer output_buffer { vec4 pixels[]; };
#else
layout(std430, binding = SLOT_OUTPUT) writeonly buffer output_buffer { uint pixels[]; };
#endif
// A guess at what the picture shows, which is added to its sums.
layout(std430, binding = GUESS_SLOT_SUM) readonly buffer guess_sum_buffer { vec4 guess_sums[]; };
layout(std430, binding = GUESS_SLOT_MOMENTS) readonly buffer guess_moment_buffer { vec4 guess_moments[]; };
uniform uint guess_stride; // 1; 0 where there is no guess, and a single zero is bound in its place
uniform uint count; // of the pixels that are bound, in whatever rows
uniform float exposure; // factor

vec3 resolve_srgb(vec3 c) { // IEC 61966-2-1
    return mix(1.055 * pow(max(c, vec3(1e-12)), vec3(1.0 / 2.4)) - 0.055, 12.92 * c, lessThanEqual(c, vec3(0.0031308)));
}

vec3 resolve_shown(vec3 c) {
#if VIEW_TABLE
    return tables_view(c);
#elif GAMUT == 0
    return resolve_srgb(clamp(TONE_MAP(c), 0.0, 1.0));
#else // Display P3, which has sRGB's encoding. GLSL's matrices are columns.
    const mat3 p3 = mat3(0.8224619688, 0.0331941988, 0.0170826307, 0.1775380312, 0.9668058012, 0.0723974407,
                         0.0, 0.0, 0.9105199286);
#if GAMUT == 1
    return resolve_srgb(clamp(TONE_MAP(p3 * c), 0.0, 1.0));
#else
    return resolve_srgb(clamp(p3 * clamp(TONE_MAP(c), 0.0, 1.0), 0.0, 1.0));
#endif
#endif
}

void main() {
    uvec2 g = gl_GlobalInvocationID.xy;
    uint slot = g.y * uint(LINE) + g.x;
    if (slot >= count) return;
    float own; // samples; `n` counts what the guess is worth, too
    vec4 sum = accumulators_sum(slot, own) + guess_sums[slot * guess_stride], mean = vec4(0.0);
    float n = own + guess_moments[slot * guess_stride].w;
    if (n > 0.0) mean = sum / n;
#if CAUSTICS
    if (n > 0.0) mean.rgb += own / n * splats_mean(slot);
#endif
    vec3 c = mean.a > 0.0 ? mean.rgb / mean.a : vec3(0.0);
    c = min(c * exposure, vec3(1e37)); // a picture of 1e20 lifted by 60 stops stays finite
    c = resolve_shown(c);
#if LUT_AXES
    c = clamp(tables_lut(c), 0.0, 1.0);
#endif
#if OUTPUT_FLOAT
    pixels[slot] = vec4(c, mean.a);
#else
    pixels[slot] = packUnorm4x8(vec4(c, mean.a));
#endif
}
