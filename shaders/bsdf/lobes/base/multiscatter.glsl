// Light that leaves the microfacets after more than one of them [Kulla & Conty 2017, "Revisiting physically based
// shading at Imageworks"]: on each side the share that single scattering loses at wo times the share that it loses at
// wi. Each `albedo` is energy_albedo's four shares: at wo (in s), at wi, or on average. The diffuse lobes above and
// below the surface sample this light.
#if ANY_NEEDS_TABLES
// The least mean loss to divide by: below it the steps of the tables would show, and there is nothing to see.
const float MULTISCATTER_LEAST_LOSS = 5e-5;

// The share of the lost light that comes back after all; f is the mean Fresnel reflectance.
vec3 multiscatter_fresnel(vec3 f, float albedo_mean) { return f * f * albedo_mean / (1.0 - f * (1.0 - albedo_mean)); }
float multiscatter_fresnel(float f, float albedo_mean) { return multiscatter_fresnel(vec3(f), albedo_mean).x; }

// The share of untinted light that the boundary reflects after any number of scatterings.
float multiscatter_albedo(vec4 albedo, float share) { return min(1.0, albedo.y + share * (1.0 - albedo.x)); }

#if HAS_TRANSMISSION
bool multiscatter_glass(Surface s) { return !s.index_matched; }

// The chance that light lost between the facets of rough glass leaves on the other side. 1 - F of the two sides differ
// by eta^2, and so must the light that they exchange: the lesser loss decides.
float multiscatter_transmit_chance(Surface s) {
#if HAS_THIN_WALLS
    if (s.is_thin) return pane_multiscatter_chance(s);
#endif
    float lost_a = s.albedo_mean.z, lost_b = s.albedo_mean.w;
    float t = (1.0 - mix(fresnel_mean(s.eta_outside), 1.0, s.excess)) * min(lost_a, lost_b);
    return s.inside ? t / max(sqr(s.eta_outside) * lost_b, 1e-9) : t / max(lost_a, 1e-9);
}

// The loss on the side of wo, and the loss on the other side.
float multiscatter_near(Surface s, vec4 albedo) { return s.inside ? albedo.w : albedo.z; }
float multiscatter_far(Surface s, vec4 albedo) { return s.inside ? albedo.z : albedo.w; }

vec3 multiscatter_transmit(Surface s, vec4 albedo_i) {
    if (!multiscatter_glass(s)) return vec3(0.0);
    float f = multiscatter_near(s, s.albedo) * multiscatter_far(s, albedo_i)
            / max(multiscatter_far(s, s.albedo_mean), MULTISCATTER_LEAST_LOSS);
    return (1.0 - s.metallic) * s.transmission * multiscatter_transmit_chance(s) * INV_PI * f * s.clear_color;
}
#endif

vec3 multiscatter_reflect(Surface s, vec4 albedo_i, vec3 share) {
    float f = (1.0 - s.albedo.x) * (1.0 - albedo_i.x) / max(1.0 - s.albedo_mean.x, MULTISCATTER_LEAST_LOSS);
    vec3 r = INV_PI * f * share;
#if HAS_TRANSMISSION
    if (multiscatter_glass(s)) {
        float g = multiscatter_near(s, s.albedo) * multiscatter_near(s, albedo_i)
                / max(multiscatter_near(s, s.albedo_mean), MULTISCATTER_LEAST_LOSS);
        r += (1.0 - s.metallic) * s.transmission * (1.0 - multiscatter_transmit_chance(s)) * INV_PI * g;
    }
#endif
    return r;
}
#endif
