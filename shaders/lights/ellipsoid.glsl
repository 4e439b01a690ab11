// An ellipsoid, sampled uniformly over the unit sphere it is an image of. An area element of that sphere with
// normal n grows by |det A| |A^-T n| under the map A.
float ellipsoid_light_density(Solid s, vec3 q) { // per area
    mat3 axes = solid_axes(s);
    vec3 n = q.x * s.row_x + q.y * s.row_y + q.z * s.row_z;
    return 1.0 / (4.0 * PI * abs(determinant(axes)) * length(n));
}

float ellipsoid_light_pdf(Solid s, float t, Point at, vec3 wi) {
    float c = -dot(wi, at.ng);
    return c > 0.0 ? ellipsoid_light_density(s, normalize(solid_rows(s, at.p - s.center))) * t * t / c : 0.0;
}

LightSample ellipsoid_light_sample(Solid s, vec3 p, vec2 u) {
    vec3 q = sampling_sphere(u);
    Point at = solid_point(s, q, q);
    vec3 to = shapes_leave(at, at.ng) - p;
    float t = length(to);
    vec3 wi = t > 0.0 ? to / t : at.ng;
    return LightSample(wi, t, vec3(0.0), ellipsoid_light_pdf(s, t, at, wi), true, NONE);
}
