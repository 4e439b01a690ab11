// The metal's reflectance, "F82-tint" [Kutz et al. 2021; OpenPBR 1.1.1, eq. for the metal]: Schlick's curve, less a term
// that peaks near 82 degrees, so that at cosine 1/7 the reflectance is `specular_color` times Schlick's.
#if HAS_OPENPBR
const float METAL_EDGE = 1.0 / 7.0;                     // the cosine
const float METAL_EDGE_SCHLICK = 0.462664366;           // (1 - METAL_EDGE)^5
const float METAL_EDGE_TERM = METAL_EDGE * 0.396569457; // METAL_EDGE (1 - METAL_EDGE)^6

// The weight of the edge's term, so that none is left where `specular_color` is white.
vec3 openpbr_metal_edge(Surface s) {
    return mix(s.base_color, vec3(1.0), METAL_EDGE_SCHLICK) * (1.0 - s.specular_color) / METAL_EDGE_TERM;
}

// At cosine c. The specification's formula leaves 0..1 where the weight is above 1 or a black metal has a dark edge.
vec3 openpbr_metal(Surface s, float c) {
    float m = 1.0 - c, m5 = fresnel_schlick(c);
    return clamp(s.specular_weight * (mix(s.base_color, vec3(1.0), m5) - c * m * m5 * openpbr_metal_edge(s)), 0.0, 1.0);
}

// The cosine-weighted mean, of the formula without the clamp: 1/21 is that of Schlick's power, 1/126 that of the term.
vec3 openpbr_metal_mean(Surface s) {
    vec3 mean = s.base_color + (1.0 - s.base_color) / 21.0 - openpbr_metal_edge(s) / 126.0;
    return clamp(s.specular_weight * mean, 0.0, 1.0);
}
#endif
