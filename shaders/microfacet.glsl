// Microfacet distributions. wm in the shading frame, alpha per axis.

// Trowbridge-Reitz (GTR2) density of wm, 1/sr [Burley 2012, eq. 13], written in x and y: the form in z
// alone, z^2 (alpha^2 - 1) + 1, cancels in fp32 (12 % off at alpha = 1e-3, 0.00005 % so).
float microfacet_gtr2(vec3 wm, vec2 alpha) {
    vec2 s = wm.xy / alpha;
    float t = dot(s, s) + wm.z * wm.z;
    return INV_PI / (alpha.x * alpha.y * t * t);
}

// GTR1 (Berry) density of wm, 1/sr [Burley 2012, eq. 4], with t as sin^2 + alpha^2 cos^2 for the same reason.
float microfacet_gtr1(vec3 wm, float alpha) {
    float a2 = alpha * alpha;
    float t = dot(wm.xy, wm.xy) + a2 * wm.z * wm.z;
    return (a2 - 1.0) / (PI * log(a2) * t);
}

// Normal visible from wo (wo.z > 0), distributed as GTR2's visible normals [Dupuy & Benyoub 2023, listing 3].
vec3 microfacet_visible_normal(vec3 wo, vec2 alpha, vec2 u) {
    vec3 v = normalize(vec3(alpha * wo.xy, wo.z));
    float phi = TWO_PI * u.x;
    float z = (1.0 - u.y) * (1.0 + v.z) - v.z;
    float r = sqrt(clamp(1.0 - z * z, 0.0, 1.0));
    vec3 h = vec3(r * cos(phi), r * sin(phi), z) + v;
    return normalize(vec3(alpha * h.xy, max(h.z, 0.0)));
}

// Density over wi of reflecting wo about a visible normal: G1(wo) D(wm) / (4 cos o) [Heitz 2018, eq. 17].
float microfacet_visible_pdf(vec3 wo, vec3 wm, vec2 alpha) {
    vec2 a = alpha * wo.xy;
    return microfacet_gtr2(wm, alpha) / (2.0 * (wo.z + sqrt(dot(a, a) + wo.z * wo.z)));
}

// Normal with density gtr1(wm) cos(theta_m) [Burley 2012, eq. 5], its sine taken without cancelling.
vec3 microfacet_gtr1_normal(float alpha, vec2 u) {
    float a2 = alpha * alpha;
    float sin2 = clamp((exp(log(a2) * (1.0 - u.y)) - a2) / (1.0 - a2), 0.0, 1.0);
    float s = sqrt(sin2), phi = TWO_PI * u.x;
    return vec3(s * cos(phi), s * sin(phi), sqrt(1.0 - sin2));
}

// Smith masking of one direction over 2 cos, as the 2012 course notes have it: 1 / (c + sqrt(a^2 + c^2 - a^2 c^2)).
float microfacet_smith(float c, float a) {
    float a2 = a * a;
    return 1.0 / (c + sqrt(a2 + c * c - a2 * c * c));
}

// Length that stretches with alpha: Smith's G1(w) is 2 |cos| / (|cos| + length) [Heitz 2014, eq. 72].
float microfacet_stretch(vec3 w, vec2 alpha) {
    vec2 a = alpha * w.xy;
    return sqrt(dot(a, a) + w.z * w.z);
}

// Masking of two directions on one side, heights correlated, over 4 cos cos [Heitz 2014, eq. 99].
float microfacet_visibility(vec3 wo, vec3 wi, vec2 alpha) {
    return 0.5 / (abs(wo.z) * microfacet_stretch(wi, alpha) + abs(wi.z) * microfacet_stretch(wo, alpha));
}
