// Fuzz: fibres that stand on the surface, as a linearly transformed cosine that was fitted to a volume of them
// [Zeltner, Burley & Chiang 2022]. Its albedo for wo is known, so that nothing is lost under it; it is not reciprocal.
#if HAS_OPENPBR && HAS_SHEEN
layout(binding = ENERGY_FUZZ_TEXTURE) uniform sampler3D energy_fuzz_table; // cosine, roughness

// x and y of the transform, and the albedo. Without roughness nothing is seen, and the transform has no inverse.
vec3 fuzz_look(float c, float roughness) {
    ivec3 n = textureSize(energy_fuzz_table, 0);
    float x = energy_place(c, n.x), least = 1.0 / float(n.y - 1);
    vec3 found = texture(energy_fuzz_table, vec3(x, energy_place(max(roughness, least), n.y), 0.5)).xyz;
    return vec3(max(found.x, 1e-3), found.y, found.z * min(1.0, roughness / least));
}

// Into the frame whose x is along wo, and back.
vec2 fuzz_along(vec3 wo) {
    float l2 = dot(wo.xy, wo.xy);
    return l2 > 0.0 ? wo.xy * inversesqrt(l2) : vec2(1.0, 0.0);
}

float fuzz_pdf(Surface s, vec3 wo, vec3 wi) {
    vec2 x = fuzz_along(wo);
    vec3 w = vec3(dot(x, wi.xy), x.x * wi.y - x.y * wi.x, wi.z);
    vec3 t = vec3(s.fuzz.x * w.xy, w.z);
    t.x += s.fuzz.y * w.z;
    float l2 = dot(t, t);
    return wi.z > 0.0 ? INV_PI * sqr(s.fuzz.x) * t.z / (l2 * l2) : 0.0;
}

vec3 fuzz_sample(Surface s, vec3 wo, vec2 u) {
    vec3 t = sampling_cosine(u);
    vec2 w = vec2(t.x - s.fuzz.y * t.z, t.y) / s.fuzz.x;
    vec2 x = fuzz_along(wo);
    return normalize(vec3(w.x * x.x - w.y * x.y, w.x * x.y + w.y * x.x, t.z));
}
#endif
