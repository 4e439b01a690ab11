// A thin layer of lacquer of index 1.5: GGX, or a mirror. The light that it does not reflect goes on to the base.
#if HAS_PRINCIPLED && HAS_CLEARCOAT
const float CLEARCOAT_ETA = 1.5;

float principled_clearcoat_eval(Surface s, vec3 wo, vec3 wi, vec3 wm, float cos_d) {
    if (s.coat_is_delta) return 0.0;
    vec2 alpha = vec2(s.alpha_coat);
    return s.clearcoat * fresnel_dielectric(cos_d, CLEARCOAT_ETA) * ggx_d(wm, alpha)
         * ggx_visibility(wo, wi, alpha);
}

float principled_clearcoat_albedo(Surface s, float c) {
    return energy_albedo(vec3(0.0, 0.0, c), s.coat_roughness, 1.0, CLEARCOAT_ETA).y * s.clearcoat;
}

vec3 principled_clearcoat_sample(Surface s, vec3 wo, vec2 u) {
    vec3 wm = s.coat_is_delta ? vec3(0.0, 0.0, 1.0) : ggx_visible_normal(wo, vec2(s.alpha_coat), u);
    vec3 wi = 2.0 * dot(wo, wm) * wm - wo;
    return wi.z > 0.0 ? wi : vec3(0.0);
}

float principled_clearcoat_pdf(Surface s, vec3 wo, vec3 wm) {
    return s.coat_is_delta ? 0.0 : ggx_visible_pdf(wo, wm, vec2(s.alpha_coat));
}
#endif
