// GGX microfacets, also called Trowbridge-Reitz and GTR2. wm is in the shading frame; alpha is given per axis.

// The density of wm, 1/sr [Burley 2012, eq. 13], written in x and y: the form in z alone, z^2 (alpha^2 - 1) + 1,
// cancels in fp32; at alpha = 1e-3 it is 12 % off, this one 0.00005 %.
float ggx_d(vec3 wm, vec2 alpha) {
    vec2 s = wm.xy / alpha;
    float t = dot(s, s) + wm.z * wm.z;
    return INV_PI / (alpha.x * alpha.y * t * t);
}

// A normal that is visible from wo, distributed as visible normals are; wo.z > 0 [Dupuy & Benyoub 2023, listing 3].
vec3 ggx_visible_normal(vec3 wo, vec2 alpha, vec2 u) {
    vec3 v = normalize(vec3(alpha * wo.xy, wo.z));
    float phi = TWO_PI * u.x;
    float z = (1.0 - u.y) * (1.0 + v.z) - v.z;
    float r = sqrt(clamp(1.0 - z * z, 0.0, 1.0));
    vec3 h = vec3(r * cos(phi), r * sin(phi), z) + v;
    return normalize(vec3(alpha * h.xy, max(h.z, 0.0)));
}

// The density over wi of reflecting wo about a visible normal: G1(wo) D(wm) / (4 cos o) [Heitz 2018, eq. 17].
float ggx_visible_pdf(vec3 wo, vec3 wm, vec2 alpha) {
    vec2 a = alpha * wo.xy;
    return ggx_d(wm, alpha) / (2.0 * (wo.z + sqrt(dot(a, a) + wo.z * wo.z)));
}

// Smith's masking of one direction, divided by 2 cos, as in the 2012 course notes: 1 / (c + sqrt(a^2 + c^2 - a^2 c^2)).
float ggx_smith(float c, float a) {
    float a2 = a * a;
    return 1.0 / (c + sqrt(a2 + c * c - a2 * c * c));
}

// The length of w stretched by alpha, of which Smith's G1(w) is 2 |cos| / (|cos| + length) [Heitz 2014, eq. 72].
float ggx_stretch(vec3 w, vec2 alpha) {
    vec2 a = alpha * w.xy;
    return sqrt(dot(a, a) + w.z * w.z);
}

// The masking of two directions on one side with correlated heights, divided by 4 cos cos [Heitz 2014, eq. 99].
float ggx_visibility(vec3 wo, vec3 wi, vec2 alpha) {
    return 0.5 / (abs(wo.z) * ggx_stretch(wi, alpha) + abs(wi.z) * ggx_stretch(wo, alpha));
}
