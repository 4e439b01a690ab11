// The classic highlight about the half vector [Blinn 1977]; it is not normalised: f cos = (diffuse cos + specular z^n)
// / pi.
#include "bsdf/lobes/lambert.glsl"
#include "bsdf/lobes/blinn_phong.glsl"

#if HAS_BLINN_PHONG
void blinn_phong_surface(Material m, vec2 tangent, inout Surface s) {
    s.phong = m.phong_specular;
    s.shininess = m.shininess;
}

// The chance of picking the diffuse lobe. The highlight reflects at most 8 / (n + 2) times its colour, and never over
// 2.
float blinn_phong_diffuse_chance(Surface s) {
    float diffuse = luminance(s.base_color);
    float shine = luminance(s.phong) * min(2.0, 8.0 / (s.shininess + 2.0));
    return diffuse + shine > 0.0 ? diffuse / (diffuse + shine) : 1.0;
}

// Half vectors have the density (n + 1) / (2 pi) z^n.
float blinn_phong_pdf(Surface s, vec3 wi, vec3 wm, float cos_d) {
    float half_pdf = (s.shininess + 1.0) * (0.5 * INV_PI) * blinn_phong_power(wm, s.shininess);
    return mix(half_pdf / (4.0 * max(cos_d, 1e-6)), lambert_pdf(wi), blinn_phong_diffuse_chance(s));
}

Scatter blinn_phong_eval(Surface s, vec3 wo, vec3 wi) {
    vec3 wm = normalize(wo + wi);
    vec3 f = INV_PI * (LOBE(LOBE_DIFFUSE, s.base_color)
                     + LOBE(LOBE_SPECULAR, s.phong * (blinn_phong_power(wm, s.shininess) / wi.z)));
    return Scatter(f, blinn_phong_pdf(s, wi, wm, dot(wi, wm)));
}

LobeSample blinn_phong_sample(Surface s, vec3 wo, float u_lobe, vec2 u) {
    vec3 wm = blinn_phong_lobe(s.shininess, u);
    vec3 mirrored = 2.0 * dot(wo, wm) * wm - wo;
    return bsdf_rough_sample(u_lobe < blinn_phong_diffuse_chance(s) ? lambert_sample(u) : mirrored);
}
#endif
