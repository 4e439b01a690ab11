// All directions around a point, in latitude and longitude. These functions return false, and change nothing, where the
// camera is another one.
bool panorama_is() {
#if HAS_PANORAMA
    return uniforms.camera.kind == CAMERA_PANORAMA;
#else
    return false;
#endif
}

bool panorama_ray(vec2 at, vec2 xy, inout vec3 o, inout vec3 d) {
#if HAS_PANORAMA
    if (panorama_is()) {
        vec2 place = at / vec2(uniforms.resolution);
        float azimuth = TWO_PI * (place.x - 0.5), polar = PI * place.y;
        d = camera_to_world(vec3(sin(polar) * sin(azimuth), cos(polar), sin(polar) * cos(azimuth)));
        return true;
    }
#endif
    return false;
}

#if ANY_FOOTPRINTS
bool panorama_cone(inout float width, inout float spread) {
#if HAS_PANORAMA
    if (panorama_is()) {
        spread = uniforms.footprint_share * PI / float(uniforms.resolution.y);
        return true;
    }
#endif
    return false;
}
#endif

#if CAUSTICS
bool panorama_link(vec3 to, inout CameraLink link) {
#if HAS_PANORAMA
    if (panorama_is()) {
        Camera c = uniforms.camera;
        vec2 half_size = 0.5 * vec2(uniforms.resolution);
        vec3 v = vec3(dot(to, c.right), dot(to, c.up), dot(to, c.forward));
        float level = length(v.xz);
        link.t = length(v);
        if (level > 0.0) {
            link.d = to / link.t;
            vec2 turned = vec2(0.5 + atan(v.x, v.z) * (0.5 * INV_PI), atan(level, v.y) * INV_PI);
            link.at = turned * vec2(uniforms.resolution);
            float solid = 4.0 * half_size.x * half_size.y / (TWO_PI * PI); // pixels, over their solid angle at the equator
            link.weight = solid / (level * link.t);
        }
        return true;
    }
#endif
    return false;
}
#endif
