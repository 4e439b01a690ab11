// The model `microfacet`: any distribution, geometry and Fresnel term of the literature over a diffuse lobe,
// f = f_d + D G F / (4 (n.wi) (n.wo)) [Cook & Torrance 1982, eq. 2]. For comparison: it may lose or gain energy.
#if HAS_MICROFACET

vec3 microfacet_model_eval(Surface s, vec3 wo, vec3 wi, vec3 wm, float cos_d) {
    float dg = distribution_d(s, wm) * geometry_term(s, wo, wi, wm, cos_d);
    return LOBE(LOBE_DIFFUSE, diffuse_term(s, wo, wi, cos_d)) + LOBE(LOBE_SPECULAR, fresnel_term(s, cos_d) * dg);
}

// The chance of picking the diffuse lobe. The floor of 0.05 keeps the facets sampled where they are dark head-on.
float microfacet_model_diffuse_chance(Surface s, vec3 wo) {
    float diffuse = luminance(s.base_color);
    return diffuse / (diffuse + max(0.05, luminance(fresnel_term(s, wo.z))));
}

float microfacet_model_pdf(Surface s, vec3 wo, vec3 wi, vec3 wm, float cos_d) {
    return mix(distribution_pdf(s, wo, wm, cos_d), lambert_pdf(wi), microfacet_model_diffuse_chance(s, wo));
}

vec3 microfacet_model_sample(Surface s, vec3 wo, float u_lobe, vec2 u) {
    vec3 wm = distribution_sample(s, wo, u);
    vec3 mirrored = 2.0 * dot(wo, wm) * wm - wo;
    return u_lobe < microfacet_model_diffuse_chance(s, wo) ? lambert_sample(u) : mirrored;
}
#endif
