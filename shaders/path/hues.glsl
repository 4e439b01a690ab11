// Hues: a path has one wavelength for each channel, drawn by what the channel is made of, so that each weighs 1. All three
// go the same way until glass of a dispersive kind parts them; then one of them leads (path/dispersion.glsl).
struct Hues {
#if HAS_DISPERSION
    vec3 places; // of the channels' wavelengths, as hues_places has them
    vec3 shares; // the density of the path, had each channel led it, over the mean of the three; they sum to 3
    uint leads;  // the channel by whose index directions are sampled
    uint met;    // the first dispersive glass on the way: HUES_MET_...
#else
    float unused; // a struct must have a member; every kernel passes hues on
#endif
};

#if HAS_DISPERSION
const uint HUES_MET_NONE = 0u, HUES_MET_SMOOTH = 1u, HUES_MET_ROUGH = 2u;
const uint PAIR_HUES = 0x7fffu; // beyond the pairs of any bounce

// Where the wavelengths of red, green and blue lie on Cauchy's scale, (1/l^2 - 1/l_d^2) / (1/l_F^2 - 1/l_C^2): the means of
// 64 parts of equal weight, which is max(0, linear Rec.709) of the CIE 1931 observer times D65, from red's violet part and
// green's and blue's short end on. Their means are off by 0.0003, their standard deviations by half a percent.
const vec3 HUES_PLACES[64] = vec3[64](
    vec3(1.4503, 0.7842, 1.7042), vec3(1.2340, 0.7112, 1.5475),
    vec3(1.0900, 0.6652, 1.4863), vec3(0.2080, 0.6298, 1.4429),
    vec3(0.1299, 0.6009, 1.4090), vec3(0.1101, 0.5765, 1.3810),
    vec3(0.0946, 0.5552, 1.3567), vec3(0.0814, 0.5362, 1.3353),
    vec3(0.0698, 0.5192, 1.3158), vec3(0.0594, 0.5037, 1.2975),
    vec3(0.0499, 0.4893, 1.2806), vec3(0.0411, 0.4758, 1.2648),
    vec3(0.0330, 0.4631, 1.2502), vec3(0.0250, 0.4510, 1.2362),
    vec3(0.0174, 0.4394, 1.2227), vec3(0.0100, 0.4285, 1.2099),
    vec3(0.0029, 0.4181, 1.1978), vec3(-0.0040, 0.4079, 1.1861),
    vec3(-0.0106, 0.3981, 1.1745), vec3(-0.0171, 0.3886, 1.1633),
    vec3(-0.0233, 0.3794, 1.1524), vec3(-0.0295, 0.3704, 1.1416),
    vec3(-0.0355, 0.3615, 1.1308), vec3(-0.0413, 0.3530, 1.1204),
    vec3(-0.0471, 0.3447, 1.1101), vec3(-0.0526, 0.3363, 1.0998),
    vec3(-0.0580, 0.3282, 1.0899), vec3(-0.0633, 0.3201, 1.0801),
    vec3(-0.0686, 0.3120, 1.0705), vec3(-0.0739, 0.3040, 1.0611),
    vec3(-0.0792, 0.2960, 1.0514), vec3(-0.0844, 0.2881, 1.0417),
    vec3(-0.0896, 0.2803, 1.0322), vec3(-0.0948, 0.2725, 1.0226),
    vec3(-0.0999, 0.2646, 1.0131), vec3(-0.1050, 0.2567, 1.0037),
    vec3(-0.1101, 0.2489, 0.9943), vec3(-0.1152, 0.2412, 0.9848),
    vec3(-0.1203, 0.2335, 0.9752), vec3(-0.1256, 0.2256, 0.9657),
    vec3(-0.1309, 0.2179, 0.9560), vec3(-0.1363, 0.2102, 0.9464),
    vec3(-0.1416, 0.2024, 0.9368), vec3(-0.1471, 0.1944, 0.9270),
    vec3(-0.1526, 0.1864, 0.9168), vec3(-0.1582, 0.1783, 0.9063),
    vec3(-0.1640, 0.1700, 0.8956), vec3(-0.1700, 0.1615, 0.8848),
    vec3(-0.1763, 0.1530, 0.8738), vec3(-0.1827, 0.1444, 0.8623),
    vec3(-0.1895, 0.1356, 0.8505), vec3(-0.1965, 0.1263, 0.8382),
    vec3(-0.2039, 0.1169, 0.8253), vec3(-0.2118, 0.1072, 0.8117),
    vec3(-0.2201, 0.0971, 0.7976), vec3(-0.2289, 0.0866, 0.7824),
    vec3(-0.2383, 0.0756, 0.7661), vec3(-0.2486, 0.0639, 0.7483),
    vec3(-0.2601, 0.0514, 0.7287), vec3(-0.2734, 0.0378, 0.7067),
    vec3(-0.2894, 0.0226, 0.6809), vec3(-0.3094, 0.0048, 0.6485),
    vec3(-0.3377, -0.0182, 0.6069), vec3(-0.4017, -0.0553, 0.5397));

