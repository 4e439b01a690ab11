// Distributions of the facets' normals, 1/sr, in terms of sin^2 and logarithms: in the cosine they cancel, and powers
// of 1e6 overflow. Each is exp(log_factor + distribution_..._log); the integral of D cos over the hemisphere is 1.
// Where D cos has no inverse in closed form, another density is sampled that has one, and is near enough that no sample
// weighs much more than the others.
#if HAS_MICROFACET

// log(c^2), s2 = sin^2.
float distribution_log_cos2(float s2, float c) { return precise_log(c * c, -s2); }

// D [Blinn 1977], (alpha + 2) / (2 pi) c^alpha: normalised by [Lewis 1994].
float distribution_phong(float alpha, float s2, float c) {
    return (alpha + 2.0) * 0.5 * INV_PI * exp(0.5 * alpha * distribution_log_cos2(s2, c));
}

// D [Cook & Torrance 1982, eq. 10; Walter et al. 2007, eq. 25].
float distribution_beckmann(float alpha, float s2, float c) {
    return exp(-s2 / sqr(c * alpha) - 2.0 * distribution_log_cos2(s2, c)) * INV_PI / (alpha * alpha);
}

// The integral of y^-gamma over y = 1 .. exp(end).
float distribution_power_integral(float gamma, float end) {
    float k = (1.0 - gamma) * end;
    return abs(k) < 1e-6 ? end : precise_expm1(k) / (1.0 - gamma);
}

// log y of a sample with a density proportional to y^-gamma on 1 .. exp(end).
float distribution_power_sample(float gamma, float end, float u) {
    float k = (1.0 - gamma) * end;
    return abs(k) < 1e-6 ? u * end : precise_log1p(u * precise_expm1(k)) / (1.0 - gamma);
}

// D of generalised Trowbridge and Reitz [Burley 2012, eq. 3], about its peak, which for alpha > 1 is at 90 degrees: it
// falls as y^-gamma from y = 1 to the square of the larger one of alpha and 1 / alpha, and y is linear in cos^2.
float distribution_gtr(float alpha, float gamma, float s2, float c) {
    float t = alpha < 1.0 ? s2 * ((1.0 - alpha) * (1.0 + alpha) / (alpha * alpha))
                          : c * c * ((alpha - 1.0) * (alpha + 1.0));
    float end = 2.0 * abs(precise_log(alpha, alpha - 1.0));
    float peak = end > 0.0 ? precise_expm1(end) / distribution_power_integral(gamma, end) : 1.0;
    return exp(-gamma * precise_log1p(t)) * peak * INV_PI;
}

// The logarithm of the ABC model over its peak [Church, Takacs & Leonard 1989; Löw, Kronander, Ynnerman & Unger 2012,
// eq. 12].
float distribution_abc_log(float alpha, float gamma, float s2, float c) {
    return -gamma * precise_log1p(alpha * s2 / (1.0 + c));
}

// The logarithm of the shifted gamma distribution over its value at the pole [Bagher, Soler & Holzschuch 2012, eq. 7].
float distribution_sgd_log(float alpha, float gamma, float s2, float c) {
    float tan2 = s2 / (c * c);
    return -tan2 / alpha - gamma * precise_log1p(tan2 / (alpha * alpha)) - 2.0 * distribution_log_cos2(s2, c);
}

// The logarithm of the Gaussian of the angle over its peak [Torrance & Sparrow 1967, eq. 11].
float distribution_gaussian_log(float alpha, float s2, float c) {
    return -sqr(precise_angle(sqrt(s2), c) / alpha);
}

// D(wm) of the surface.
float distribution_d(Surface s, vec3 wm) {
    float alpha = s.alpha.x, gamma = s.terms.gamma, s2 = dot(wm.xy, wm.xy), c = wm.z, d = 0.0;
    uint kind = s.terms.distribution;
#if HAS_MICROFACET_DISTRIBUTION_PHONG
    if (kind == DISTRIBUTION_PHONG) d = distribution_phong(alpha, s2, c);
#endif
#if HAS_MICROFACET_DISTRIBUTION_BECKMANN
    if (kind == DISTRIBUTION_BECKMANN) d = distribution_beckmann(alpha, s2, c);
#endif
#if HAS_MICROFACET_DISTRIBUTION_GGX
    if (kind == DISTRIBUTION_GGX) d = ggx_d(wm, s.alpha); // [Trowbridge & Reitz 1975; Walter et al. 2007, eq. 33]
#endif
#if HAS_MICROFACET_DISTRIBUTION_GTR
    if (kind == DISTRIBUTION_GTR) d = distribution_gtr(alpha, gamma, s2, c);
#endif
#if HAS_MICROFACET_DISTRIBUTION_ABC
    if (kind == DISTRIBUTION_ABC) d = exp(s.log_factor + distribution_abc_log(alpha, gamma, s2, c));
#endif
#if HAS_MICROFACET_DISTRIBUTION_SGD
    if (kind == DISTRIBUTION_SGD) d = exp(s.log_factor + distribution_sgd_log(alpha, gamma, s2, c));
#endif
#if HAS_MICROFACET_DISTRIBUTION_GAUSSIAN
    if (kind == DISTRIBUTION_GAUSSIAN) d = exp(s.log_factor + distribution_gaussian_log(alpha, s2, c));
#endif
    return d;
}

