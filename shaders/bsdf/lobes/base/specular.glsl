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

// What a facet does to light that meets it at a cosine.
struct BaseFacet {
    vec3 reflected;
    vec3 passed;
    float chance; // of reflecting rather than refracting
};

#if HAS_TRANSMISSION
// The share that a facet passes which reflects `r`; of what goes straight through rough facets with a film all that these
// do not reflect.
vec3 base_passed(Surface s, BASE_SHARE r) {
    vec3 kept = vec3(r);
#if HAS_THIN_WALLS
    if (s.is_thin) kept = vec3(pane_of(r));
#endif
#if HAS_FILM
    if (s.index_matched && !s.is_delta) {
        kept = s.film_kept;
#if HAS_THIN_WALLS
        if (s.is_thin) kept = pane_reflected(s.albedo.x, s.film_once);
#endif
    }
#endif
    return (1.0 - s.metallic) * s.transmission * (1.0 - kept) * s.clear_color;
}

// What goes through in all: of rough panes that is the same whatever the facet.
vec3 base_through(Surface s, vec3 passed) {
#if HAS_THIN_WALLS
    if (s.is_thin && !s.is_delta) return pane_transmittance(s, pane_reflected(s.albedo.x, shares_once(s)));
#endif
    return passed;
}
#endif

// The facet that light meets at cosine c.
BaseFacet base_meets(Surface s, float c) {
    BaseFacet r = BaseFacet(vec3(0.0), vec3(0.0), 1.0);
    BASE_SHARE outer = BASE_SHARE(0.0), own = outer;
    bool same = true; // both sides of what is seen reflect as the outer one
#if HAS_TRANSMISSION
    same = s.eta == s.eta_outside;
#if HAS_THIN_WALLS
    same = same || s.is_thin;
#endif
#endif
#if HAS_FILM
    for (int k = 0; k < (same ? 1 : 2); k++) { // a loop, so that drivers have the film once
        own = base_dielectric(s, c, k == 0 ? s.eta_outside : s.eta);
        if (k == 0) outer = own;
    }
#else
    outer = base_dielectric(s, c, s.eta_outside);
    own = same ? outer : base_dielectric(s, c, s.eta);
#endif
    vec3 clear = models_tinted(s, outer);
#if HAS_TRANSMISSION
    vec3 facets = models_tinted(s, own);
#if HAS_THIN_WALLS
    if (s.is_thin) facets = pane_of(facets);
#endif
    clear = mix(clear, facets, s.transmission);
    r.passed = base_passed(s, own);
#endif
    r.reflected = mix(clear, base_metal(s, c), s.metallic);
#if HAS_TRANSMISSION
    float up = luminance(r.reflected), down = luminance(base_through(s, r.passed));
    if (down > 0.0) r.chance = up / (up + down);
#if HAS_FILM
    // A film on nothing may reflect nothing for wo and much at its facets.
    bool clamps = s.index_matched && s.film > 0.0 && down > 0.0;
#if HAS_THIN_WALLS
    clamps = clamps && !s.is_thin;
#endif
    if (clamps) r.chance = clamp(r.chance, 0.05, 0.95);
#endif
#endif
    return r;
}

// The cosine that decides on the chance of reflecting: that at the facet, but for panes that of wo.
float base_deciding(Surface s, vec3 wo, float cos_d) {
#if HAS_THIN_WALLS
    if (s.is_thin) return wo.z;
#endif
    return cos_d;
}

// The chance of reflecting rather than refracting at a facet that light hits at cosine c. That of a perfectly specular
// event must not depend on the facet.
float base_chance(Surface s, vec3 wo, float c, BaseFacet facet) {
#if HAS_FILM
    bool same = s.index_matched;
#if HAS_THIN_WALLS
    same = same || s.is_thin;
#endif
    return same ? s.film_chance : facet.chance;
#elif HAS_TRANSMISSION
    return base_meets(s, s.index_matched ? 1.0 : base_deciding(s, wo, c)).chance;
#else
    return 1.0;
#endif
}

// A facet that wo hits as it does the surface, once base_face has been called.
BaseFacet base_level(Surface s, vec3 wo) {
#if HAS_FILM
    return BaseFacet(s.film_reflected, s.film_passed, s.film_chance);
#else
    BaseFacet r = base_meets(s, wo.z);
    r.chance = base_chance(s, wo, wo.z, r);
    return r;
#endif
}

vec3 base_fresnel(Surface s, float c) { return base_meets(s, c).reflected; }

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

vec3 base_image(vec3 wi) { return vec3(wi.xy, -wi.z); }
#endif

// What the facets scatter from wo into wi without the cosine of wi, and the density with which base_sample gives wi. That
// has two parts, as wi may also be the image of a direction on the wrong side of the surface; a loop has both, so that
// drivers have the facet once.
Scatter base_scatter(Surface s, vec3 wo, vec3 wi) {
    Scatter r = Scatter(vec3(0.0), 0.0);
    vec2 sampled = base_sampled_alpha(s);
    vec3 to = wi;
    bool own = true;
#if HAS_TRANSMISSION
    bool up = wi.z > 0.0;
    for (int k = 0; k < (base_folds(s) ? 2 : 1); k++) {
        vec3 wm = up ? normalize(wo + to) : base_half_vector(s, wo, to);
#else
    {
        vec3 wm = normalize(wo + to);
#endif
        float c = dot(wo, wm), bends = 1.0;
        BaseFacet facet = base_meets(s, c);
        float chance = base_chance(s, wo, c, facet), d = ggx_d(wm, s.alpha);
        vec3 f = facet.reflected * (d * ggx_visibility(wo, to, s.alpha));
#if HAS_TRANSMISSION
        if (!up) { // [Walter et al. 2007, eq. 21]; the masking of the two sides is multiplied
            float g = 1.0 / ((abs(wo.z) + ggx_stretch(wo, s.alpha)) * (abs(to.z) + ggx_stretch(to, s.alpha)));
            bends = base_jacobian(s, wo, to, wm);
            f = facet.passed * (g * d * bends);
            chance = 1.0 - chance;
        }
#endif
        if (wm.z > 0.0) {
            if (own) r.f = f;
            r.pdf += ggx_visible_pdf(wo, wm, sampled) * bends * chance;
        }
#if HAS_TRANSMISSION
        to = base_image(wi);
        own = false;
#endif
    }
    return r;
}

// A direction reflected or refracted at a visible facet; v decides which, by `chance` where the surface is smooth. Where the reflected one ends below the
// surface, or the refracted one above it, light meets another facet. With glass, where many such losses would add up,
// the image on the right side of the surface stands for that.
vec3 base_sample(Surface s, vec3 wo, float v, float chance, vec2 u) {
    vec3 wm = s.is_delta ? vec3(0.0, 0.0, 1.0) : ggx_visible_normal(wo, base_sampled_alpha(s), u);
    float c = dot(wo, wm);
#if HAS_TRANSMISSION
    if (v >= (s.is_delta ? chance : base_chance(s, wo, c, base_meets(s, c)))) {
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
