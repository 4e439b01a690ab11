// (1 - c)^5, the angle's share in Schlick's reflectance [Schlick 1994, eq. 15].
float fresnel_schlick(float c) {
    float m = clamp(1.0 - c, 0.0, 1.0);
    float m2 = m * m;
    return m2 * m2 * m;
}

// Unpolarised reflectance of a boundary between dielectrics; c > 0, eta = index beyond over index on c's side; 1 where
// all is reflected. [Cook & Torrance 1982, eq. 15, with its two parts apart]
float fresnel_dielectric(float c, float eta) {
    float g2 = (eta - 1.0) * (eta + 1.0) + c * c;
    if (g2 <= 0.0) return eta == 1.0 ? 0.0 : 1.0;
    float g = sqrt(g2), e = eta * eta * c;
    float s = (c - g) / (c + g), p = (e - g) / (e + g);
    return 0.5 * (s * s + p * p);
}

float fresnel_normal(float eta) { return sqr((eta - 1.0) / (eta + 1.0)); }

// Mean of fresnel_dielectric over a hemisphere, cosine-weighted, eta >= 1 [Kulla & Conty 2017, fit].
float fresnel_mean(float eta) { return (eta - 1.0) / (4.08567 + 1.00071 * eta); }
