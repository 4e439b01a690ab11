// The way from a point back to the camera.
#if CAUSTICS
CameraLink camera_link(vec3 p, Sampler rng) {
    vec3 to = p - uniforms.camera.position;
    CameraLink link = CameraLink(uniforms.camera.forward, 0.0, vec2(0.0), 0.0);
    if (orthographic_link(to, link)) return link;
    if (panorama_link(to, link)) return link;
    perspective_link(to, rng, link);
    return link;
}
#endif
