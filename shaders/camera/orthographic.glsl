// Parallel rays. These functions return false, and change nothing, where the camera is another one.
bool orthographic_is() {
#if HAS_ORTHOGRAPHIC
    return uniforms.camera.kind == CAMERA_ORTHOGRAPHIC;
#else
    return false;
#endif
}

bool orthographic_ray(vec2 at, vec2 xy, inout vec3 o, inout vec3 d) {
#if HAS_ORTHOGRAPHIC
    if (orthographic_is()) {
        Camera c = uniforms.camera;
        o += xy.x * c.right - xy.y * c.up;
        d = c.forward;
        return true;
    }
#endif
    return false;
}

#if ANY_FOOTPRINTS
bool orthographic_cone(inout float width, inout float spread) {
#if HAS_ORTHOGRAPHIC
    if (orthographic_is()) {
        width = uniforms.footprint_share * camera_pixel_size();
        return true;
    }
#endif
    return false;
}
#endif

#if CAUSTICS
bool orthographic_link(vec3 to, inout CameraLink link) {
#if HAS_ORTHOGRAPHIC
    if (orthographic_is()) {
        Camera c = uniforms.camera;
        vec2 half_size = 0.5 * vec2(uniforms.resolution);
        float pixel = c.half_height / half_size.y;
        link.t = dot(to, c.forward);
        link.at = half_size + vec2(dot(to, c.right), -dot(to, c.up)) / pixel;
        link.weight = link.t > 0.0 ? 1.0 / (pixel * pixel) : 0.0;
        return true;
    }
#endif
    return false;
}
#endif
