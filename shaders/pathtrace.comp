// Entry: adds samples [sample_first, sample_first + sample_count) of each pixel of a tile, one by one, in order. With
// ADAPTIVE it adds those that the pixels of the listed areas are short of.
#include "layout.glsl"
layout(local_size_x = WORK_GROUP, local_size_y = WORK_GROUP) in;
layout(std430, binding = SLOT_SUM) buffer sum_buffer { vec4 sums[]; };
layout(std430, binding = SLOT_COMPENSATION) buffer compensation_buffer { vec4 compensations[]; };
layout(std430, binding = SLOT_MOMENTS) buffer moment_buffer { vec4 moments[]; };
layout(std430, binding = SLOT_COUNTERS) buffer counter_buffer {
    uint path_ended; // paths that their throughput has ended
    uint path_cut;   // samples that are short: see path/path.glsl
};
#include "math/constants.glsl"
#include "math/sobol.glsl"
#include "math/sampling.glsl"
#include "shapes/shapes.glsl"
#include "material/texture.glsl"
#include "material/height.glsl"
#include "camera/camera.glsl"
#include "path/path.glsl"
#include "camera/sample_plan.glsl"

precise vec4 sum, lost;
vec4 moment; // w: samples

void sums_load(uint slot) {
    sum = sums[slot];
    lost = compensations[slot];
    moment = moments[slot];
}

void sums_store(uint slot) {
    sums[slot] = sum;
    compensations[slot] = lost;
    moments[slot] = moment;
}

// Adds to Kahan's compensated sum, which is the picture, and to Welford's second moment about its mean. After a million
// samples the relative error is 4e-8; a plain sum has 9e-5 and a running average 4e-4.
void add(vec4 color) {
    vec3 before = moment.w > 0.0 ? sum.rgb / moment.w : vec3(0.0);
    precise vec4 x = color - lost;
    precise vec4 total = sum + x;
    lost = (total - sum) - x;
    sum = total;
    moment.w += 1.0;
    vec3 delta = (color.rgb - before) * uniforms.moment_scale;
    vec3 after = (color.rgb - sum.rgb / moment.w) * uniforms.moment_scale;
    moment.rgb += max(delta * after, vec3(0.0));
}

// Adds a sample. In kernels with a tree or mirrors the sums are in memory while a path is traced, which leaves twelve
// registers more to it; in others that would take 6 % of a Cornell box's time on llvmpipe.
void add_sample(uint slot, vec4 color) {
#if ANY_CHAINS
    sums_load(slot);
    add(color);
    sums_store(slot);
#else
    add(color);
#endif
}

void main() {
    uvec2 pixel;
    uint slot;
#if ADAPTIVE
    if (uniforms.replicate == 0u ? !sample_plan_pixel(pixel, slot) : !camera_pixel(pixel, slot)) return;
#else
    if (!camera_pixel(pixel, slot)) return;
#endif
    sums_load(slot);
    uint replicate = uniforms.replicate;
    if (replicate != 0u) { // the meter's buffers name the pixel and its replicate (gpu/picture/noise_meter.py)
        replicate += uint(fract(moment.x) * float(METER_REPLICATES));
        pixel = uvec2(moment.xy);
    }
#if ADAPTIVE
    uint first = uint(moment.w), count = sample_plan_due(pixel, first);
    if (count == 0u) return;
#else
    uint first = uniforms.sample_first, count = uniforms.sample_count;
#endif
    Medium medium = medium_at(uniforms.camera.position);
    uint i = 0u, cut = 0u;
    // Not do ... while: compilers for GPUs would take out of that all that no sample changes, seeds above all, and keep it in
    // registers for good.
    while (i < count) {
        vec3 o, d;
        Sampler rng = sobol_begin(pixel, first + i, replicate);
        camera_ray(pixel, rng, o, d);
#if HAS_ATTENUATION
        if (camera_is_wide()) {
            budget_begin();
            medium = medium_at(o);
        }
#endif
        add_sample(slot, path_radiance(rng, o, d, medium));
        if (path_was_lost) break; // the driver has ended this loop as well
        if (path_was_cut) cut++;
        i++;
    }
    cut += count - i;
    if (cut > 0u) atomicAdd(path_cut, cut);
#if !ANY_CHAINS
    sums_store(slot);
#endif
}
