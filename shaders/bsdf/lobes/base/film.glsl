// A thin film on the boundary of the base: light that it reflects to and fro interferes, and colours what comes back.
// The reflectance is Airy's series for the exact interfaces [Born & Wolf 1999, section 7.6], seen by the CIE 1931
// observer under D65 in linear Rec.709, where white is 1. For a path difference x the m-th of its terms has
// zeta^m exp(2 pi i m x / wavelength), whose integral over wavelengths is a function W of m x alone. As a sum of decaying
// waves, W(x) = sum_j a_j exp(p_j x), it leaves geometric series: sum_m zeta^m W(m x) = sum_j a_j z / (1 - z),
// z = zeta exp(p_j x). So thick films fade to their mean colour as they do to the eye. Four waves a channel keep within a
// quarter of 0.02 R + 0.004 of the integral; tests/film.py has that, and shows where they come from.
#if ANY_NEEDS_TABLES && HAS_FILM
const float FILM_LEAST = 0.03; // um: below it the film fades into the bare boundary, whose metal may have another curve
// exp(p x) has vanished at this path difference, um; the sine of a much greater one is not known in single precision.
const float FILM_LONGEST = 60.0;
const float FILM_TOTAL = 1e30; // stands for the sine of what is reflected in full
const int FILM_WAVES = 4;
const vec3 FILM_DECAY[FILM_WAVES] = vec3[]( // -Re p, 1/um
    vec3(0.94786, 0.84141, 2.31745),
    vec3(0.94645, 0.78747, 1.13654),
    vec3(0.98369, 0.90601, 0.85588),
    vec3(0.71419, 0.74375, 0.79310));
const vec3 FILM_TURN[FILM_WAVES] = vec3[]( // Im p
    vec3(9.98584, 9.83138, 10.39202),
    vec3(10.29759, 10.67065, 11.08482),
    vec3(11.86229, 11.95010, 13.52702),
    vec3(14.12226, 14.11445, 14.69414));
const vec3 FILM_REAL[FILM_WAVES] = vec3[]( // Re a
    vec3(-4.99502, 0.09183, -0.04295),
    vec3(7.81645, -0.14833, -0.31470),
    vec3(-2.08684, 1.28754, 1.36023),
    vec3(0.26541, -0.23104, -0.00258));
const vec3 FILM_IMAGINARY[FILM_WAVES] = vec3[]( // Im a
    vec3(3.28195, -0.28272, 0.17205),
    vec3(-3.44058, 1.28285, -0.32505),
    vec3(0.16468, -1.05442, 0.95011),
    vec3(-0.00605, 0.05429, -0.79711));

// Sets the film of a material, but for the indices around it.
void film_surface(Material m, inout Surface s) {
    s.film_thickness = 1e-3 * m.film_thickness;
    s.film = m.film_weight * min(s.film_thickness / FILM_LEAST, 1.0);
    s.film_ior = max(m.film_ior, 1.0);
    s.film_outer = 1.0;
    s.film_base = s.film_bends = s.eta_outside;
    s.film_eta = s.film_k = s.film_mean = s.film_metal_mean = s.film_once = s.film_kept = s.film_kept_mean = vec3(0.0);
    s.film_lost = s.film_lost_outside = s.film_lost_inside = vec3(0.0);
    s.film_cosine = 1.0;
}

// The index of a metal in a medium of index `outer` of which head-on `f0` is reflected, and near grazing angles less where
// `edge` is dark [Gulbrandsen 2014]. One of no loss at all has no finite index, unless its edge is white.
void film_metal_index(vec3 f0, vec3 edge, float outer, inout Surface s) {
    vec3 r = clamp(f0, 0.0, 0.9999), root = sqrt(r);
    vec3 n = mix((1.0 + root) / (1.0 - root), (1.0 - r) / (1.0 + r), edge);
    vec3 k2 = ((n + 1.0) * (n + 1.0) * r - (n - 1.0) * (n - 1.0)) / (1.0 - r);
    s.film_eta = outer * n;
    s.film_k = outer * sqrt(max(k2, 0.0));
}

// Re a z / (1 - z) for z = x + i y.
vec3 film_term(vec3 x, vec3 y, int wave) {
    vec3 size = x * x + y * y;
    return (FILM_REAL[wave] * (x - size) - FILM_IMAGINARY[wave] * y) / (1.0 - 2.0 * x + size);
}

// The share of light that passes both interfaces after any number of reflections between them, without interference:
// `a` and `b` are what either of them passes.
float film_passed(float a, float b) { return a * b / (a + b - a * b); }
vec3 film_passed(float a, vec3 b) { return a * b / (a + b - a * b); }

