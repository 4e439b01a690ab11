// Entry: samples [sample_first, sample_first + sample_count) of each pixel of a tile, added one by one, in order.
// ADAPTIVE: of each area listed, those that its pixels are short of.
layout(local_size_x = 8, local_size_y = 8) in;
#include "layout.glsl"
layout(std430, binding = SLOT_SUM) buffer sum_buffer { vec4 sums[]; };
layout(std430, binding = SLOT_COMPENSATION) buffer compensation_buffer { vec4 compensations[]; };
layout(std430, binding = SLOT_MOMENTS) buffer moment_buffer { vec4 moments[]; };
layout(std430, binding = SLOT_ALBEDO) buffer counter_buffer {
    uint path_ended; // by their throughput
    uint path_cut;   // by the driver: see path.glsl
};
#include "constants.glsl"
#include "sobol.glsl"
#include "sampling.glsl"
#include "shapes.glsl"
#include "texture.glsl"
#include "path.glsl"
#include "camera.glsl"
#include "plan.glsl"

void main() {
    uvec2 pixel;
    uint slot;
#if ADAPTIVE
    if (frame.replicate == 0u ? !plan_pixel(pixel, slot) : !camera_pixel(pixel, slot)) return;
#else
    if (!camera_pixel(pixel, slot)) return;
#endif
    // Kahan's compensated sum for the picture; Welford's second moment about its mean. Relative error after a
    // million samples 4e-8, where a plain sum has 9e-5 and a running average 4e-4.
    precise vec4 sum = sums[slot], lost = compensations[slot];
    vec4 moment = moments[slot];
    uint replicate = frame.replicate;
    if (replicate != 0u) { // the meter's buffers say where, and which of a pixel's (gpu/meter.py)
        replicate += uint(fract(moment.x) * float(METER_REPLICATES));
        pixel = uvec2(moment.xy);
    }
#if ADAPTIVE
    uint first = uint(moment.w), count = plan_due(pixel, first);
    if (count == 0u) return;
#else
    uint first = frame.sample_first, count = frame.sample_count;
#endif
#if HAS_ATTENUATION
    Medium medium = medium_at_camera();
#endif
    uint i = 0u;
    do {
        Sampler rng = sobol_begin(pixel, first + i, replicate);
        vec3 o, d;
        camera_ray(pixel, rng, o, d);
#if HAS_ATTENUATION
        Radiance r = path_trace(o, d, rng, medium);
#else
        Radiance r = path_trace(o, d, rng);
#endif
        vec3 before = moment.w > 0.0 ? sum.rgb / moment.w : vec3(0.0);
        precise vec4 x = vec4(r.color, r.alpha) - lost;
        precise vec4 total = sum + x;
        lost = (total - sum) - x;
        sum = total;
        moment.w += 1.0;
        vec3 delta = (r.color - before) * frame.moment_scale;
        vec3 after = (r.color - sum.rgb / moment.w) * frame.moment_scale;
        moment.rgb += max(delta * after, vec3(0.0));
        if (path_was_cut) break; // as this loop is by now
    } while (++i < count);
    if (i < count) atomicAdd(path_cut, count - i);
    sums[slot] = sum;
    compensations[slot] = lost;
    moments[slot] = moment;
}
