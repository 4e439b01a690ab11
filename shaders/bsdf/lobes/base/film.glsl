// A thin film on the boundary of the base: light that it reflects to and fro interferes, and colours what comes back.
// gpu/tables/film.py has Airy's series for the film's two interfaces, and its table over zeta, the product of their
// amplitudes, and the path difference. On a dielectric zeta is real, and the table has it; on a metal each channel has a
// complex one, and the series is summed here.
#if ANY_NEEDS_TABLES && ANY_FILM
const float FILM_LEAST = 0.03; // um: below it the film fades into the bare boundary, whose metal may have another curve

// Sets the film of a material, but for the indices around it.
void film_surface(Material m, inout Surface s) {
    s.film_thickness = 1e-3 * m.film_thickness;
    s.film = m.film_weight * min(s.film_thickness / FILM_LEAST, 1.0);
    s.film_ior = max(m.film_ior, 1.0);
    s.film_outer = 1.0;
#if HAS_FILM
    s.film_base = s.film_bends = s.eta_outside;
    s.film_mean = s.film_once = s.film_kept = s.film_kept_mean = vec3(0.0);
    s.film_lost = s.film_lost_outside = s.film_lost_inside = vec3(0.0);
    s.film_reflected = s.film_passed = vec3(0.0);
    s.film_chance = 1.0;
#endif
#if HAS_METAL_FILM
    s.film_eta = s.film_k = s.film_metal_mean = vec3(0.0);
#endif
}

#if HAS_FILM
layout(binding = FILM_TEXTURE) uniform sampler2D film_table; // path difference, zeta

const float FILM_TOTAL = 1e30; // stands for the sine of what is reflected in full

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
    vec2 s01 = u0 + u1, s12 = u1 + u2, zeta = (u0 - u1) * (u2 - u1) / (s01 * s12);
    vec2 a = 4.0 * u0 * u1 / (s01 * s01), b = 4.0 * u1 * u2 / (s12 * s12); // what either interface passes
    vec2 either = a + b - a * b, passed = a * b / either, gap = either / (1.0 + abs(zeta)); // 1 - |zeta|
    vec2 place = vec2(textureSize(film_table, 0));
    float x = (1.0 - exp(-2.0 * s.film_thickness * q1 / FILM_FADING)) * (place.x - 1.0) + 0.5;
    vec2 y = (0.5 + 0.5 * sign(zeta) * (1.0 - sqrt(gap))) * (place.y - 1.0) + 0.5;
    vec3 sum = passed.x * zeta.x / gap.x * texture(film_table, vec2(x, y.x) / place).xyz
             + passed.y * zeta.y / gap.y * texture(film_table, vec2(x, y.y) / place).xyz;
    return clamp(1.0 - 0.5 * (passed.x + passed.y) - sum, 0.0, 1.0);
}
#endif

#if HAS_METAL_FILM
// exp(p x) has vanished at this path difference, um; the sine of a much greater one is not known in single precision.
const float FILM_LONGEST = 60.0;

// The index of a metal in a medium of index `outer` of which head-on `f0` is reflected, and near grazing angles less where
// `edge` is dark [Gulbrandsen 2014]. One of no loss at all has no finite index, unless its edge is white.
void film_metal_index(vec3 f0, vec3 edge, float outer, inout Surface s) {
    vec3 r = clamp(f0, 0.0, 0.9999), root = sqrt(r);
    vec3 n = mix((1.0 + root) / (1.0 - root), (1.0 - r) / (1.0 + r), edge);
    vec3 k2 = ((n + 1.0) * (n + 1.0) * r - (n - 1.0) * (n - 1.0)) / (1.0 - r);
    s.film_eta = outer * n;
    s.film_k = outer * sqrt(max(k2, 0.0));
}

// Twice the share of the light of one polarisation that passes both interfaces after any number of reflections between
// them, without interference, and zeta: u0 and u1 are its admittances over and in the film, u2 + i v2 that of the metal.
void film_metal_polarised(float u0, float u1, vec3 u2, vec3 v2, out vec3 passed, out vec3 zeta_x, out vec3 zeta_y) {
    float r01 = (u0 - u1) / (u0 + u1), a = 4.0 * u0 * u1 / sqr(u0 + u1);
    vec3 size2 = (u1 + u2) * (u1 + u2) + v2 * v2, b = 4.0 * u1 * u2 / size2;
    zeta_x = -r01 * (u1 * u1 - u2 * u2 - v2 * v2) / size2;
    zeta_y = r01 * 2.0 * u1 * v2 / size2;
    passed = 2.0 * a * b / (a + b - a * b);
}

// Re a z / (1 - z) for the wave a and z, zeta times x + i y.
vec3 film_term(vec3 zeta_x, vec3 zeta_y, vec3 x, vec3 y, int wave) {
    vec3 zx = zeta_x * x - zeta_y * y, zy = zeta_x * y + zeta_y * x, size = zx * zx + zy * zy;
    return (FILM_REAL[wave] * (zx - size) - FILM_IMAGINARY[wave] * zy) / (1.0 - 2.0 * zx + size);
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
    vec3 passed_s, passed_p, sx, sy, px, py;
    film_metal_polarised(q0, q1, u, v, passed_s, sx, sy);
    film_metal_polarised(q0 / (n0 * n0), q1 / (n1 * n1), up, vp, passed_p, px, py);
    float path = 2.0 * s.film_thickness * q1;
    vec3 r = vec3(1.0) - 0.25 * (passed_s + passed_p);
    // Where the path is longer all waves have vanished, and single precision would not know their sines. As the bound
    // varies, drivers do not unroll the loop.
    int waves = path < FILM_LONGEST ? FILM_WAVES : 0;
    for (int j = 0; j < waves; j++) {
        vec3 size = exp(-FILM_DECAY[j] * path), turn = FILM_TURN[j] * path, x = size * cos(turn), y = size * sin(turn);
        r -= 0.5 * (passed_s * film_term(sx, sy, x, y, j) + passed_p * film_term(px, py, x, y, j));
    }
    return clamp(r, 0.0, 1.0);
}
#endif
#endif
