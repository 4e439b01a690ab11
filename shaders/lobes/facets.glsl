// One microfacet of the base: reflection off metal and dielectric, refraction through the dielectric. wo, wi and wm in
// the lobe's own frame (bsdf_turn). Transmitted radiance is over the square of the index: path.glsl puts it back.
#if HAS_PRINCIPLED

// The dielectric's reflectance, tinted: F0 by the colour, 1 stays 1, and never above the clear one.
vec3 facets_tinted(Surface s, float f) {
    float f0 = fresnel_normal(s.eta_outside);
    return max(vec3(0.0), f - (1.0 - s.specular_color) * (f0 / (1.0 - f0) * (1.0 - f)));
}

vec3 facets_fresnel(Surface s, float c) {
    vec3 clear = facets_tinted(s, fresnel_dielectric(c, s.eta_outside));
#if HAS_TRANSMISSION
    clear = mix(clear, facets_tinted(s, fresnel_dielectric(c, s.eta)), s.transmission);
#endif
    return mix(clear, mix(s.base_color, vec3(1.0), fresnel_schlick(c)), s.metallic);
}

vec3 facets_through(Surface s, float c) {
    return (1.0 - s.metallic) * s.transmission * (1.0 - fresnel_dielectric(c, s.eta)) * s.base_color;
}

// Chance of reflecting rather than refracting at a facet met at cosine c.
float facets_choice(Surface s, float c) {
#if HAS_TRANSMISSION
    if (s.straight) c = 1.0; // the chance of a perfectly specular event must not hang on the facet
    float r = luminance(facets_fresnel(s, c)), t = luminance(facets_through(s, c));
    return t > 0.0 ? r / (r + t) : 1.0;
#else
    return 1.0;
#endif
}

vec3 facets_reflect(Surface s, vec3 wo, vec3 wi, vec3 wm, float cos_d) {
    return facets_fresnel(s, cos_d) * (microfacet_gtr2(wm, s.alpha) * microfacet_visibility(wo, wi, s.alpha));
}

float facets_reflect_pdf(Surface s, vec3 wo, vec3 wm, float cos_d) {
    return microfacet_visible_pdf(wo, wm, s.alpha) * facets_choice(s, cos_d);
}

#if HAS_TRANSMISSION
// The facet that refracts wo into wi; z = 0 where there is none.
vec3 facets_between(Surface s, vec3 wo, vec3 wi) {
    vec3 h = wo + s.eta * wi;
    float l = dot(h, h);
    if (l == 0.0) return vec3(0.0);
    vec3 wm = h * (inversesqrt(l) * (h.z < 0.0 ? -1.0 : 1.0));
    return dot(wo, wm) > 0.0 && dot(wi, wm) < 0.0 ? wm : vec3(0.0);
}

// Solid angle of facets per solid angle of wi, times 4 cos of wo at the facet [Walter et al. 2007, eq. 17].
float facets_spread(Surface s, vec3 wo, vec3 wi, vec3 wm) {
    float c = dot(wo, wm), e = s.eta * dot(wi, wm);
    return 4.0 * c * abs(e) * s.eta / sqr(c + e);
}

// [Walter et al. 2007, eq. 21] without the cosine of wi; masking across the surface is the product of both sides'.
vec3 facets_transmit(Surface s, vec3 wo, vec3 wi, vec3 wm) {
    float g = 1.0 / ((abs(wo.z) + microfacet_stretch(wo, s.alpha)) * (abs(wi.z) + microfacet_stretch(wi, s.alpha)));
    return facets_through(s, dot(wo, wm)) * (g * microfacet_gtr2(wm, s.alpha) * facets_spread(s, wo, wi, wm));
}

float facets_transmit_pdf(Surface s, vec3 wo, vec3 wi, vec3 wm) {
    float c = dot(wo, wm);
    return microfacet_visible_pdf(wo, wm, s.alpha) * facets_spread(s, wo, wi, wm) * (1.0 - facets_choice(s, c));
}
#endif

#if HAS_TRANSMISSION
vec3 facets_image(vec3 wi) { return vec3(wi.xy, -wi.z); }

bool facets_folds(Surface s) { return s.transmission > 0.0 && s.metallic < 1.0; }

// Density of wi as the image of a direction on the wrong side.
float facets_reflect_folded(Surface s, vec3 wo, vec3 wi) {
    vec3 wm = wo + facets_image(wi);
    if (wm.z <= 0.0 || !facets_folds(s)) return 0.0;
    wm = normalize(wm);
    return facets_reflect_pdf(s, wo, wm, dot(wo, wm));
}

float facets_transmit_folded(Surface s, vec3 wo, vec3 wi) {
    vec3 image = facets_image(wi), wm = facets_between(s, wo, image);
    return wm.z > 0.0 ? facets_transmit_pdf(s, wo, image, wm) : 0.0;
}
#endif

// Reflected or refracted at a visible facet, by v. Where the one ends below the surface, or the other above it, light
// meets another facet: with glass, where many such losses would add up, its image on the right side stands for that.
vec3 facets_sample(Surface s, vec3 wo, float v, vec2 u) {
    vec3 wm = s.mirror ? vec3(0.0, 0.0, 1.0) : microfacet_visible_normal(wo, s.alpha, u);
    float c = dot(wo, wm);
#if HAS_TRANSMISSION
    if (v >= facets_choice(s, c)) {
        if (s.straight) return -wo;
        float k = 1.0 / s.eta;
        float cos_t = sqrt(max(0.0, 1.0 - k * k * (1.0 - c * c)));
        vec3 refracted = (k * c - cos_t) * wm - k * wo;
        return vec3(refracted.xy, -abs(refracted.z));
    }
#endif
    vec3 reflected = 2.0 * c * wm - wo;
#if HAS_TRANSMISSION
    if (facets_folds(s)) reflected.z = abs(reflected.z);
#endif
    return reflected.z > 0.0 ? reflected : vec3(0.0);
}
#endif
