#if HAS_BOXES || HAS_BVH_BOXES
float box_hit(Solid s, vec3 o, vec3 d, float t_max) {
    vec3 f = solid_rows(s, o - s.center), g = solid_rows(s, d);
    vec3 inv = 1.0 / mix(g, vec3(1e-30), equal(g, vec3(0.0)));
    vec3 ta = (-1.0 - f) * inv, tb = (1.0 - f) * inv;
    vec3 lo = min(ta, tb), hi = max(ta, tb);
#if HAS_CYLINDERS
    if (cylinder_is(s)) return cylinder_hit(s, f, g, vec2(lo.y, hi.y), t_max);
#endif
    float near = max(lo.x, max(lo.y, lo.z)), far = min(hi.x, min(hi.y, hi.z));
    float t = near > 0.0 ? near : far;
    return near <= far && t > 0.0 && t < t_max ? t : t_max;
}

SurfacePoint box_point(Solid s, vec3 p) {
#if HAS_CYLINDERS
    if (cylinder_is(s)) return cylinder_point(s, p);
#endif
    vec3 q = solid_rows(s, p - s.center);
    vec3 a = abs(q);
    float m = max(a.x, max(a.y, a.z));
    vec3 n = a.x == m ? vec3(sign(q.x), 0.0, 0.0) : a.y == m ? vec3(0.0, sign(q.y), 0.0) : vec3(0.0, 0.0, sign(q.z));
    // The point lies exactly on the face and keeps off its edges by its error: else a ray that leaves a corner inside
    // could begin behind the other wall.
    vec3 error = solid_error(s, solid_axes(s));
    vec3 edge = vec3(dot(abs(s.row_x), error), dot(abs(s.row_y), error), dot(abs(s.row_z), error));
    vec3 room = max(vec3(0.0), 1.0 - edge);
    q = mix(clamp(q, -room, room), n, notEqual(n, vec3(0.0)));
    SurfacePoint r = solid_point(s, q, n);
#if HAS_ANISOTROPIC || HAS_TEXTURES
    // u grows to the right as seen from outside: on faces of x along -z or +z, of y along +x, of z along +x or -x.
    vec3 t = n.x != 0.0 ? vec3(0.0, 0.0, -n.x) : n.y != 0.0 ? vec3(1.0, 0.0, 0.0) : vec3(n.z, 0.0, 0.0);
    r.tangent = solid_axes(s) * t;
#endif
#if HAS_TEXTURES
    // v grows with +y; on the top along -z, on the bottom along +z.
    vec3 b = n.y != 0.0 ? vec3(0.0, 0.0, -n.y) : vec3(0.0, 1.0, 0.0);
    r.uv = clamp(0.5 + 0.5 * vec2(dot(q, t), dot(q, b)), 0.0, 1.0);
#endif
#if HAS_HEIGHTS
    r.chart = solid_axes(s) * mat2x3(2.0 * t, 2.0 * b);
#endif
#if ANY_FOOTPRINTS
    r.grow_u = 0.5 * solid_gradient(s, t);
    r.grow_v = 0.5 * solid_gradient(s, b);
#endif
    return r;
}
#endif
