// The microfacets of a base that mixes metal and dielectric: both reflect, the dielectric refracts. wo, wi and wm are in
// the lobe's own frame (bsdf_turn). Transmitted radiance is divided by the square of the index; sides_eta_scale
// multiplies it back.
#if ANY_NEEDS_TABLES

// The dielectric's untinted reflectance at cosine c, without and with what lies on it.
float base_bare(Surface s, float c, float eta) { return mix(fresnel_dielectric(c, eta), 1.0, s.excess); }

BASE_SHARE base_dielectric(Surface s, float c, float eta) {
    float bare = base_bare(s, c, eta);
#if HAS_FILM
    if (s.film > 0.0) {
        vec3 film = film_dielectric(s, film_sine2(s, c, eta));
        return mix(vec3(bare), mix(film, vec3(1.0), s.excess), s.film);
    }
#endif
    return BASE_SHARE(bare);
}

// The metal's reflectance at cosine c.
vec3 base_metal(Surface s, float c) {
    vec3 f = models_metal(s, c);
#if HAS_METAL_FILM
    if (s.film > 0.0) f = mix(f, film_metal(s, c), s.film);
#endif
    return f;
}

vec3 base_fresnel(Surface s, float c) {
    vec3 clear = models_tinted(s, base_dielectric(s, c, s.eta_outside));
#if HAS_THIN_WALLS
    vec3 facets = s.is_thin ? pane_of(clear) : models_tinted(s, base_dielectric(s, c, s.eta));
    clear = mix(clear, facets, s.transmission);
#elif HAS_TRANSMISSION
    clear = mix(clear, models_tinted(s, base_dielectric(s, c, s.eta)), s.transmission);
#endif
    return mix(clear, base_metal(s, c), s.metallic);
}

vec3 base_transmittance(Surface s, float c) {
#if HAS_FILM
    // What passes straight through a film of rough facets is what they do not reflect in all.
    if (s.index_matched && !s.is_delta) {
        vec3 kept = s.film_kept;
#if HAS_THIN_WALLS
        if (s.is_thin) kept = pane_reflected(s.albedo.x, s.film_once);
#endif
        return (1.0 - s.metallic) * s.transmission * (1.0 - kept) * s.clear_color;
    }
#endif
#if HAS_THIN_WALLS
    BASE_SHARE r = base_dielectric(s, c, s.is_thin ? s.eta_outside : s.eta);
    if (s.is_thin) r = pane_of(r);
    return (1.0 - s.metallic) * s.transmission * (1.0 - r) * s.clear_color;
#endif
    return (1.0 - s.metallic) * s.transmission * (1.0 - base_dielectric(s, c, s.eta)) * s.clear_color;
}

// The chance of reflecting rather than refracting at a facet that light hits at cosine c.
float base_reflect_chance(Surface s, float c) {
#if HAS_TRANSMISSION
#if HAS_FILM
    if (s.index_matched) c = s.film_cosine;
#else
    if (s.index_matched) c = 1.0; // the chance of a perfectly specular event must not depend on the facet
#endif
#if HAS_THIN_WALLS
    if (s.is_thin) return pane_reflect_chance(s, c);
#endif
    float r = luminance(base_fresnel(s, c)), t = luminance(base_transmittance(s, c));
#if HAS_FILM
    // A film on nothing may reflect nothing for wo and much at its facets.
    if (s.index_matched && s.film > 0.0 && t > 0.0) return clamp(r / (r + t), 0.05, 0.95);
#endif
    return t > 0.0 ? r / (r + t) : 1.0;
#else
    return 1.0;
#endif
}

vec3 base_reflect(Surface s, vec3 wo, vec3 wi, vec3 wm, float cos_d) {
    return base_fresnel(s, cos_d) * (ggx_d(wm, s.alpha) * ggx_visibility(wo, wi, s.alpha));
}

// The cosine that decides on the chance of reflecting: that at the facet, but for panes that of wo.
float base_deciding(Surface s, vec3 wo, float cos_d) {
#if HAS_THIN_WALLS
    if (s.is_thin) return wo.z;
#endif
    return cos_d;
}

bool base_folds(Surface s) {
#if HAS_THIN_WALLS
    if (s.is_thin) return false;
#endif
#if HAS_TRANSMISSION
    return s.transmission > 0.0 && s.metallic < 1.0;
#else
    return false;
#endif
}

