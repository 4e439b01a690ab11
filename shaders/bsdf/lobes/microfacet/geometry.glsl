// Geometry terms: the share of the facets that is neither masked nor shadowed, divided by 4 (n.wi) (n.wo), as that
// cancels in most of them. Directions are in the shading frame.
#if HAS_MICROFACET

// 4 (n.wi) (n.wo) times this is n.wi n.wo [Kelemen & Szirmay-Kalos 2001, who call it implicit].
float geometry_implicit() { return 0.25; }

// [Neumann, Neumann & Szirmay-Kalos 1999, eq. 11]
float geometry_neumann(vec3 wo, vec3 wi) { return 0.25 / max(wo.z, wi.z); }

// V-shaped grooves [Cook & Torrance 1982, eq. 3 to 5].
float geometry_cook_torrance(vec3 wo, vec3 wi, vec3 wm, float cos_d) {
    float groove = 2.0 * wm.z / cos_d;
    return 0.25 * min(1.0 / (wo.z * wi.z), groove / max(wo.z, wi.z));
}

// [Kelemen & Szirmay-Kalos 2001, eq. 6]
float geometry_kelemen(float cos_d) { return 0.25 / (cos_d * cos_d); }

// Schlick's approximation with the k that fits GGX [Schlick 1994, eq. 19; Karis 2013].
float geometry_schlick_ggx(vec3 wo, vec3 wi, float alpha) {
    float k = 0.5 * alpha;
    return 0.25 / ((wo.z * (1.0 - k) + k) * (wi.z * (1.0 - k) + k));
}

// erfc(x) for x >= 0 [Abramowitz & Stegun 1964, 7.1.26]: 1.5e-7 off. Given exp(-x^2).
float geometry_erfc(float x, float gauss) {
    float t = 1.0 / (1.0 + 0.3275911 * x);
    return t * (0.254829592 + t * (-0.284496736 + t * (1.421413741 + t * (-1.453152027 + t * 1.061405429)))) * gauss;
}

// The projected area of the facets that face w, of which Smith's G1(w) is w.z [Smith 1967; Heitz 2014, eq. 5].
// Trowbridge and Reitz [Walter et al. 2007, eq. 34].
float geometry_ggx_area(vec3 w, float alpha) { return 0.5 * (w.z + ggx_stretch(w, vec2(alpha))); }

// Beckmann [Walter et al. 2007, the exact form before eq. 35]: cos (1 + (erf a - 1) / 2 + exp(-a^2) / (2 a sqrt pi)),
// a = cos / (alpha sin).
float geometry_beckmann_area(vec3 w, float alpha) {
    float width = alpha * length(w.xy);
    if (w.z > 9.0 * width) return w.z; // what is left out is below exp(-81)
    float a = w.z / width, gauss = exp(-a * a);
    return w.z + 0.5 * (width * gauss * 0.564189584 - w.z * geometry_erfc(a, gauss));
}

#if HAS_MICROFACET_TABLES
// The others, from the row of a table; see gpu/tables/microfacet.py.
float geometry_row_area(uint row, vec3 w) {
    vec4 head = microfacet_texel(row);
    float s = length(w.xy);
    float place = log((s / head.z + w.z) / (w.z + head.y * s)) * head.w;
    float interval = clamp(floor(place), 0.0, float(MICROFACET_INTERVALS - 1u)), x = place - interval;
    vec4 k = microfacet_texel(row + 1u + uint(interval));
    return k.x + x * (k.y + x * (k.z + x * k.w));
}
#endif

float geometry_smith_area(Surface s, vec3 w) {
    float area = w.z;
    uint kind = s.terms.distribution;
#if HAS_MICROFACET_TABLES
    if (s.terms.row_texels > 1u) {
        area = geometry_row_area(s.row, w);
#if TEXTURE_ALPHA >= 0
        area = mix(area, geometry_row_area(s.row_above, w), s.row_share);
#endif
    }
#endif
#if HAS_MICROFACET_DISTRIBUTION_GGX
    if (kind == DISTRIBUTION_GGX) area = geometry_ggx_area(w, s.alpha.x);
#endif
#if HAS_MICROFACET_DISTRIBUTION_BECKMANN
    if (kind == DISTRIBUTION_BECKMANN) area = geometry_beckmann_area(w, s.alpha.x);
#endif
    return area;
}

// G of the surface over 4 (n.wi) (n.wo).
float geometry_term(Surface s, vec3 wo, vec3 wi, vec3 wm, float cos_d) {
    uint kind = s.terms.geometry;
    float g = 0.0;
#if HAS_MICROFACET_GEOMETRY_IMPLICIT
    if (kind == GEOMETRY_IMPLICIT) g = geometry_implicit();
#endif
#if HAS_MICROFACET_GEOMETRY_NEUMANN
    if (kind == GEOMETRY_NEUMANN) g = geometry_neumann(wo, wi);
#endif
#if HAS_MICROFACET_GEOMETRY_COOK_TORRANCE
    if (kind == GEOMETRY_COOK_TORRANCE) g = geometry_cook_torrance(wo, wi, wm, cos_d);
#endif
#if HAS_MICROFACET_GEOMETRY_KELEMEN
    if (kind == GEOMETRY_KELEMEN) g = geometry_kelemen(cos_d);
#endif
#if HAS_MICROFACET_GEOMETRY_SCHLICK_GGX
    if (kind == GEOMETRY_SCHLICK_GGX) g = geometry_schlick_ggx(wo, wi, s.alpha.x);
#endif
#if HAS_MICROFACET_GEOMETRY_SMITH || HAS_MICROFACET_GEOMETRY_SMITH_CORRELATED
    float area_o = geometry_smith_area(s, wo), area_i = geometry_smith_area(s, wi);
    // With G1 = cos / area: G1(wi) G1(wo), and 1 / (1 / G1(wi) + 1 / G1(wo) - 1) [Heitz 2014, eq. 98 and 99].
    if (kind == GEOMETRY_SMITH) g = 0.25 / (area_o * area_i);
    if (kind == GEOMETRY_SMITH_CORRELATED) g = 0.25 / (area_i * wo.z + (area_o - wo.z) * wi.z);
#endif
    return g;
}
#endif
