// Light that leaves the microfacets after more than one of them [Kulla & Conty 2017, "Revisiting physically based
// shading at Imageworks"]: per side, what single scattering loses at wo times what it loses at wi. `kept` are
// energy_albedo's four shares, at wo (in s), at wi and on average. Sampled with the matte lobe, above and below.
#if HAS_PRINCIPLED
// Below, the tables' steps show in what is divided by it, and there is nothing to see.
const float SCATTERED_LEAST = 5e-5;

// Share of the lost light that comes back after all, from the mean of the Fresnel reflectance.
vec3 scattered_share(vec3 f, float kept_mean) { return f * f * kept_mean / (1.0 - f * (1.0 - kept_mean)); }
float scattered_share(float f, float kept_mean) { return scattered_share(vec3(f), kept_mean).x; }

// What the boundary reflects in all, of untinted light.
float scattered_kept(vec4 kept, float share) { return min(1.0, kept.y + share * (1.0 - kept.x)); }

#if HAS_TRANSMISSION
bool scattered_glass(Surface s) { return !s.straight; }

// Chance that lost light of a rough glass leaves on the other side. (1 - F) of both sides differ by eta^2, and so must
// what both sides exchange: the lesser loss decides.
float scattered_through(Surface s) {
    float lost_a = s.kept_mean.z, lost_b = s.kept_mean.w;
    float t = (1.0 - fresnel_mean(s.eta_outside)) * min(lost_a, lost_b);
    return s.inside ? t / max(sqr(s.eta_outside) * lost_b, 1e-9) : t / max(lost_a, 1e-9);
}

float scattered_near(Surface s, vec4 kept) { return s.inside ? kept.w : kept.z; }
float scattered_far(Surface s, vec4 kept) { return s.inside ? kept.z : kept.w; }

vec3 scattered_transmit(Surface s, vec4 kept_i) {
    if (!scattered_glass(s)) return vec3(0.0);
    float f = scattered_near(s, s.kept) * scattered_far(s, kept_i) / max(scattered_far(s, s.kept_mean), SCATTERED_LEAST);
    return (1.0 - s.metallic) * s.transmission * scattered_through(s) * INV_PI * f * s.base_color;
}
#endif

vec3 scattered_reflect(Surface s, vec4 kept_i, vec3 share) {
    float f = (1.0 - s.kept.x) * (1.0 - kept_i.x) / max(1.0 - s.kept_mean.x, SCATTERED_LEAST);
    vec3 r = INV_PI * f * share;
#if HAS_TRANSMISSION
    if (scattered_glass(s)) {
        float g = scattered_near(s, s.kept) * scattered_near(s, kept_i) / max(scattered_near(s, s.kept_mean), SCATTERED_LEAST);
        r += (1.0 - s.metallic) * s.transmission * (1.0 - scattered_through(s)) * INV_PI * g;
    }
#endif
    return r;
}
#endif