// The normal whose sine has the square s2; c2 is that of the cosine.
vec3 distribution_normal(float s2, float c2, float u) {
    float r = sqrt(clamp(s2, 0.0, 1.0)), phi = TWO_PI * u;
    return vec3(r * cos(phi), r * sin(phi), sqrt(clamp(c2, 0.0, 1.0)));
}

// A normal, given the square of its tangent.
vec3 distribution_sloped(float tan2, float u) {
    float c2 = 1.0 / (1.0 + tan2);
    return distribution_normal(tan2 * c2, c2, u);
}

// D cos: c^2 = (1 - u)^(2 / (alpha + 2)).
vec3 distribution_phong_sample(float alpha, vec2 u) {
    float log_cos2 = 2.0 / (alpha + 2.0) * precise_log(1.0 - u.y, -u.y);
    return distribution_normal(-precise_expm1(log_cos2), exp(log_cos2), u.x);
}

// D cos [Walter et al. 2007, eq. 28].
vec3 distribution_beckmann_sample(float alpha, vec2 u) {
    return distribution_sloped(-alpha * alpha * precise_log(1.0 - u.y, -u.y), u.x);
}

// D cos: a power of a linear function of cos^2 [Burley 2012, eq. 5 and 9, for any gamma].
vec3 distribution_gtr_sample(float alpha, float gamma, vec2 u) {
    float end = 2.0 * abs(precise_log(alpha, alpha - 1.0));
    float y = distribution_power_sample(gamma, end, u.y);
    float share = end > 1e-6 ? precise_expm1(y) / precise_expm1(end) : u.y;
    return alpha < 1.0 ? distribution_normal(share, 1.0 - share, u.x) : distribution_normal(1.0 - share, share, u.x);
}

// The density sampled for `abc`: D, as D cos has no inverse. A power of 1 + alpha (1 - cos), by its integral.
vec3 distribution_abc_sample(float alpha, float gamma, vec2 u) {
    float end = precise_log1p(alpha);
    float less = min(precise_expm1(distribution_power_sample(gamma, end, u.y)) / alpha, 1.0); // 1 - cos
    return distribution_normal(less * (2.0 - less), sqr(1.0 - less), u.x);
}

float distribution_abc_pdf(float alpha, float gamma, float s2, float c) {
    float whole = distribution_power_integral(gamma, precise_log1p(alpha));
    return exp(distribution_abc_log(alpha, gamma, s2, c)) * alpha * 0.5 * INV_PI / whole;
}

// The integrals of the two parts of the density sampled for `sgd`. With y = alpha + tan^2 / alpha, D cos is
// proportional to exp(alpha - y) y^-gamma in y >= alpha; y^-gamma is sampled up to 1, and exp(alpha - y) beyond.
vec2 distribution_sgd_parts(float alpha, float gamma) {
    float log_alpha = precise_log(alpha, alpha - 1.0);
    if (alpha >= 1.0) return vec2(0.0, exp(-gamma * log_alpha));
    float power = exp((1.0 - gamma) * log_alpha) * distribution_power_integral(gamma, -log_alpha);
    return vec2(power, exp(alpha - 1.0));
}

vec3 distribution_sgd_sample(float alpha, float gamma, vec2 u) {
    vec2 parts = distribution_sgd_parts(alpha, gamma);
    float share = parts.x / (parts.x + parts.y), tan2;
    if (u.y < share) {
        float y = distribution_power_sample(gamma, -precise_log(alpha, alpha - 1.0), u.y / share);
        tan2 = alpha * alpha * precise_expm1(y);
    } else {
        float rest = (u.y - share) / (1.0 - share);
        tan2 = alpha * (max(1.0 - alpha, 0.0) - precise_log(1.0 - rest, -rest));
    }
    return distribution_sloped(tan2, u.x);
}

