// One triangle of an emitting mesh, sampled by area.
float triangle_light_area(Triangle t) { return 0.5 * length(cross(t.v1 - t.v0, t.v2 - t.v0)); }

float triangle_light_pdf(Triangle tri, float t, vec3 ng, vec3 wi, uint sides) {
    float c = -dot(wi, ng);
#if HAS_EMISSION_BOTH
    if (sides == 2u && (tri.shape & SINGLE_SIDED) == 0u) c = abs(c);
#endif
    return c > 0.0 ? t * t / (c * triangle_light_area(tri)) : 0.0;
}

LightSample triangle_light_sample(Triangle tri, vec3 p, vec2 u, uint sides) {
    Point at = triangle_point(tri, sampling_triangle(u), 0u, NONE);
    vec3 side = at.ng;
#if HAS_EMISSION_BOTH
    if (sides == 2u) side = p - at.p;
#endif
    vec3 to = shapes_leave(at, side) - p;
    float t = length(to);
    vec3 wi = t > 0.0 ? to / t : at.ng;
    return LightSample(wi, t, vec3(1.0), triangle_light_pdf(tri, t, at.ng, wi, sides), true, NONE);
}
