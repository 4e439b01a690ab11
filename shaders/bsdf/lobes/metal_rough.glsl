// The core BRDF of glTF 2.0, a simplified appendix B: Lambert under GGX, by the share that Fresnel leaves [Khronos
// 2021]. The highlight is bsdf/lobes/disney/specular.glsl with one alpha for distribution and masking.

#if HAS_METAL_ROUGH
vec3 metal_rough_eval(Surface s, vec3 wo, vec3 wi, vec3 wm, float cos_d) {
    vec3 f = mix(s.spec0, vec3(1.0), fresnel_schlick(cos_d));
    return LOBE(LOBE_DIFFUSE, (1.0 - f) * (1.0 - s.metallic) * INV_PI * s.base_color)
         + LOBE(LOBE_SPECULAR, disney_specular_eval(s, wo, wi, wm, cos_d));
}

// The chance of picking the diffuse lobe.
float metal_rough_diffuse_chance(Surface s, vec3 wo) {
    float diffuse = (1.0 - s.metallic) * luminance(s.base_color);
    return diffuse / (diffuse + disney_specular_weight(s, wo));
}

float metal_rough_pdf(Surface s, vec3 wo, vec3 wi, vec3 wm) {
    return mix(disney_specular_pdf(s, wo, wm), lambert_pdf(wi), metal_rough_diffuse_chance(s, wo));
}

vec3 metal_rough_sample(Surface s, vec3 wo, float u_lobe, vec2 u) {
    vec3 mirrored = disney_specular_sample(s, wo, u);
    return u_lobe < metal_rough_diffuse_chance(s, wo) ? lambert_sample(u) : mirrored;
}
#endif
