// The surface where a path scatters: its normal as the viewer sees it, and what a map that bends it asks for.

// A shading normal that the viewer sees, on the viewer's side of the surface. Interpolation, or a map, can turn it away
// at a silhouette; it is then bent back until it is just in view, which loses no light to black rims.
vec3 facing_normal(SurfacePoint at, vec3 wo_w) {
    vec3 n = dot(at.ng, wo_w) < 0.0 ? -at.ns : at.ns;
#if HAS_SMOOTH_NORMALS || HAS_NORMAL_MAPS
    float c = dot(n, wo_w);
    if (c < 0.01) n = normalize(n + (0.01 - c) * wo_w);
#endif
    return n;
}

#if HAS_TRANSMISSION
// The square of the index on wi's side, over the camera's. What comes from infinity comes from outside, even where an
// open sheet of glass leads there.
float facing_eta_scale(float eta_scale, float wi_z, Surface s, float t) {
    if (wi_z < 0.0) eta_scale /= s.eta * s.eta;
    return t == INFINITY_T ? max(eta_scale, 1.0) : eta_scale;
}
#endif

// Whether a direction is on the same side of the shading normal and of the surface itself.
bool facing_agrees(float shading, float geometric) {
#if HAS_TRANSMISSION
    return shading * geometric > 0.0;
#else
    return geometric > 0.0;
#endif
}

#if HAS_NORMAL_MAPS
// A lobe about a normal that a map has bent reaches below the surface. What it sends there comes back up, as if the
// surface were a mirror to it: nothing is lost, and nothing gained. It is the idea of [Schuessler, Heitz, Hanika,
// Dachsbacher 2017, "Microfacet-based normal mapping"] with the tangent facet laid flat, of one further scattering.
// So v has the sum of two directions of the lobe: itself and its image below. Light that is refracted folds likewise.
Scatter normal_map_eval(Surface s, Basis basis, vec3 wo, vec3 v, vec3 front, bool mapped) {
    Scatter sum = Scatter(vec3(0.0), 0.0);
    float side = dot(v, front);
    vec3 w = v;
    bool more;
    uint k = 0u;
    do {
        vec3 wi = frame_to_local(basis, w);
        Scatter f = bsdf_eval(s, wo, wi);
        if (!mapped || wi.z * side > 0.0) sum = Scatter(sum.f + f.f, sum.pdf + f.pdf);
        w = v - 2.0 * side * front;
        more = k == 0u && mapped && dot(w, basis.z) * side > 0.0;
#if HAS_COAT_NORMALS
        Scatter c = principled_coat_eval(s, wo, wi);
        if (side > 0.0) sum = Scatter(sum.f + c.f, sum.pdf + c.pdf);
        more = more || (k == 0u && mapped && side > 0.0 && dot(frame_to_local(basis, w), s.coat.z) > 0.0);
#endif
        k++;
    } while (more);
    return sum;
}
#endif
