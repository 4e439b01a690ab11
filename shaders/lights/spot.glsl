// A point of intensity I inside a cone that fades by smoothstep in the cosine between its half angles. With D along
// the beam and |D|^2 = 1 / (2 (cos inner - cos outer)), |D - |D| w|^2 is (1 - cos) / (cos inner - cos outer) for a
// direction w of light. No cosine is subtracted from 1, so that narrow beams keep their rim in fp32.
float spot_light_share(Light l, vec3 wi) {
    vec3 off = l.direction + length(l.direction) * wi;
    float t = clamp(l.spread - dot(off, off), 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
}

LightSample spot_light_sample(Light l, vec3 p) {
    LightSample s = point_light_sample(l, p);
    s.radiance *= spot_light_share(l, s.wi);
    return s;
}

void spot_light_sample_case(Light l, vec3 p, inout LightSample s) {
#if HAS_SPOT_LIGHTS
    if (l.kind == LIGHT_SPOT) s = spot_light_sample(l, p);
#endif
}

#if CAUSTICS
void spot_light_share_case(Light l, vec3 wi, inout float share) {
#if HAS_SPOT_LIGHTS
    if (l.kind == LIGHT_SPOT) share = spot_light_share(l, wi);
#endif
}
#endif
