// The coat: a dielectric of its own index, GGX or a mirror, with a colour that light takes on its way through it, and
// light that is reflected to and fro below it. The light that it does not reflect goes on to the base.
#if HAS_OPENPBR && HAS_CLEARCOAT
// Into the coat's frame, whose x is its tangent, and back.
vec3 coat_to_local(Surface s, vec3 w) {
#if HAS_COAT_NORMALS
    w = basis_to_local(s.coat, w);
#endif
#if HAS_ANISOTROPIC
    vec2 x = s.coat_tangent;
    w = vec3(dot(x, w.xy), x.x * w.y - x.y * w.x, w.z);
#endif
    return w;
}

vec3 coat_from_local(Surface s, vec3 w) {
#if HAS_ANISOTROPIC
    vec2 x = s.coat_tangent;
    w = vec3(x.x * w.x - x.y * w.y, x.y * w.x + x.x * w.y, w.z);
#endif
#if HAS_COAT_NORMALS
    w = basis_to_world(s.coat, w);
#endif
    return w;
}

float coat_fresnel(Surface s, float c) { return mix(fresnel_dielectric(c, s.coat_eta), 1.0, s.coat_excess); }

// The share of the light from w that it reflects; w is in its frame.
float coat_albedo(Surface s, vec3 w) {
    if (w.z <= 0.0) return s.clearcoat;
    if (s.coat_is_delta) return s.clearcoat * coat_fresnel(s, w.z);
    vec4 albedo = energy_albedo(w, s.coat_roughness, s.coat_aspect, s.coat_eta);
    return s.clearcoat * mix(albedo.y, albedo.x, s.coat_excess);
}

// Without the cosine; all directions are in its frame.
float coat_eval(Surface s, vec3 wo, vec3 wi, vec3 wm, float cos_d) {
    if (s.coat_is_delta) return 0.0;
    return s.clearcoat * coat_fresnel(s, cos_d) * ggx_d(wm, s.alpha_coat_2) * ggx_visibility(wo, wi, s.alpha_coat_2);
}

vec3 coat_sample(Surface s, vec3 wo, vec2 u) {
    vec3 wm = s.coat_is_delta ? vec3(0.0, 0.0, 1.0) : ggx_visible_normal(wo, s.alpha_coat_2, u);
    vec3 wi = 2.0 * dot(wo, wm) * wm - wo;
    return wi.z > 0.0 ? wi : vec3(0.0);
}

float coat_pdf(Surface s, vec3 wo, vec3 wm) {
    return s.coat_is_delta ? 0.0 : ggx_visible_pdf(wo, wm, s.alpha_coat_2);
}

// The share that the coat's colour leaves of light that crosses it at cosine c outside. Twice straight through is that
// colour.
vec3 coat_crossed(Surface s, float c) {
    float inside = sqrt(max(0.0, 1.0 - (1.0 - c * c) / sqr(s.coat_eta)));
    return pow(s.coat_color, vec3(0.5 / max(inside, 1e-4)));
}

// The cosine-weighted mean of the reflectance of an index of at least 1 [Walsh 1926]. The closed form cancels towards 1,
// where the reflectance is near a parabola.
float coat_fresnel_mean(float n) {
    if (n < 1.1) return fresnel_mean(n);
    float n2 = n * n, less = n2 - 1.0, more = n2 + 1.0, n4 = n2 * n2;
    return 0.5 + (n - 1.0) * (3.0 * n + 1.0) / (6.0 * sqr(n + 1.0)) + n2 * less * less / (more * more * more) * log((n - 1.0) / (n + 1.0))
         - 2.0 * n * n2 * (n2 + 2.0 * n - 1.0) / (more * less * more) + 8.0 * n4 * (n4 + 1.0) / (more * sqr(less * more)) * log(n);
}

// What the reflections inside the coat leave of light from a base of albedo `base` [OpenPBR 1.1.1, "Darkening"]: those of
// a mirror meet the coat at the angle of wo, those of a rough base at all angles.
vec3 coat_darkened(Surface s, float c, vec3 base, float roughness) {
    float smooth_base = coat_fresnel(s, c);
    float rough_base = 1.0 - (1.0 - mix(coat_fresnel_mean(s.coat_eta), 1.0, s.coat_excess)) / sqr(s.coat_eta);
    float k = mix(smooth_base, rough_base, roughness);
    return (1.0 - k) / max(1.0 - base * k, 1e-6);
}
#endif
