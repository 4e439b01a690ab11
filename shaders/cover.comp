// Entry: which shapes and materials the camera rays of the picture's first samples meet, and how many of the rays each.
#include "layout.glsl"
layout(local_size_x = WORK_GROUP, local_size_y = WORK_GROUP) in;
// COVER_RANKS for each pixel, in no order: index + 1, NONE for rays that meet nothing, 0: not taken yet; and the number
// of rays.
layout(std430, binding = SLOT_SHAPE_COVER) buffer shape_cover_buffer { uvec2 shape_covers[]; };
layout(std430, binding = SLOT_MATERIAL_COVER) buffer material_cover_buffer { uvec2 material_covers[]; };
#include "math/constants.glsl"
#include "math/sobol.glsl"
#include "math/sampling.glsl"
#include "shapes/shapes.glsl"
#include "material/texture.glsl"
#include "camera/camera.glsl"
#include "shapes/transparency.glsl"

// Space-Saving [Metwally et al. 2005]: exact for as many ids as there are ranks; one more takes the place of the rarest
// and inherits its rays, so that the numbers of a pixel always add up to its rays.
#define COVER_COUNT(covers, slot, id) { \
    uint first = slot * uint(COVER_RANKS), place = 0u, least = NONE; \
    for (uint k = 0u; k < uint(COVER_RANKS); k++) { \
        uvec2 c = covers[first + k]; \
        bool fits = c.x == id || c.x == 0u; \
        if (fits || c.y < least) { \
            place = k; \
            least = c.y; \
        } \
        if (fits) break; \
    } \
    covers[first + place] = uvec2(id, covers[first + place].y + 1u); \
}

void main() {
    uvec2 pixel;
    uint slot;
    if (!camera_pixel(pixel, slot)) return;
    uint i = 0u;
    do {
        Sampler rng = sobol_begin(pixel, uniforms.sample_first + i, 0u);
        vec3 o, d;
        camera_ray(pixel, rng, o, d);
        SurfacePoint at;
        budget_begin();
        Hit hit = transparency_nearest(o, d, NONE, 0u, rng, at);
        bool meets = budget_lasts() && hit.id != NONE;
        uint shape = meets ? (at.shape & ~SHAPE_BITS) + 1u : NONE;
        uint material = meets ? at.material + 1u : NONE;
        COVER_COUNT(shape_covers, slot, shape)
        COVER_COUNT(material_covers, slot, material)
    } while (++i < uniforms.sample_count);
}
