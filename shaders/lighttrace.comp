// Entry: traces paths of light, one for each pixel of a tile in those of the samples [sample_first, sample_first +
// sample_count) that have some (gpu/picture/light_paths.py), and adds what they bring to whichever pixels see it.
#include "layout.glsl"
layout(local_size_x = WORK_GROUP, local_size_y = WORK_GROUP) in;
layout(std430, binding = SLOT_COUNTERS) buffer counter_buffer {
    uint path_ended; // paths that their throughput has ended
    uint path_cut;   // paths for which their budget did not last
};
#include "math/constants.glsl"
#include "math/sobol.glsl"
#include "math/sampling.glsl"
#include "shapes/shapes.glsl"
#include "material/texture.glsl"
#include "material/height.glsl"
#include "camera/camera.glsl"
#include "camera/camera_link.glsl"
#include "path/path.glsl"
#include "accumulate/splats.glsl"
#include "lights/emission.glsl"
#include "path/light_path.glsl"

void main() {
    uvec2 pixel;
    uint slot;
    if (!camera_pixel(pixel, slot)) return;
#if CAUSTICS
    budget_begin();
    Medium medium = medium_at(uniforms.camera.position);
    uint i = 0u;
    do {
        uint index = uniforms.sample_first + i;
        uint part = index % LIGHT_PERIOD;
        if (part < 2u) {
            light_path_trace(medium, light_path_sampler(pixel, index / LIGHT_PERIOD, part), part != 0u);
            if (!budget_lasts()) atomicAdd(path_cut, 1u);
        }
    } while (++i < uniforms.sample_count);
#endif
}
