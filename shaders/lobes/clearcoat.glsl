// A second, thin, isotropic layer of polyurethane: GTR1 with its long tail [Burley 2012, section 5.6].

float clearcoat_eval(Surface s, vec3 wo, vec3 wi, vec3 wm, float cos_d) {
    float f = mix(0.04, 1.0, fresnel_schlick(cos_d));
    float g = microfacet_smith(wi.z, 0.25) * microfacet_smith(wo.z, 0.25);
    return 0.25 * s.clearcoat * g * f * microfacet_gtr1(wm, s.alpha_coat);
}

float clearcoat_weight(Surface s, vec3 wo) { return 0.25 * s.clearcoat * mix(0.04, 1.0, fresnel_schlick(wo.z)); }

vec3 clearcoat_sample(Surface s, vec3 wo, vec2 u) {
    vec3 wm = microfacet_gtr1_normal(s.alpha_coat, u);
    return 2.0 * dot(wo, wm) * wm - wo;
}

float clearcoat_pdf(Surface s, vec3 wm, float cos_d) {
    return cos_d > 0.0 ? microfacet_gtr1(wm, s.alpha_coat) * wm.z / (4.0 * cos_d) : 0.0;
}
