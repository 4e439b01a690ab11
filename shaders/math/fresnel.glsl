// (1 - c)^5, by which Schlick's reflectance rises from its value at normal incidence to 1 [Schlick 1994, eq. 15].
float fresnel_schlick(float c) {
    float m = clamp(1.0 - c, 0.0, 1.0);
    float m2 = m * m;
    return m2 * m2 * m;
}

// The unpolarised reflectance of a boundary between dielectrics at cosine c > 0; eta is the index beyond it over the
// index on c's side. It is 1 where all is reflected. [Cook & Torrance 1982, eq. 15, split into its two polarisations]
float fresnel_dielectric(float c, float eta) {
    float g2 = (eta - 1.0) * (eta + 1.0) + c * c;
    if (g2 <= 0.0) return eta == 1.0 ? 0.0 : 1.0;
    float g = sqrt(g2), e = eta * eta * c;
    float s = (c - g) / (c + g), p = (e - g) / (e + g);
    return 0.5 * (s * s + p * p);
}

float fresnel_normal(float eta) { return sqr((eta - 1.0) / (eta + 1.0)); }

// The cosine-weighted mean of fresnel_dielectric over a hemisphere, eta >= 1, by the fit of [Kulla & Conty 2017].
float fresnel_mean(float eta) { return (eta - 1.0) / (4.08567 + 1.00071 * eta); }

// The unpolarised reflectance of a conductor of index eta + i k at cosine c > 0 [Born & Wolf 1999, section 14.2]. a + i b is the
// normal component of the wave vector inside; a^2 and b^2 each come from the sum that does not cancel.
float fresnel_conductor(float eta, float k, float c) {
    float s2 = (1.0 - c) * (1.0 + c), t = (eta - k) * (eta + k) - s2, cross_term = 2.0 * eta * k;
    float size = 0.5 * (abs(t) + sqrt(t * t + cross_term * cross_term));
    float other = size > 0.0 ? 0.25 * cross_term * cross_term / size : 0.0;
    float a2 = t > 0.0 ? size : other, b2 = t > 0.0 ? other : size, a = sqrt(a2);
    float s = (sqr(a - c) + b2) / (sqr(a + c) + b2);
    float p = (sqr(a * c - s2) + b2 * c * c) / (sqr(a * c + s2) + b2 * c * c);
    return 0.5 * s * (1.0 + p);
}

vec3 fresnel_conductor(vec3 eta, vec3 k, float c) {
    return vec3(fresnel_conductor(eta.x, k.x, c), fresnel_conductor(eta.y, k.y, c), fresnel_conductor(eta.z, k.z, c));
}

// Gauss's rule for cosine-weighted means over a hemisphere: for four cosines, their weights.
const vec4 FRESNEL_COSINES = vec4(0.1397598643, 0.4164095676, 0.7231569864, 0.9428958039);
const vec4 FRESNEL_WEIGHTS = vec4(0.0623619419, 0.2596950952, 0.4069291360, 0.2710138269);