float distribution_sgd_pdf(float alpha, float gamma, float s2, float c) {
    vec2 parts = distribution_sgd_parts(alpha, gamma);
    float tan2 = s2 / (c * c), log_y = precise_log(alpha, alpha - 1.0);
    log_y = alpha + tan2 / alpha < 1.0 ? log_y + precise_log1p(tan2 / (alpha * alpha)) : max(log_y, 0.0);
    float over = alpha + tan2 / alpha < 1.0 ? 0.0 : tan2 / alpha;
    float log_density = -gamma * log_y - over - 1.5 * distribution_log_cos2(s2, c); // d tan^2 = 2 tan / c^2 dtheta
    return exp(log_density) * INV_PI / (alpha * (parts.x + parts.y));
}

// The density sampled for `gaussian`: theta / sin theta times the Gaussian, which differs little from D cos.
vec3 distribution_gaussian_sample(float alpha, vec2 u) {
    float cut = precise_expm1(-sqr(0.5 * PI / alpha));
    float theta = alpha * sqrt(-precise_log1p(u.y * cut));
    float s = sin(theta), c = cos(theta);
    return distribution_normal(s * s, c * c, u.x);
}

float distribution_gaussian_pdf(float alpha, float s2, float c) {
    float s = sqrt(s2), stretch = s > 0.0 ? precise_angle(s, c) / s : 1.0;
    float cut = -precise_expm1(-sqr(0.5 * PI / alpha));
    return exp(distribution_gaussian_log(alpha, s2, c)) * stretch * INV_PI / (alpha * alpha * cut);
}

// A normal of the surface's facets; for `ggx` of those that wo sees.
vec3 distribution_sample(Surface s, vec3 wo, vec2 u) {
    float alpha = s.alpha.x, gamma = s.terms.gamma;
    uint kind = s.terms.distribution;
    vec3 wm = vec3(0.0, 0.0, 1.0);
#if HAS_MICROFACET_DISTRIBUTION_PHONG
    if (kind == DISTRIBUTION_PHONG) wm = distribution_phong_sample(alpha, u);
#endif
#if HAS_MICROFACET_DISTRIBUTION_BECKMANN
    if (kind == DISTRIBUTION_BECKMANN) wm = distribution_beckmann_sample(alpha, u);
#endif
#if HAS_MICROFACET_DISTRIBUTION_GGX
    if (kind == DISTRIBUTION_GGX) wm = ggx_visible_normal(wo, s.alpha, u);
#endif
#if HAS_MICROFACET_DISTRIBUTION_GTR
    if (kind == DISTRIBUTION_GTR) wm = distribution_gtr_sample(alpha, gamma, u);
#endif
#if HAS_MICROFACET_DISTRIBUTION_ABC
    if (kind == DISTRIBUTION_ABC) wm = distribution_abc_sample(alpha, gamma, u);
#endif
#if HAS_MICROFACET_DISTRIBUTION_SGD
    if (kind == DISTRIBUTION_SGD) wm = distribution_sgd_sample(alpha, gamma, u);
#endif
#if HAS_MICROFACET_DISTRIBUTION_GAUSSIAN
    if (kind == DISTRIBUTION_GAUSSIAN) wm = distribution_gaussian_sample(alpha, u);
#endif
    return wm;
}

// The density of reflecting wo about a sample, over wi; cos_d = wo.wm > 0.
float distribution_pdf(Surface s, vec3 wo, vec3 wm, float cos_d) {
    float alpha = s.alpha.x, gamma = s.terms.gamma, s2 = dot(wm.xy, wm.xy), c = wm.z;
    uint kind = s.terms.distribution;
#if HAS_MICROFACET_DISTRIBUTION_GGX
    if (kind == DISTRIBUTION_GGX) return ggx_visible_pdf(wo, wm, s.alpha);
#endif
    float pdf = 0.0;
#if HAS_MICROFACET_DISTRIBUTION_PHONG || HAS_MICROFACET_DISTRIBUTION_BECKMANN || HAS_MICROFACET_DISTRIBUTION_GTR
    pdf = distribution_d(s, wm) * c;
#endif
#if HAS_MICROFACET_DISTRIBUTION_ABC
    if (kind == DISTRIBUTION_ABC) pdf = distribution_abc_pdf(alpha, gamma, s2, c);
#endif
#if HAS_MICROFACET_DISTRIBUTION_SGD
    if (kind == DISTRIBUTION_SGD) pdf = distribution_sgd_pdf(alpha, gamma, s2, c);
#endif
#if HAS_MICROFACET_DISTRIBUTION_GAUSSIAN
    if (kind == DISTRIBUTION_GAUSSIAN) pdf = distribution_gaussian_pdf(alpha, s2, c);
#endif
    return cos_d > 0.0 ? pdf / (4.0 * cos_d) : 0.0;
}
#endif
