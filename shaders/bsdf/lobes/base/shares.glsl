// The shares of light that the boundary of the base keeps from what is under it, and that are lost between its facets.
// The tables have them for the bare boundary; a film changes them by a mean over facets, which are a few cosines and
// weights of energy_facets.
#if ANY_NEEDS_TABLES
// The share of untinted light that comes back after all of what the facets of the dielectric lose.
BASE_SHARE shares_clear(Surface s) { return multiscatter_fresnel(base_dielectric_mean(s), s.albedo_mean.x); }

#if HAS_FILM
// Rules of energy_facets: over the facets that reflect light from a direction or, weighted by its cosine, from all of
// them; FACETS_MET further are those over all facets that the light meets.
const float FACETS_OF_ONE = 0.0, FACETS_OF_ALL = 2.0, FACETS_MET = 4.0;
// Up to this roughness the loss is that of bare facets: so little that its change is within the error of the tables.
const float SHARES_SMOOTH = 0.3;
// Directions of equal weight for the mean over smooth films: films of 10 micrometres in water still ripple more.
const int SHARES_RIPPLES = 12;
// The part of a change of the loss that is left out, so that nothing is put back twice.
const float SHARES_MARGIN = 0.05;

// What a film adds to the dielectric's reflectance at cosine c.
vec3 shares_gain(Surface s, float c, float eta) { return base_dielectric(s, c, eta) - base_bare(s, c, eta); }

// The mean of that by a rule for light of cosine c; `bare` is the mean of the bare boundary's reflectance.
vec3 shares_mean(Surface s, float c, float eta, float rule, out float bare) {
    float roughness = s.is_delta ? 0.0 : s.roughness;
    vec4 cosines = energy_facets(c, roughness, rule), weights = energy_facets(c, roughness, rule + 1.0);
    vec3 gain = vec3(0.0);
    bare = 0.0;
    for (int i = 0; i < 4; i++) {
        gain += weights[i] * shares_gain(s, cosines[i], eta);
        bare += weights[i] * base_bare(s, cosines[i], eta);
    }
    return gain;
}

// The cosine-weighted mean over all directions of what a film adds. Thick films ripple with the angle more than four
// cosines show, and rough facets less than smooth ones.
vec3 shares_mean_gain(Surface s) {
    float bare, rough = s.is_delta ? 0.0 : clamp((s.roughness - SHARES_SMOOTH) / SHARES_SMOOTH, 0.0, 1.0);
    vec3 ripples = vec3(0.0), facets = vec3(0.0);
    if (rough < 1.0) {
        for (int i = 0; i < SHARES_RIPPLES; i++) {
            ripples += shares_gain(s, sqrt((float(i) + 0.5) / float(SHARES_RIPPLES)), s.eta_outside);
        }
    }
    if (rough > 0.0) facets = shares_mean(s, 0.0, s.eta_outside, FACETS_OF_ALL, bare);
    return mix(ripples / float(SHARES_RIPPLES), facets, rough);
}

// The loss between the facets of glass, of which `albedo` has that of bare ones: light that a facet reflects because of
// the film is lost as reflected light is, and no more as what it passes.
vec3 shares_lost(Surface s, float c, vec4 albedo, bool inside, float rule) {
    float eta = inside ? 1.0 / s.eta_outside : s.eta_outside, lost = inside ? albedo.w : albedo.z, bare, met;
    vec3 gain = shares_mean(s, c, eta, rule, bare), passed = gain;
#if HAS_THIN_WALLS
    // The loss of panes is a share of what goes through.
    if (s.is_thin) {
        vec3 through = 1.0 - pane_reflected(albedo.x, clamp(albedo.y + albedo.x * gain, 0.0, albedo.x));
        return clamp(lost * through / max(1.0 - pane_reflected(albedo), 1e-3), 0.0, 1.0);
    }
#endif
    // Of light from inside, facets that reflect it to the outer side of the horizon let hardly any pass.
    if (inside) met = bare;
    else passed = shares_mean(s, c, eta, rule + FACETS_MET, met);
    vec3 less = albedo.x * gain, more = (1.0 - lost - albedo.x * bare) / max(1.0 - met, 1e-3) * passed;
    vec3 change = more - less - SHARES_MARGIN * (abs(less) + abs(more));
    return clamp(lost + change * clamp((s.roughness - SHARES_SMOOTH) / SHARES_SMOOTH, 0.0, 1.0), 0.0, 1.0);
}
#endif

