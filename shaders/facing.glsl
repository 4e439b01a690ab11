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

// The square of the index on wi's side, over the camera's. What comes from infinity comes from outside, even where an
// open sheet of glass leads there.
float facing_eta_scale(float eta_scale, float wi_z, Surface s, float t) {
#if HAS_TRANSMISSION
    if (wi_z < 0.0) eta_scale /= s.eta * s.eta;
    return t == INFINITY_T ? max(eta_scale, 1.0) : eta_scale;
#else
    return 1.0;
#endif
}

// Whether a direction is on the same side of the shading normal and of the surface itself.
bool facing_agrees(float shading, float geometric) {
#if HAS_TRANSMISSION
    return shading * geometric > 0.0;
#else
    return geometric > 0.0;
#endif
}
