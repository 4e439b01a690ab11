// The "principled" BRDF of the 2012 course notes [Burley 2012].
#include "bsdf/lobes/lambert.glsl"
#include "bsdf/lobes/disney/diffuse.glsl"
#include "bsdf/lobes/disney/sheen.glsl"
#include "bsdf/lobes/disney/specular.glsl"
#include "bsdf/lobes/disney/clearcoat.glsl"

#if HAS_DISNEY
void disney_surface(Material m, vec2 tangent, inout Surface s) {
    // Weights of the course notes' luminance, not Rec.709's: the model is kept for faithful comparison.
    float lum = dot(m.base_color, vec3(0.3, 0.6, 0.1));
    vec3 tint = lum > 0.0 ? m.base_color / lum : vec3(1.0);
    s.spec0 = mix(m.specular * 0.08 * mix(vec3(1.0), tint, m.specular_tint), m.base_color, m.metallic);
    float aspect = 1.0;
#if HAS_ANISOTROPIC
    aspect = sqrt(1.0 - 0.9 * m.anisotropic);
    if (m.anisotropic > 0.0) s.tangent = tangent;
#endif
    float a = m.roughness * m.roughness;
    s.alpha = max(vec2(0.001), vec2(a / aspect, a * aspect));
    s.alpha_mask = sqr(0.5 + 0.5 * m.roughness);
#if HAS_SHEEN
    s.sheen = m.sheen * mix(vec3(1.0), tint, m.sheen_tint);
#endif
#if HAS_CLEARCOAT
    s.clearcoat = m.clearcoat;
    s.alpha_coat = mix(0.1, 0.001, m.clearcoat_gloss);
#endif
}

// The chances of picking each lobe; they sum to one.
struct DisneyWeights {
    float diffuse;
    float specular;
    float clearcoat;
};

DisneyWeights disney_weights(Surface s, vec3 wo) {
    DisneyWeights w = DisneyWeights(disney_diffuse_weight(s), disney_specular_weight(s, wo), 0.0);
#if HAS_CLEARCOAT
    w.clearcoat = disney_clearcoat_weight(s, wo);
#endif
    float inv = 1.0 / (w.diffuse + w.specular + w.clearcoat);
    return DisneyWeights(w.diffuse * inv, w.specular * inv, w.clearcoat * inv);
}

Scatter disney_eval(Surface s, vec3 wo, vec3 wi) {
    DisneyWeights w = disney_weights(s, wo);
    vec3 wm = normalize(wo + wi);
    float cos_d = dot(wi, wm);
    Scatter r = Scatter(LOBE(LOBE_DIFFUSE, disney_diffuse_eval(s, wo, wi, cos_d)), w.diffuse * lambert_pdf(wi));
#if HAS_SHEEN
    r.f += LOBE(LOBE_SHEEN, disney_sheen_eval(s, cos_d));
#endif
    vec3 wm_t = wm, wo_t = wo;
#if HAS_ANISOTROPIC
    wm_t = bsdf_turn(s, wm);
    wo_t = bsdf_turn(s, wo);
#endif
    r.f += LOBE(LOBE_SPECULAR, disney_specular_eval(s, wo, wi, wm_t, cos_d));
    r.pdf += w.specular * disney_specular_pdf(s, wo_t, wm_t);
#if HAS_CLEARCOAT
    r.f += LOBE(LOBE_CLEARCOAT, disney_clearcoat_eval(s, wo, wi, wm, cos_d));
    r.pdf += w.clearcoat * disney_clearcoat_pdf(s, wm, cos_d);
#endif
    return r;
}

LobeSample disney_sample(Surface s, vec3 wo, float u_lobe, vec2 u) {
    DisneyWeights w = disney_weights(s, wo);
    vec3 wi = lambert_sample(u);
    vec3 wo_t = wo;
#if HAS_ANISOTROPIC
    wo_t = bsdf_turn(s, wo);
#endif
    vec3 mirrored = disney_specular_sample(s, wo_t, u);
#if HAS_ANISOTROPIC
    mirrored = bsdf_turn_back(s, mirrored);
#endif
    if (u_lobe >= w.diffuse) wi = mirrored;
#if HAS_CLEARCOAT
    vec3 coat = disney_clearcoat_sample(s, wo, u);
    if (u_lobe >= w.diffuse + w.specular) wi = coat;
#endif
    return bsdf_rough_sample(wi);
}

Terms disney_terms(Surface s, vec3 wo, vec3 wi, vec3 wm) { return disney_specular_terms(s, wo, wi, wm); }
#endif