// The share of light from w that facets reflect once, and of that from wo.
BASE_SHARE shares_once(Surface s, vec3 w, vec4 albedo) {
#if HAS_FILM
    float bare;
    if (s.film > 0.0)
        return clamp(albedo.y + albedo.x * shares_mean(s, w.z, s.eta_outside, FACETS_OF_ONE, bare), 0.0, albedo.x);
#endif
    return BASE_SHARE(albedo.y);
}

BASE_SHARE shares_once(Surface s) {
#if HAS_FILM
    if (s.film > 0.0) return s.film_once;
#endif
    return BASE_SHARE(s.albedo.y);
}

// The share of untinted light from w that the boundary keeps from what is under it, after any number of scatterings.
BASE_SHARE shares_kept(Surface s, vec3 w, vec4 albedo) {
    BASE_SHARE kept = multiscatter_albedo(albedo, shares_clear(s));
#if HAS_FILM
    if (s.film > 0.0) kept = clamp(kept + (shares_once(s, w, albedo) - albedo.y), 0.0, 1.0);
#endif
    return kept;
}

// The same for wo, and its cosine-weighted mean, once shares_face has been called.
BASE_SHARE shares_kept(Surface s) {
#if HAS_FILM
    if (s.film > 0.0) return s.film_kept;
#endif
    return multiscatter_albedo(s.albedo, shares_clear(s));
}

BASE_SHARE shares_kept_mean(Surface s) {
#if HAS_FILM
    if (s.film > 0.0) return s.film_kept_mean;
#endif
    return multiscatter_albedo(s.albedo_mean, shares_clear(s));
}

#if HAS_TRANSMISSION
// The loss between the facets of glass of light from w on the one side or the other, and that for wo.
BASE_SHARE shares_lost(Surface s, vec3 w, vec4 albedo, bool inside) {
#if HAS_FILM
    if (s.film > 0.0) return shares_lost(s, abs(w.z), albedo, inside, FACETS_OF_ONE);
#endif
    return BASE_SHARE(inside ? albedo.w : albedo.z);
}

BASE_SHARE shares_lost(Surface s) {
#if HAS_FILM
    if (s.film > 0.0) return s.film_lost;
#endif
    return BASE_SHARE(s.inside ? s.albedo.w : s.albedo.z);
}
#endif

// Sets what depends on wo.
void shares_face(vec3 wo, vec4 albedo, vec4 albedo_mean, inout Surface s) {
    s.albedo = albedo;
    s.albedo_mean = albedo_mean;
#if HAS_FILM
    s.film_cosine = wo.z;
    if (s.film > 0.0) {
        s.film_mean = vec3(mix(fresnel_mean(s.eta_outside), 1.0, s.excess));
        s.film_metal_mean = vec3(0.0);
        for (int i = 0; i < 4; i++) {
            s.film_mean += FRESNEL_WEIGHTS[i] * shares_gain(s, FRESNEL_COSINES[i], s.eta_outside);
            s.film_metal_mean += FRESNEL_WEIGHTS[i] * base_metal(s, FRESNEL_COSINES[i]);
        }
        s.film_once = shares_once(s, wo, albedo);
        s.film_kept = shares_kept(s, wo, albedo);
        vec3 kept = multiscatter_albedo(albedo_mean, shares_clear(s)) + albedo_mean.x * shares_mean_gain(s);
        s.film_kept_mean = clamp(kept, 0.0, 1.0);
#if HAS_TRANSMISSION
        s.film_lost = shares_lost(s, wo.z, albedo, s.inside, FACETS_OF_ONE);
        s.film_lost_outside = shares_lost(s, 0.0, albedo_mean, false, FACETS_OF_ALL);
        s.film_lost_inside = shares_lost(s, 0.0, albedo_mean, true, FACETS_OF_ALL);
#endif
    }
#endif
}
#endif
