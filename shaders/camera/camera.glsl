// A direction given along the camera's right, up and forward, in world space.
vec3 camera_to_world(vec3 v) {
    return v.x * uniforms.camera.right + v.y * uniforms.camera.up + v.z * uniforms.camera.forward;
}

#if ANY_FOOTPRINTS
// The size of a pixel, m: of parallel rays, or at a distance of 1 m.
float camera_pixel_size() { return 2.0 * uniforms.camera.half_height / float(uniforms.resolution.y); }
#endif

#if CAUSTICS
// The camera's ray that comes to a point: the reverse of camera_ray.
struct CameraLink {
    vec3 d;
    float t;      // its length
    vec2 at;      // where it passes the picture, in pixels from the top left
    float weight; // area in the picture, pixels, over that across the ray at the point, m^2; 0: it is out of view
};
#endif

#include "camera/perspective.glsl"
#include "camera/orthographic.glsl"
#include "camera/panorama.glsl"

// The ray of the camera through a pixel. Row 0 is the top of the picture; columns count from the left.
void camera_ray(uvec2 pixel, Sampler rng, out vec3 o, out vec3 d) {
    vec2 at = vec2(pixel) + 0.5 + sampling_filter(sobol_pair(rng, PAIR_PIXEL));
    vec2 half_size = 0.5 * vec2(uniforms.resolution);
    vec2 xy = (at - half_size) * (uniforms.camera.half_height / half_size.y);
    o = uniforms.camera.position;
    d = uniforms.camera.forward;
    if (orthographic_ray(at, xy, o, d)) return;
    if (panorama_ray(at, xy, o, d)) return;
    perspective_ray(xy, rng, o, d);
}

#if ANY_FOOTPRINTS
// The width (m) of the cone around the camera's ray along d where it begins, and the angle by which it grows.
void camera_cone(vec3 d, out float width, out float spread) {
    width = spread = 0.0;
    if (orthographic_cone(width, spread)) return;
    if (panorama_cone(width, spread)) return;
    spread = uniforms.footprint_share * camera_pixel_size() * dot(d, uniforms.camera.forward);
}
#endif

#if HAS_ATTENUATION
// Whether rays begin at more places than the camera's own, by more than a lens's radius.
bool camera_is_wide() { return orthographic_is(); }
#endif

#if CAUSTICS
// Whether the picture goes on at its other edge: it closes around the camera, as the poles do at its top and bottom.
bool camera_is_around() { return panorama_is(); }
#endif

// The place of this work group among those of the dispatch: neighbours in order stand apart (gpu/picture/schedule.py).
uvec2 camera_group() {
    uvec2 size = gl_NumWorkGroups.xy;
    uint place = (gl_WorkGroupID.y * size.x + gl_WorkGroupID.x) * uniforms.group_stride % (size.x * size.y);
    return uvec2(place % size.x, place / size.x);
}

// Finds the pixel of this invocation; false where there is none.
bool camera_pixel(out uvec2 pixel, out uint slot) {
    uvec2 g = uint(WORK_GROUP) * camera_group() + gl_LocalInvocationID.xy;
    pixel = uniforms.tile_origin + g;
    slot = pixel.y * uniforms.slot_width + pixel.x - uniforms.slot_first;
    return g.x < uniforms.tile_size.x && g.y < uniforms.tile_size.y;
}