// The alpha by which facets are sampled. Those of rough glass that are visible from wo but far tilted send their light
// to other facets; sampled as often as they are visible they would leave too few samples to what comes out, whose
// weights multiply along a path that stays inside. With 0.4 the mean square of the weights that stay exceeds its least
// possible value half as much as without, for alphas from 0.3 on; from 1 on a narrower lobe would miss the tails.
vec2 base_sampled_alpha(Surface s) { return base_folds(s) ? s.alpha / (1.0 + 0.4 * min(s.alpha, vec2(1.0))) : s.alpha; }

float base_reflect_pdf(Surface s, vec3 wo, vec3 wm, float cos_d) {
    return ggx_visible_pdf(wo, wm, base_sampled_alpha(s)) * base_reflect_chance(s, base_deciding(s, wo, cos_d));
}

#if HAS_TRANSMISSION
// The normal of the facet that refracts wo into wi; its z is 0 where there is none.
vec3 base_half_vector(Surface s, vec3 wo, vec3 wi) {
    vec3 h = wo + s.eta * wi;
    float l = dot(h, h);
    if (l == 0.0) return vec3(0.0);
    vec3 wm = h * (inversesqrt(l) * (h.z < 0.0 ? -1.0 : 1.0));
    return dot(wo, wm) > 0.0 && dot(wi, wm) < 0.0 ? wm : vec3(0.0);
}

// The solid angle of facet normals per solid angle of wi, times 4 cos of wo at the facet [Walter et al. 2007, eq. 17].
float base_jacobian(Surface s, vec3 wo, vec3 wi, vec3 wm) {
    float c = dot(wo, wm), e = s.eta * dot(wi, wm);
    return 4.0 * c * abs(e) * s.eta / sqr(c + e);
}

// [Walter et al. 2007, eq. 21] without the cosine of wi; the masking of the two sides is multiplied.
vec3 base_transmit(Surface s, vec3 wo, vec3 wi, vec3 wm) {
    float g = 1.0 / ((abs(wo.z) + ggx_stretch(wo, s.alpha)) * (abs(wi.z) + ggx_stretch(wi, s.alpha)));
    return base_transmittance(s, dot(wo, wm)) * (g * ggx_d(wm, s.alpha) * base_jacobian(s, wo, wi, wm));
}

float base_transmit_pdf(Surface s, vec3 wo, vec3 wi, vec3 wm) {
    float c = dot(wo, wm);
    return ggx_visible_pdf(wo, wm, base_sampled_alpha(s)) * base_jacobian(s, wo, wi, wm)
         * (1.0 - base_reflect_chance(s, c));
}

vec3 base_image(vec3 wi) { return vec3(wi.xy, -wi.z); }

// The density of wi as the image of a direction on the wrong side of the surface.
float base_reflect_folded(Surface s, vec3 wo, vec3 wi) {
    vec3 wm = wo + base_image(wi);
    if (wm.z <= 0.0 || !base_folds(s)) return 0.0;
    wm = normalize(wm);
    return base_reflect_pdf(s, wo, wm, dot(wo, wm));
}

float base_transmit_folded(Surface s, vec3 wo, vec3 wi) {
    vec3 image = base_image(wi), wm = base_half_vector(s, wo, image);
    return wm.z > 0.0 ? base_transmit_pdf(s, wo, image, wm) : 0.0;
}
#endif

// A direction reflected or refracted at a visible facet; v decides which. Where the reflected one ends below the
// surface, or the refracted one above it, light meets another facet. With glass, where many such losses would add up,
// the image on the right side of the surface stands for that.
vec3 base_sample(Surface s, vec3 wo, float v, vec2 u) {
    vec3 wm = s.is_delta ? vec3(0.0, 0.0, 1.0) : ggx_visible_normal(wo, base_sampled_alpha(s), u);
    float c = dot(wo, wm);
#if HAS_TRANSMISSION
    if (v >= base_reflect_chance(s, base_deciding(s, wo, c))) {
        if (s.index_matched) return -wo;
#if HAS_THIN_WALLS
        if (s.is_thin) return pane_sample(s, wo, u);
#endif
        float k = 1.0 / s.eta;
        float cos_t = sqrt(max(0.0, 1.0 - k * k * (1.0 - c * c)));
        vec3 refracted = (k * c - cos_t) * wm - k * wo;
        return vec3(refracted.xy, -abs(refracted.z));
    }
#endif
    vec3 reflected = 2.0 * c * wm - wo;
#if HAS_TRANSMISSION
    if (base_folds(s)) reflected.z = abs(reflected.z);
#endif
    return reflected.z > 0.0 ? reflected : vec3(0.0);
}
#endif
