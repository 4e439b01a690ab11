// A second, thin, isotropic layer of polyurethane: GTR1 with its long tail [Burley 2012, section 5.6].

#if HAS_CLEARCOAT
// The GTR1 (Berry) density of wm, 1/sr [Burley 2012, eq. 4], with t as sin^2 + alpha^2 cos^2, which does not cancel.
float disney_clearcoat_gtr1(vec3 wm, float alpha) {
    float a2 = alpha * alpha;
    float t = dot(wm.xy, wm.xy) + a2 * wm.z * wm.z;
    return (a2 - 1.0) / (PI * log(a2) * t);
}

// A normal with density gtr1(wm) cos(theta_m) [Burley 2012, eq. 5]; its sine is taken without cancelling.
vec3 disney_clearcoat_gtr1_normal(float alpha, vec2 u) {
    float a2 = alpha * alpha;
    float sin2 = clamp((exp(log(a2) * (1.0 - u.y)) - a2) / (1.0 - a2), 0.0, 1.0);
    float s = sqrt(sin2), phi = TWO_PI * u.x;
    return vec3(s * cos(phi), s * sin(phi), sqrt(1.0 - sin2));
}

float disney_clearcoat_eval(Surface s, vec3 wo, vec3 wi, vec3 wm, float cos_d) {
    float f = mix(0.04, 1.0, fresnel_schlick(cos_d));
    float g = ggx_smith(wi.z, 0.25) * ggx_smith(wo.z, 0.25);
    return 0.25 * s.clearcoat * g * f * disney_clearcoat_gtr1(wm, s.alpha_coat);
}

float disney_clearcoat_weight(Surface s, vec3 wo) { return 0.25 * s.clearcoat * mix(0.04, 1.0, fresnel_schlick(wo.z)); }

vec3 disney_clearcoat_sample(Surface s, vec3 wo, vec2 u) {
    vec3 wm = disney_clearcoat_gtr1_normal(s.alpha_coat, u);
    return 2.0 * dot(wo, wm) * wm - wo;
}

float disney_clearcoat_pdf(Surface s, vec3 wm, float cos_d) {
    return cos_d > 0.0 ? disney_clearcoat_gtr1(wm, s.alpha_coat) * wm.z / (4.0 * cos_d) : 0.0;
}
#endif
