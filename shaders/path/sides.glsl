// Sides: the shading normal on the viewer's side, and decisions by a direction's side of a surface.

// The shading normal on the viewer's side of the surface. At a silhouette interpolation or a map can turn it away from
// the viewer; it is then bent back until it is just in view, as black rims would lose light.
vec3 sides_normal(SurfacePoint at, vec3 wo_w) {
    vec3 n = dot(at.ng, wo_w) < 0.0 ? -at.ns : at.ns;
#if HAS_SMOOTH_NORMALS || HAS_NORMAL_MAPS
    float c = dot(n, wo_w);
    if (c < 0.01) n = normalize(n + (0.01 - c) * wo_w);
#endif
    return n;
}

// The square of the refractive index on wi's side over that at the camera, from its value `eta_scale` on wo's side.
// Light that comes from infinity, t = INFINITY_T, comes from outside, even where an open sheet of glass leads there.
float sides_eta_scale(float eta_scale, float wi_z, Surface s, float t) {
#if HAS_TRANSMISSION
    if (wi_z < 0.0) eta_scale /= s.eta * s.eta;
    return t == INFINITY_T ? max(eta_scale, 1.0) : eta_scale;
#else
    return 1.0;
#endif
}

// Whether a direction is on the same side of the shading normal and of the surface itself.
bool sides_agrees(float shading, float geometric) {
#if HAS_TRANSMISSION || HAS_SCATTERING || HAS_WALKS
    return shading * geometric > 0.0;
#else
    return geometric > 0.0;
#endif
}
