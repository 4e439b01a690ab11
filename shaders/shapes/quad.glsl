// Parallelogram: hit in (0, t_max), or t_max.
float quad_hit(Quad q, vec3 o, vec3 d, float t_max) {
    vec3 w = q.origin - o;
    float t = dot(w, q.normal) / dot(d, q.normal); // parallel: infinite or NaN, refused below
    vec3 p = t * d - w;
    float a = dot(p, q.dual_u), b = dot(p, q.dual_v);
    bool inside = a >= 0.0 && a <= 1.0 && b >= 0.0 && b <= 1.0;
    return inside && t > 0.0 && t < t_max ? t : t_max;
}

Point quad_point(Quad q, vec3 p, uint id) {
    Point r;
    vec3 w = p - q.origin;
    r.p = p - dot(w, q.normal) * q.normal; // onto the plane: what is left is the rounding of this line
    r.error = gamma_error(8.0) * (abs(q.origin) + abs(w) + abs(p));
    r.ng = q.normal;
    r.ns = q.normal;
    r.tangent = q.u;
    r.material = q.material;
    r.light = q.light;
    r.shape = q.shape;
    r.flat_id = id;
    return r;
}