// The square of the sine of the angle in a vacuum of light at cosine c, more than any index where all is reflected; eta is
// as base_dielectric takes it. By it light is refracted, under a coat too: both sides see the same reflectance.
float film_sine2(Surface s, float c, float eta) {
    float sine2 = 1.0 - c * c;
    if (sine2 >= eta * eta) return FILM_TOTAL;
    bool outside = (eta >= 1.0) == (s.film_bends >= 1.0);
    return (outside ? 1.0 : sqr(s.film_bends)) * sine2;
}

// The film's reflectance on the dielectric, for light of that angle: the same from both sides.
vec3 film_dielectric(Surface s, float sine2) {
    float n0 = s.film_outer, n1 = s.film_ior, n2 = s.film_base;
    float least = min(n0, n2);
    if (sine2 >= least * least) return vec3(1.0);
    // Index times cosine, in each of the three.
    float q0 = sqrt(n0 * n0 - sine2), q1 = sqrt(max(n1 * n1 - sine2, 1e-12)), q2 = sqrt(n2 * n2 - sine2);
    vec2 u0 = vec2(q0, q0 / (n0 * n0)), u1 = vec2(q1, q1 / (n1 * n1)), u2 = vec2(q2, q2 / (n2 * n2)); // of s and p
    vec2 r01 = (u0 - u1) / (u0 + u1), r12 = (u1 - u2) / (u1 + u2);
    vec2 a = 4.0 * u0 * u1 / ((u0 + u1) * (u0 + u1)), b = 4.0 * u1 * u2 / ((u1 + u2) * (u1 + u2));
    vec2 zeta = -r01 * r12, passed = vec2(film_passed(a.x, b.x), film_passed(a.y, b.y));
    float path = min(2.0 * s.film_thickness * q1, FILM_LONGEST);
    vec3 sum = vec3(0.0);
    for (int j = 0; j < FILM_WAVES; j++) {
        vec3 size = exp(-FILM_DECAY[j] * path), turn = FILM_TURN[j] * path;
        vec3 x = size * cos(turn), y = size * sin(turn);
        sum += passed.x * film_term(zeta.x * x, zeta.x * y, j) + passed.y * film_term(zeta.y * x, zeta.y * y, j);
    }
    return clamp(1.0 - 0.5 * (passed.x + passed.y) - sum, 0.0, 1.0);
}

// The share of one polarisation that comes back, less 1: u0 and u1 are its admittances over and in the film, u2 + i v2 that
// of the metal.
vec3 film_metal_polarised(float u0, float u1, vec3 u2, vec3 v2, float path) {
    float r01 = (u0 - u1) / (u0 + u1), a = 4.0 * u0 * u1 / sqr(u0 + u1);
    vec3 size2 = (u1 + u2) * (u1 + u2) + v2 * v2;
    vec3 zeta_x = -r01 * (u1 * u1 - u2 * u2 - v2 * v2) / size2, zeta_y = r01 * 2.0 * u1 * v2 / size2;
    vec3 sum = vec3(0.5);
    for (int j = 0; j < FILM_WAVES; j++) {
        vec3 size = exp(-FILM_DECAY[j] * path), turn = FILM_TURN[j] * path;
        vec3 x = size * cos(turn), y = size * sin(turn);
        sum += film_term(zeta_x * x - zeta_y * y, zeta_x * y + zeta_y * x, j);
    }
    return -2.0 * sum * film_passed(a, 4.0 * u1 * u2 / size2);
}

// The film's reflectance on the metal, at cosine c.
vec3 film_metal(Surface s, float c) {
    float n0 = s.film_outer, n1 = s.film_ior, sine2 = 1.0 - c * c;
    float q0 = sqrt(max(n0 * n0 - sine2, 1e-12)), q1 = sqrt(max(n1 * n1 - sine2, 1e-12));
    // The metal's index squared is re + i im, and u + i v the root of that less sine2; as in fresnel_conductor.
    vec3 n = s.film_eta, k = s.film_k, re = (n - k) * (n + k), im = 2.0 * n * k, t = re - sine2;
    vec3 larger = 0.5 * (abs(t) + sqrt(t * t + im * im)), smaller = 0.25 * im * im / max(larger, vec3(1e-12));
    vec3 u = sqrt(mix(smaller, larger, greaterThan(t, vec3(0.0)))), v = sqrt(mix(larger, smaller, greaterThan(t, vec3(0.0))));
    vec3 size2 = max(re * re + im * im, vec3(1e-12));
    vec3 up = (u * re + v * im) / size2, vp = (v * re - u * im) / size2; // over the index squared
    float path = min(2.0 * s.film_thickness * q1, FILM_LONGEST);
    vec3 r = film_metal_polarised(q0, q1, u, v, path) + film_metal_polarised(q0 / (n0 * n0), q1 / (n1 * n1), up, vp, path);
    return clamp(1.0 + 0.5 * r, 0.0, 1.0);
}
#endif
