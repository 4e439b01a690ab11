// A pinhole or a thin lens: the camera that is none of the others.
void perspective_ray(vec2 xy, Sampler rng, inout vec3 o, out vec3 d) {
    Camera c = uniforms.camera;
    vec3 through = xy.x * c.right - xy.y * c.up + c.forward;
#if HAS_APERTURE
    vec2 lens = c.aperture_radius * sampling_disk(sobol_pair(rng, PAIR_LENS));
    vec3 offset = lens.x * c.right + lens.y * c.up;
    o += offset;
    through -= offset / c.focus_distance; // minus 0 without an aperture: the bits stay as they are
#endif
    d = normalize(through);
}

#if CAUSTICS
void perspective_link(vec3 to, Sampler rng, inout CameraLink link) {
    Camera c = uniforms.camera;
    vec2 half_size = 0.5 * vec2(uniforms.resolution), shift = vec2(0.0);
    float pixel = c.half_height / half_size.y; // m, at a distance of 1 m
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
}
#endif
