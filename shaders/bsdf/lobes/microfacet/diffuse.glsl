// Diffuse models under the facets, without the cosine. Directions are in the shading frame.
#if HAS_MICROFACET

// The azimuth between two directions as its cosine; 1 where one of them is the normal.
float diffuse_cos_azimuth(vec3 wo, vec3 wi) {
    float size = length(wo.xy) * length(wi.xy);
    return size > 0.0 ? clamp(dot(wo.xy, wi.xy) / size, -1.0, 1.0) : 1.0;
}

// Grooves of Lambertian facets, with interreflection [Oren & Nayar 1994, eq. 27 to 33]; sigma in radians. The formula
// may fall below 0 at grazing angles.
vec3 diffuse_oren_nayar(vec3 albedo, float sigma, vec3 wo, vec3 wi) {
    vec3 steep = wo.z < wi.z ? wo : wi, flat_one = wo.z < wi.z ? wi : wo;
    float sin_a = length(steep.xy), sin_b = length(flat_one.xy);
    float a = precise_angle(sin_a, steep.z), b = precise_angle(sin_b, flat_one.z);
    float v = sigma * sigma, cos_phi = diffuse_cos_azimuth(wo, wi);
    float c1 = 1.0 - 0.5 * v / (v + 0.33);
    float c2 = 0.45 * v / (v + 0.09);
    float c3 = 0.125 * v / (v + 0.09) * sqr(4.0 * a * b * INV_PI * INV_PI);
    float fall = 2.0 * b * INV_PI;
    c2 *= cos_phi >= 0.0 ? sin_a : sin_a - fall * fall * fall;
    float tan_mean = (sin_a + sin_b) / (steep.z + flat_one.z); // tan((a + b) / 2)
    float once = c1 + cos_phi * c2 * sin_b / flat_one.z + (1.0 - abs(cos_phi)) * c3 * tan_mean;
    float twice = 0.17 * v / (v + 0.13) * (1.0 - cos_phi * fall * fall);
    return max(INV_PI * albedo * (once + albedo * twice), vec3(0.0));
}

// That of `disney` [Burley 2012, section 5.3].
vec3 diffuse_disney(vec3 albedo, float roughness, vec3 wo, vec3 wi, float cos_d) {
    float grazing = 0.5 + 2.0 * cos_d * cos_d * roughness;
    return INV_PI * albedo * (mix(1.0, grazing, fresnel_schlick(wi.z)) * mix(1.0, grazing, fresnel_schlick(wo.z)));
}

const float EON_1 = 0.287793409; // 1/2 - 2 / (3 pi)
const float EON_2 = 0.072488218; // 2/3 - 28 / (15 pi)

// How much less than its most the albedo of Fujii's lobe is at a cosine, by the polynomial of [Portsmouth, Kutz & Hill
// 2024, listing 1]: EON_1 less its G / pi. Clamped, as the polynomial is 5e-4 above EON_1 at 0.
float diffuse_eon_lost(float c) {
    float m = 1.0 - c;
    return max(EON_1 - m * (0.0571085289 + m * (0.491881867 + m * (-0.332181442 + m * 0.0714429953))), 0.0);
}

// Energy-preserving Oren-Nayar [Portsmouth, Kutz & Hill 2024]: with A = 1 / (1 + EON_1 r), the albedo of the single
// scattering at c is 1 - A r diffuse_eon_lost(c), on average 1 - A r (EON_1 - EON_2), so that r = 0 is no special case.
vec3 diffuse_eon(vec3 albedo, float roughness, vec3 wo, vec3 wi) {
    float s = dot(wo.xy, wi.xy);
    float a = 1.0 / (1.0 + EON_1 * roughness);
    float once = a * (1.0 + roughness * (s > 0.0 ? s / max(wo.z, wi.z) : s));
    float lost = a * roughness * (EON_1 - EON_2); // on average
    vec3 many = albedo * ((1.0 - lost) / (1.0 - albedo * lost));
    float shape = a * roughness * diffuse_eon_lost(wo.z) * diffuse_eon_lost(wi.z) / (EON_1 - EON_2);
    return INV_PI * albedo * (once + many * shape);
}

// The surface's diffuse term.
vec3 diffuse_term(Surface s, vec3 wo, vec3 wi, float cos_d) {
    uint kind = s.terms.diffuse_model;
    vec3 f = INV_PI * s.base_color;
#if HAS_MICROFACET_DIFFUSE_MODEL_OREN_NAYAR
    if (kind == DIFFUSE_MODEL_OREN_NAYAR) f = diffuse_oren_nayar(s.base_color, s.terms.diffuse_roughness, wo, wi);
#endif
#if HAS_MICROFACET_DIFFUSE_MODEL_DISNEY
    if (kind == DIFFUSE_MODEL_DISNEY) f = diffuse_disney(s.base_color, s.terms.diffuse_roughness, wo, wi, cos_d);
#endif
#if HAS_MICROFACET_DIFFUSE_MODEL_EON
    if (kind == DIFFUSE_MODEL_EON) f = diffuse_eon(s.base_color, s.terms.diffuse_roughness, wo, wi);
#endif
    return f;
}
#endif
