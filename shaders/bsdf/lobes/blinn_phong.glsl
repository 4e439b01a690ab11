// The classic highlight about the half vector [Blinn 1977]; it is not normalised: f cos = (diffuse cos + specular z^n)
// / pi.

#if HAS_BLINN_PHONG || HAS_PHONG
// wm.z^n. Near the pole it is taken from the sine, as z itself is rounded: at n = 1e6 that would be 6 % off.
float blinn_phong_power(vec3 wm, float n) {
    float x = dot(wm.xy, wm.xy); // sin^2
    float series = -x * (1.0 + x * (0.5 + x * (1.0 / 3.0 + x * (0.25 + x * 0.2)))); // log(1 - x)
    float log_cos2 = x < 0.1 ? series : 2.0 * log(max(wm.z, 1e-30));
    return exp(0.5 * n * log_cos2);
}

// Lacks the cosine, which bsdf_eval multiplies back.
vec3 blinn_phong_eval(Surface s, vec3 wi, vec3 wm) {
    return INV_PI * (LOBE(LOBE_DIFFUSE, s.base_color)
                   + LOBE(LOBE_SPECULAR, s.phong * (blinn_phong_power(wm, s.shininess) / wi.z)));
}

// The chance of picking the diffuse lobe. The highlight reflects at most 8 / (n + 2) times its colour, and never over
// 2.
float blinn_phong_diffuse_chance(Surface s) {
    float diffuse = luminance(s.base_color);
    float shine = luminance(s.phong) * min(2.0, 8.0 / (s.shininess + 2.0));
    return diffuse + shine > 0.0 ? diffuse / (diffuse + shine) : 1.0;
}

// Half vectors have the density (n + 1) / (2 pi) z^n.
float blinn_phong_pdf(Surface s, vec3 wi, vec3 wm, float cos_d) {
    float half_pdf = (s.shininess + 1.0) * (0.5 * INV_PI) * blinn_phong_power(wm, s.shininess);
    return mix(half_pdf / (4.0 * max(cos_d, 1e-6)), lambert_pdf(wi), blinn_phong_diffuse_chance(s));
}

// A direction about z with the density (n + 1) / (2 pi) z^n.
vec3 blinn_phong_lobe(float n, vec2 u) {
    float y = 2.0 / (n + 1.0) * log(1.0 - u.y); // of z^2
    float tail = -y * (1.0 + y * (0.5 + y * (1.0 / 6.0 + y * (1.0 / 24.0 + y * (1.0 / 120.0)))));
    float sin2 = clamp(y > -0.1 ? tail : 1.0 - exp(y), 0.0, 1.0);
    float r = sqrt(sin2), phi = TWO_PI * u.x;
    return vec3(r * cos(phi), r * sin(phi), sqrt(1.0 - sin2));
}

vec3 blinn_phong_sample(Surface s, vec3 wo, float u_lobe, vec2 u) {
    vec3 wm = blinn_phong_lobe(s.shininess, u);
    vec3 mirrored = 2.0 * dot(wo, wm) * wm - wo;
    return u_lobe < blinn_phong_diffuse_chance(s) ? lambert_sample(u) : mirrored;
}
#endif
