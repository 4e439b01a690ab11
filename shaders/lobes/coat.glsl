// A thin layer of lacquer, index 1.5: GGX, or a mirror. What it does not reflect goes on to the base.
#if HAS_PRINCIPLED && HAS_CLEARCOAT
const float COAT_ETA = 1.5;

float coat_eval(Surface s, vec3 wo, vec3 wi, vec3 wm, float cos_d) {
    if (s.coat_mirror) return 0.0;
    vec2 alpha = vec2(s.alpha_coat);
    return s.clearcoat * fresnel_dielectric(cos_d, COAT_ETA) * microfacet_gtr2(wm, alpha)
         * microfacet_visibility(wo, wi, alpha);
}

float coat_kept(Surface s, float c) {
    float roughness = s.coat_mirror ? 0.0 : sqrt(s.alpha_coat);
    return energy_albedo(vec3(0.0, 0.0, c), roughness, 1.0, COAT_ETA).y * s.clearcoat;
}

vec3 coat_sample(Surface s, vec3 wo, vec2 u) {
    vec3 wm = s.coat_mirror ? vec3(0.0, 0.0, 1.0) : microfacet_visible_normal(wo, vec2(s.alpha_coat), u);
    vec3 wi = 2.0 * dot(wo, wm) * wm - wo;
    return wi.z > 0.0 ? wi : vec3(0.0);
}

float coat_pdf(Surface s, vec3 wo, vec3 wm) {
    return s.coat_mirror ? 0.0 : microfacet_visible_pdf(wo, wm, vec2(s.alpha_coat));
}
#endif
