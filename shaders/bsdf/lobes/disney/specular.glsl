// Reflection from the base: GGX, Schlick's Fresnel term, and masking by the course notes' remapped roughness.

vec3 disney_specular_fresnel(Surface s, float cos_d) { return mix(s.spec0, vec3(1.0), fresnel_schlick(cos_d)); }

// Masking and shadowing, divided by 4 cos cos.
float disney_specular_visibility(Surface s, vec3 wo, vec3 wi) {
    return ggx_smith(wi.z, s.alpha_mask) * ggx_smith(wo.z, s.alpha_mask);
}

vec3 disney_specular_eval(Surface s, vec3 wo, vec3 wi, vec3 wm, float cos_d) {
    return disney_specular_visibility(s, wo, wi) * disney_specular_fresnel(s, cos_d) * ggx_d(wm, s.alpha);
}

// The floor of 0.05 keeps the lobe sampled where spec0 is 0, as its reflectance still rises to 1 towards grazing
// angles.
float disney_specular_weight(Surface s, vec3 wo) {
    return max(0.05, luminance(disney_specular_fresnel(s, wo.z)));
}

vec3 disney_specular_sample(Surface s, vec3 wo, vec2 u) {
    vec3 wm = ggx_visible_normal(wo, s.alpha, u);
    return 2.0 * dot(wo, wm) * wm - wo;
}

float disney_specular_pdf(Surface s, vec3 wo, vec3 wm) { return ggx_visible_pdf(wo, wm, s.alpha); }

// The highlight's own terms; wm is the normal of a facet.
Terms disney_specular_terms(Surface s, vec3 wo, vec3 wi, vec3 wm) {
    return Terms(disney_specular_fresnel(s, wm.z), ggx_d(bsdf_turn(s, wm), s.alpha),
                 disney_specular_visibility(s, wo, wi), true);
}
