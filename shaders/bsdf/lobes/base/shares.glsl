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

// Means of what the film adds to the dielectric's reflectance, and of the bare boundary's reflectance.
struct SharesMean {
    vec3 gain;
    float bare;
};

// Over four cosines of these weights; of none where it is not `needed`.
SharesMean shares_mean(Surface s, vec4 cosines, vec4 weights, float eta, bool needed) {
    SharesMean r = SharesMean(vec3(0.0), 0.0);
    for (int i = 0; i < (needed ? 4 : 0); i++) {
        r.gain += weights[i] * shares_gain(s, cosines[i], eta);
        r.bare += weights[i] * base_bare(s, cosines[i], eta);
    }
    return r;
}

// The roughness of the round lobe whose facets lie to w as those of this one do: slanting light sees their slopes along its
// azimuth, light from above those along both axes.
float shares_roughness(Surface s, vec3 w) {
#if HAS_ANISOTROPIC
    if (!s.is_delta && s.aspect < 1.0) {
        vec3 turned = bsdf_turn(s, w);
        return sqrt(sqrt(dot(turned * turned, vec3(s.alpha * s.alpha, s.alpha.x * s.alpha.y))));
    }
#endif
    return s.is_delta ? 0.0 : s.roughness;
}

// Over the facets that light from w meets, by a rule.
SharesMean shares_mean(Surface s, vec3 w, float eta, float rule, bool needed) {
    float roughness = shares_roughness(s, w);
    return shares_mean(s, energy_facets(w.z, roughness, rule), energy_facets(w.z, roughness, rule + 1.0), eta, needed);
}

float shares_eta(Surface s, bool inside) { return inside ? 1.0 / s.eta_outside : s.eta_outside; }

// The loss between the facets of glass, of which `albedo` has that of bare ones: light that a facet reflects because of
// the film is lost as reflected light is, and no more as what it passes. `some` is the mean over the facets that reflect
// the light to its own side, `all` that over those that it meets; of light from inside, facets that reflect it to the outer
// side of the horizon let hardly any pass, and `some` takes its place.
vec3 shares_loss(Surface s, vec4 albedo, bool inside, SharesMean some, SharesMean all) {
    float lost = inside ? albedo.w : albedo.z;
#if HAS_THIN_WALLS
    // The loss of panes is a share of what goes through.
    if (s.is_thin) {
        vec3 through = 1.0 - pane_reflected(albedo.x, clamp(albedo.y + albedo.x * some.gain, 0.0, albedo.x));
        return clamp(lost * through / max(1.0 - pane_reflected(albedo), 1e-3), 0.0, 1.0);
    }
#endif
    if (inside) all = some;
    vec3 less = albedo.x * some.gain, more = (1.0 - lost - albedo.x * some.bare) / max(1.0 - all.bare, 1e-3) * all.gain;
    vec3 change = more - less - SHARES_MARGIN * (abs(less) + abs(more));
    return clamp(lost + change * clamp((s.roughness - SHARES_SMOOTH) / SHARES_SMOOTH, 0.0, 1.0), 0.0, 1.0);
}

