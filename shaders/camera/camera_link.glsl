// The way from a point back to the camera: the reverse of camera_ray.

#if CAUSTICS
struct CameraLink {
    vec3 d;       // of the camera's ray that comes to the point
    float t;      // its length
    vec2 at;      // where it passes the picture, in pixels from the top left
    float weight; // area in the picture, pixels, over that across the ray at the point, m^2; 0: it is out of view
};

CameraLink camera_link(vec3 p, Sampler rng) {
    Camera c = uniforms.camera;
    vec2 half_size = 0.5 * vec2(uniforms.resolution);
    float pixel = c.half_height / half_size.y; // m, at a distance of 1 m
    vec3 to = p - c.position;
    CameraLink link = CameraLink(c.forward, 0.0, vec2(0.0), 0.0);
#if HAS_PANORAMA
    if (c.kind == CAMERA_PANORAMA) {
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
        return link;
    }
#endif
#if HAS_ORTHOGRAPHIC
    if (c.kind == CAMERA_ORTHOGRAPHIC) {
        link.t = dot(to, c.forward);
        link.at = half_size + vec2(dot(to, c.right), -dot(to, c.up)) / pixel;
        link.weight = link.t > 0.0 ? 1.0 / (pixel * pixel) : 0.0;
        return link;
    }
#endif
    vec2 shift = vec2(0.0);
#if HAS_APERTURE
    vec2 lens = c.aperture_radius * sampling_disk(sobol_pair(rng, PAIR_LENS));
    to -= lens.x * c.right + lens.y * c.up;
    shift = lens / c.focus_distance;
#endif
    float z = dot(to, c.forward);
    link.t = length(to);
    if (z > 0.0) {
        link.d = to / link.t;
        vec2 xy = vec2(dot(to, c.right), dot(to, c.up)) / z + shift;
        link.at = half_size + vec2(xy.x, -xy.y) / pixel;
        float cosine = z / link.t;
        link.weight = 1.0 / (pixel * pixel * cosine * cosine * cosine * link.t * link.t);
    }
    return link;
}
#endif
