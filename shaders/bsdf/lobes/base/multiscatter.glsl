// Light that leaves the microfacets after more than one of them [Kulla & Conty 2017, "Revisiting physically based
// shading at Imageworks"]: on each side the share that single scattering loses at wo times the share that it loses at
// wi. Each `albedo` is energy_albedo's four shares: at wo (in s), at wi, or on average. The diffuse lobes above and
// below the surface sample this light.
#if ANY_NEEDS_TABLES
// The least mean loss to divide by: below it the steps of the tables would show, and there is nothing to see.
const float MULTISCATTER_LEAST_LOSS = 5e-5;

// The means of base_dielectric, seen from outside, and of base_metal.
BASE_SHARE base_dielectric_mean(Surface s) {
#if HAS_FILM
    if (s.film > 0.0) return s.film_mean;
#endif
    return BASE_SHARE(mix(fresnel_mean(s.eta_outside), 1.0, s.excess));
}

vec3 base_metal_mean(Surface s) {
#if HAS_METAL_FILM
    if (s.film > 0.0) return s.film_metal_mean;
#endif
    return models_metal_mean(s);
}

// The share of the lost light that comes back after all; f is the mean Fresnel reflectance.
vec3 multiscatter_fresnel(vec3 f, float albedo_mean) { return f * f * albedo_mean / (1.0 - f * (1.0 - albedo_mean)); }
float multiscatter_fresnel(float f, float albedo_mean) { return multiscatter_fresnel(vec3(f), albedo_mean).x; }

// The share of untinted light that the boundary reflects after any number of scatterings.
BASE_SHARE multiscatter_albedo(vec4 albedo, BASE_SHARE share) { return min(BASE_SHARE(1.0), albedo.y + share * (1.0 - albedo.x)); }

#if HAS_TRANSMISSION
bool multiscatter_glass(Surface s) { return !s.index_matched; }

// The mean loss between the facets of glass, seen from inside or from outside.
BASE_SHARE multiscatter_lost_mean(Surface s, bool inside) {
#if HAS_FILM
    if (s.film > 0.0) return inside ? s.film_lost_inside : s.film_lost_outside;
#endif
    return BASE_SHARE(inside ? s.albedo_mean.w : s.albedo_mean.z);
}

// The chance that light lost between the facets of rough glass leaves on the other side. 1 - F of the two sides differ
// by eta^2, and so must the light that they exchange: the lesser loss decides.
BASE_SHARE multiscatter_transmit_chance(Surface s) {
#if HAS_THIN_WALLS
    if (s.is_thin) return pane_multiscatter_chance(s);
#endif
    BASE_SHARE lost_a = multiscatter_lost_mean(s, false), lost_b = multiscatter_lost_mean(s, true);
    BASE_SHARE t = (1.0 - base_dielectric_mean(s)) * min(lost_a, lost_b);
    return s.inside ? t / max(sqr(s.eta_outside) * lost_b, 1e-9) : t / max(lost_a, 1e-9);
}

// `near` is the loss for wo, `far` that for wi on the other side.
vec3 multiscatter_transmit(Surface s, BASE_SHARE near, BASE_SHARE far) {
    if (!multiscatter_glass(s)) return vec3(0.0);
    BASE_SHARE f = near * far / max(multiscatter_lost_mean(s, !s.inside), MULTISCATTER_LEAST_LOSS);
    return (1.0 - s.metallic) * s.transmission * multiscatter_transmit_chance(s) * INV_PI * f * s.clear_color;
}

// Of light that leaves on wo's side: each `near` is the loss for wo or wi, f is the mean Fresnel reflectance.
vec3 multiscatter_beside(Surface s, BASE_SHARE near_o, BASE_SHARE near_i) {
    if (!multiscatter_glass(s)) return vec3(0.0);
    BASE_SHARE g = near_o * near_i / max(multiscatter_lost_mean(s, s.inside), MULTISCATTER_LEAST_LOSS);
    return (1.0 - s.metallic) * s.transmission * (1.0 - multiscatter_transmit_chance(s)) * INV_PI * vec3(g);
}
#endif

vec3 multiscatter_reflect(Surface s, vec4 albedo_i, vec3 share) {
    float f = (1.0 - s.albedo.x) * (1.0 - albedo_i.x) / max(1.0 - s.albedo_mean.x, MULTISCATTER_LEAST_LOSS);
    return INV_PI * f * share;
}
#endif