// Sets what depends on wo, of a surface with a film. All means are taken in one loop: drivers inline each call, and the
// film is most of such a kernel.
void shares_face_film(vec3 wo, vec4 albedo, vec4 albedo_mean, inout Surface s) {
    float of_wo = shares_roughness(s, wo), of_all = s.is_delta ? 0.0 : s.roughness;
    // With values from the beginning: else the loop might leave those of the surface before, and compilers for GPUs keep them
    // in registers until then.
    SharesMean once = SharesMean(vec3(0.0), 0.0);
    SharesMean own = once, own_met = once, outside = once, outside_met = once, inside = once, fresnel = once;
    vec3 ripples = vec3(0.0);
    for (int k = 0; k < 7 + SHARES_RIPPLES / 4; k++) {
        bool behind = k == 5 || (s.inside && (k == 1 || k == 2)), needed = HAS_TRANSMISSION != 0 || k == 0 || k == 3 || k > 5;
        float rule = (k < 3 ? FACETS_OF_ONE : FACETS_OF_ALL) + (k == 2 || k == 4 ? FACETS_MET : 0.0);
        float c = k < 3 ? wo.z : 0.0, roughness = k < 3 ? of_wo : of_all;
        vec4 cosines = energy_facets(c, roughness, rule), weights = energy_facets(c, roughness, rule + 1.0);
        if (k == 6) {
            cosines = FRESNEL_COSINES;
            weights = FRESNEL_WEIGHTS;
        } else if (k > 6) {
            cosines = sqrt((vec4(0.5, 1.5, 2.5, 3.5) + 4.0 * float(k - 7)) / float(SHARES_RIPPLES));
            weights = vec4(1.0 / float(SHARES_RIPPLES));
        }
        SharesMean mean = shares_mean(s, cosines, weights, shares_eta(s, behind), needed);
        if (k == 0) once = mean;
        else if (k == 1) own = mean;
        else if (k == 2) own_met = mean;
        else if (k == 3) outside = mean;
        else if (k == 4) outside_met = mean;
        else if (k == 5) inside = mean;
        else if (k == 6) fresnel = mean;
        else ripples += mean.gain;
    }
    s.film_mean = vec3(mix(fresnel_mean(s.eta_outside), 1.0, s.excess)) + fresnel.gain;
    s.film_once = clamp(albedo.y + albedo.x * once.gain, 0.0, albedo.x);
    vec3 clear = shares_clear(s);
    s.film_kept = clamp(multiscatter_albedo(albedo, clear) + (s.film_once - albedo.y), 0.0, 1.0);
    // Thick films ripple with the angle more than four cosines show, and rough facets less than smooth ones.
    float rough = s.is_delta ? 0.0 : clamp((s.roughness - SHARES_SMOOTH) / SHARES_SMOOTH, 0.0, 1.0);
    vec3 gain = mix(ripples, outside.gain, rough);
    s.film_kept_mean = clamp(multiscatter_albedo(albedo_mean, clear) + albedo_mean.x * gain, 0.0, 1.0);
#if HAS_TRANSMISSION
    s.film_lost = shares_loss(s, albedo, s.inside, own, own_met);
    s.film_lost_outside = shares_loss(s, albedo_mean, false, outside, outside_met);
    s.film_lost_inside = shares_loss(s, albedo_mean, true, inside, inside);
#endif
}
#endif

// The share of light from w that facets reflect once, and of that from wo.
BASE_SHARE shares_once(Surface s, vec3 w, vec4 albedo) {
#if HAS_FILM
    if (s.film > 0.0) {
        vec3 gain = shares_mean(s, w, s.eta_outside, FACETS_OF_ONE, true).gain;
        return clamp(albedo.y + albedo.x * gain, 0.0, albedo.x);
    }
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
    if (s.film > 0.0) {
        SharesMean some = SharesMean(vec3(0.0), 0.0), all = some;
        for (int k = 0; k < 2; k++) {
            float rule = k == 0 ? FACETS_OF_ONE : FACETS_OF_ONE + FACETS_MET;
            SharesMean mean = shares_mean(s, w, shares_eta(s, inside), rule, k == 0 || !inside);
            if (k == 0) some = mean;
            else all = mean;
        }
        return shares_loss(s, albedo, inside, some, all);
    }
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
    if (s.film > 0.0) shares_face_film(wo, albedo, albedo_mean, s);
#endif
#if HAS_METAL_FILM
    s.film_metal_mean = vec3(0.0);
    for (int i = 0; i < (s.film > 0.0 ? 4 : 0); i++)
        s.film_metal_mean += FRESNEL_WEIGHTS[i] * base_metal(s, FRESNEL_COSINES[i]);
#endif
}
#endif
