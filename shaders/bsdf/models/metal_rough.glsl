// The core BRDF of glTF 2.0, a simplified appendix B: Lambert under GGX, by the share that Fresnel leaves [Khronos
// 2021]. The highlight is bsdf/lobes/disney/specular.glsl with one alpha for distribution and masking.

#include "bsdf/lobes/lambert.glsl"
#include "bsdf/lobes/disney/specular.glsl"

#if HAS_METAL_ROUGH
void metal_rough_surface(Material m, vec2 tangent, inout Surface s) {
    s.spec0 = mix(vec3(0.04), m.base_color, m.metallic);
    s.alpha_mask = max(0.001, m.roughness * m.roughness);
    s.alpha = vec2(s.alpha_mask);
}

// The chance of picking the diffuse lobe.
float metal_rough_diffuse_chance(Surface s, vec3 wo) {
    float diffuse = (1.0 - s.metallic) * luminance(s.base_color);
    return diffuse / (diffuse + disney_specular_weight(s, wo));
}

Scatter metal_rough_eval(Surface s, vec3 wo, vec3 wi) {
    vec3 wm = normalize(wo + wi);
    float cos_d = dot(wi, wm);
    vec3 share = mix(s.spec0, vec3(1.0), fresnel_schlick(cos_d));
    vec3 f = LOBE(LOBE_DIFFUSE, (1.0 - share) * (1.0 - s.metallic) * INV_PI * s.base_color)
           + LOBE(LOBE_SPECULAR, disney_specular_eval(s, wo, wi, wm, cos_d));
    return Scatter(f, mix(disney_specular_pdf(s, wo, wm), lambert_pdf(wi), metal_rough_diffuse_chance(s, wo)));
}

LobeSample metal_rough_sample(Surface s, vec3 wo, float u_lobe, vec2 u) {
    vec3 mirrored = disney_specular_sample(s, wo, u);
    return bsdf_rough_sample(u_lobe < metal_rough_diffuse_chance(s, wo) ? lambert_sample(u) : mirrored);
}

Terms metal_rough_terms(Surface s, vec3 wo, vec3 wi, vec3 wm) { return disney_specular_terms(s, wo, wi, wm); }
#endif
