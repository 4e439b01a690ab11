// The sheen of fibres that stand on the surface [Estevez & Kulla 2017].
#if HAS_PRINCIPLED && HAS_SHEEN

float sheen_charlie_fit(float c, float alpha) {
    float t = sqr(1.0 - alpha);
    float a = mix(21.5473, 25.3245, t), b = mix(3.82987, 3.32435, t), k = mix(0.19823, 0.16801, t);
    float d = mix(-1.97760, -1.27393, t), e = mix(-4.32054, -4.85967, t);
    return a / (1.0 + b * pow(c, k)) + d * c + e;
}

float sheen_charlie_mask(float c, float alpha) {
    // The cosine of a reflected direction may round above 1.
    float l = sheen_charlie_fit(c < 0.5 ? c : max(0.0, 1.0 - c), alpha);
    return exp(c < 0.5 ? l : 2.0 * sheen_charlie_fit(0.5, alpha) - l);
}

vec3 sheen_charlie_eval(Surface s, vec3 wo, vec3 wi) {
    float alpha = s.alpha_sheen;
    vec3 wm = normalize(wo + wi);
    float sine = sqrt(dot(wm.xy, wm.xy));
    float d = (2.0 + 1.0 / alpha) * pow(sine, 1.0 / alpha) * (0.5 * INV_PI);
    float g = 1.0 / (1.0 + sheen_charlie_mask(wo.z, alpha) + sheen_charlie_mask(wi.z, alpha));
    return s.sheen * (d * g / (4.0 * wo.z * wi.z));
}

vec3 sheen_charlie_sample(vec2 u) { return sampling_hemisphere(u); }
float sheen_charlie_pdf() { return 0.5 * INV_PI; }
#endif
