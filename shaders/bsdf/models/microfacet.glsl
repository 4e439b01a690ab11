// The model `microfacet`: any distribution, geometry and Fresnel term of the literature over a diffuse lobe,
// f = f_d + D G F / (4 (n.wi) (n.wo)) [Cook & Torrance 1982, eq. 2]. For comparison: it may lose or gain energy.
#include "bsdf/lobes/lambert.glsl"
#include "bsdf/lobes/microfacet/precise.glsl"
#include "bsdf/lobes/microfacet/distribution.glsl"
#include "bsdf/lobes/microfacet/geometry.glsl"
#include "bsdf/lobes/microfacet/fresnel.glsl"
#include "bsdf/lobes/microfacet/diffuse.glsl"

#if HAS_MICROFACET
void microfacet_surface(Material m, vec2 tangent, inout Surface s) {
    s.terms = microfacet_load(m.number);
    s.terms_ior = m.ior;
    s.spec0 = m.specular_color;
    s.alpha = vec2(clamp(m.alpha, s.terms.alpha_low, s.terms.alpha_high));
    s.log_factor = 0.0;
    s.row = s.row_above = s.terms.table;
    s.row_share = 0.0;
#if HAS_MICROFACET_TABLES && TEXTURE_ALPHA >= 0
    float place = (log(s.alpha.x + s.terms.row_offset) - s.terms.row_start) * s.terms.row_scale;
    uint first = min(uint(max(place, 0.0)), max(s.terms.rows, 2u) - 2u);
    s.row += first * s.terms.row_texels;
    s.row_above = s.row + (s.terms.rows > 1u ? s.terms.row_texels : 0u);
    s.row_share = clamp(place - float(first), 0.0, 1.0);
#endif
#if HAS_MICROFACET_TABLES
    s.log_factor = microfacet_texel(s.row).x;
#if TEXTURE_ALPHA >= 0
    s.log_factor = mix(s.log_factor, microfacet_texel(s.row_above).x, s.row_share);
#endif
#endif
}

// The chance of picking the diffuse lobe. The floor of 0.05 keeps the facets sampled where they are dark head-on.
float microfacet_diffuse_chance(Surface s, vec3 wo) {
    float diffuse = luminance(s.base_color);
    return diffuse / (diffuse + max(0.05, luminance(fresnel_term(s, wo.z))));
}

Scatter microfacet_eval(Surface s, vec3 wo, vec3 wi) {
    vec3 sum = wo + wi;
    float cos_d = 0.5 * length(sum); // a dot product would cancel at grazing angles
    vec3 wm = sum / (2.0 * cos_d);
    float dg = distribution_d(s, wm) * geometry_term(s, wo, wi, wm, cos_d);
    vec3 f = LOBE(LOBE_DIFFUSE, diffuse_term(s, wo, wi, cos_d)) + LOBE(LOBE_SPECULAR, fresnel_term(s, cos_d) * dg);
    return Scatter(f, mix(distribution_pdf(s, wo, wm, cos_d), lambert_pdf(wi), microfacet_diffuse_chance(s, wo)));
}

LobeSample microfacet_sample(Surface s, vec3 wo, float u_lobe, vec2 u) {
    vec3 wm = distribution_sample(s, wo, u);
    vec3 mirrored = 2.0 * dot(wo, wm) * wm - wo;
    return bsdf_rough_sample(u_lobe < microfacet_diffuse_chance(s, wo) ? lambert_sample(u) : mirrored);
}

Terms microfacet_terms(Surface s, vec3 wo, vec3 wi, vec3 wm) {
    vec3 sum = wo + wi;
    float cos_d = 0.5 * length(sum);
    return Terms(fresnel_term(s, wm.z), distribution_d(s, wm),
                 geometry_term(s, wo, wi, sum / (2.0 * cos_d), cos_d), true);
}
#endif