float hues_place(uint channel, float u) {
    float x = clamp(u * 64.0 - 0.5, 0.0, 63.0);
    uint i = min(uint(x), 62u);
    float a = HUES_PLACES[i][channel], b = HUES_PLACES[i + 1u][channel], f = x - float(i);
    // Between red's violet and its other part lies nothing.
    return a - b > 0.5 ? (f < 0.5 ? a : b) : mix(a, b, f);
}
#endif

// The wavelengths of a path, of which those of another channel lead at each `turn` 0, 1, 2.
Hues hues_begin(Sampler rng, uint turn) {
    Hues r;
#if HAS_DISPERSION
    float u = 3.0 * sobol_pair(rng, PAIR_HUES).x;
    r.leads = min(uint(u), 2u);
    u -= float(r.leads);
    r.places = vec3(hues_place(0u, u), hues_place(1u, u), hues_place(2u, u));
    r.leads = (r.leads + turn) % 3u;
    r.shares = vec3(1.0);
    r.met = HUES_MET_NONE;
#else
    r.unused = 0.0;
#endif
    return r;
}

// Whether the material refracts each wavelength by an index of its own. A thin wall does not.
bool hues_part(Material m) {
#if HAS_DISPERSION
    return m.dispersion > 0.0 && material_transmits(m) && !material_is_thin(m);
#else
    return false;
#endif
}

// Notes the first dispersive glass that a path meets.
void hues_meet(Material m, inout Hues hues) {
#if HAS_DISPERSION
    if (hues.met == HUES_MET_NONE && hues_part(m))
        hues.met = m.roughness < LEAST_ROUGHNESS ? HUES_MET_SMOOTH : HUES_MET_ROUGH;
#endif
}

// Whether the path is to be traced again with another channel in the lead: where only that one would be left of it.
// Which one leads does not decide on that, so that the mean of all three is right.
bool hues_again(Hues hues, uint turns) {
#if HAS_DISPERSION
    return hues.met == HUES_MET_SMOOTH && turns < 3u;
#else
    return false;
#endif
}

#if HAS_DISPERSION
// The material with the index of that channel: Cauchy's n = A + B / l^2, within 1 and 4 unless its own index is not.
Material hues_material(Material m, Hues hues, uint channel) {
    if (hues_part(m)) {
        float f0 = sqrt(0.08 * m.specular);
        float n = m.ior >= 0.0 ? m.ior : (1.0 + f0) / (1.0 - f0);
        m.ior = clamp(n + (n - 1.0) * m.dispersion * hues.places[channel], min(n, 1.0), max(n, 4.0));
    }
    return m;
}
#endif

// The material with the index of the channel that leads.
Material hues_leading(Material m, Hues hues) {
#if HAS_DISPERSION
    return hues_material(m, hues, hues.leads);
#else
    return m;
#endif
}
