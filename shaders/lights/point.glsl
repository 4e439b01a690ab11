// A point of intensity I gives radiance I / d^2; its pdf is 1 in place of a delta.
LightSample point_light_sample(Light l, vec3 p) {
    vec3 to = l.position - p;
    float d2 = dot(to, to);
    float d = sqrt(d2);
    if (d == 0.0) return LightSample(vec3(0.0, 0.0, 1.0), 0.0, vec3(0.0), 0.0, false, NONE);
    return LightSample(to / d, d, l.intensity / d2, 1.0, false, NONE);
}

void point_light_sample_case(Light l, vec3 p, inout LightSample s) {
#if HAS_POINT_LIGHTS
    if (l.kind == LIGHT_POINT) s = point_light_sample(l, p);
#endif
}
