// Reflectances of a facet at cosine c > 0, per channel.
#if HAS_MICROFACET

// The g form for the index whose reflectance head-on is f0 [Cook & Torrance 1982, eq. 15], with g - c as
// (n^2 - 1) / (g + c), which does not cancel.
float fresnel_cook_torrance(float f0, float c) {
    if (f0 >= 1.0) return 1.0;
    float root = sqrt(f0), n2_less_one = 4.0 * root / sqr(1.0 - root);
    float g = sqrt(n2_less_one + c * c), sum = g + c, difference = n2_less_one / sum;
    float b = (c * sum - 1.0) / (c * difference + 1.0);
    return 0.5 * sqr(difference / sum) * (1.0 + b * b);
}

// The surface's reflectance at cosine c.
vec3 fresnel_term(Surface s, float c) {
    uint kind = s.terms.fresnel;
    vec3 f = vec3(1.0);
#if HAS_MICROFACET_FRESNEL_SCHLICK
    if (kind == FRESNEL_SCHLICK) f = mix(s.spec0, vec3(1.0), fresnel_schlick(c));
#endif
#if HAS_MICROFACET_FRESNEL_COOK_TORRANCE
    if (kind == FRESNEL_COOK_TORRANCE)
        for (int i = 0; i < 3; i++) f[i] = fresnel_cook_torrance(s.spec0[i], c);
#endif
#if HAS_MICROFACET_FRESNEL_DIELECTRIC
    if (kind == FRESNEL_DIELECTRIC) f = vec3(fresnel_dielectric(c, s.terms_ior));
#endif
#if HAS_MICROFACET_FRESNEL_CONDUCTOR
    if (kind == FRESNEL_CONDUCTOR)
        for (int i = 0; i < 3; i++) f[i] = fresnel_conductor(s.terms.conductor_eta[i], s.terms.conductor_k[i], c);
#endif
    return f;
}
#endif
