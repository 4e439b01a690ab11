// A direction given along the camera's right, up and forward, in world space.
vec3 camera_to_world(vec3 v) {
    return v.x * uniforms.camera.right + v.y * uniforms.camera.up + v.z * uniforms.camera.forward;
}

// The direction of a panorama's ray; `at` is in 0..1, from the top left, and beyond where a pixel's filter reaches.
#if HAS_PANORAMA
vec3 camera_panorama(vec2 at) {
    float azimuth = TWO_PI * (at.x - 0.5), polar = PI * at.y;
    return camera_to_world(vec3(sin(polar) * sin(azimuth), cos(polar), sin(polar) * cos(azimuth)));
}
#endif

// The ray of the camera through a pixel. Row 0 is the top of the picture; columns count from the left.
void camera_ray(uvec2 pixel, Sampler rng, out vec3 o, out vec3 d) {
    Camera c = uniforms.camera;
    vec2 at = vec2(pixel) + 0.5 + sampling_filter(sobol_pair(rng, PAIR_PIXEL));
    vec2 half_size = 0.5 * vec2(uniforms.resolution);
    vec2 xy = (at - half_size) * (c.half_height / half_size.y);
    vec3 through = xy.x * c.right - xy.y * c.up + c.forward;
    o = c.position;
#if HAS_ORTHOGRAPHIC
    if (c.kind == CAMERA_ORTHOGRAPHIC) {
        o += xy.x * c.right - xy.y * c.up;
        d = c.forward;
        return;
    }
#endif
#if HAS_PANORAMA
    if (c.kind == CAMERA_PANORAMA) {
        d = camera_panorama(at / vec2(uniforms.resolution));
        return;
    }
#endif
#if HAS_APERTURE
    vec2 lens = c.aperture_radius * sampling_disk(sobol_pair(rng, PAIR_LENS));
    vec3 offset = lens.x * c.right + lens.y * c.up;
    o += offset;
    through -= offset / c.focus_distance; // minus 0 without an aperture: the bits stay as they are
#endif
    d = normalize(through);
}

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
