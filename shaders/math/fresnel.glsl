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
