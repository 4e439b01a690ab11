// The hit of a parallelogram in (0, t_max), or t_max. The quad reaches beyond its edges by the rounding of a hit, so
// that no ray slips through between two quads that share an edge: the one that the ray hits less obliquely has the hit
// inside.
float quad_hit(Quad q, vec3 o, vec3 d, float t_max) {
    vec3 w = q.origin - o;
    float t = dot(w, q.normal) / dot(d, q.normal); // parallel: infinite or NaN, refused below
    vec3 p = t * d - w;
    float a = dot(p, q.dual_u), b = dot(p, q.dual_v);
    float slack = gamma_error(8.0) * (2.0 * t + q.u_length + q.v_length);
    bool inside = min(min(a, q.u_length - a), min(b, q.v_length - b)) >= -slack;
    inside = inside && disk_holds(q, vec2(a, b) / vec2(q.u_length, q.v_length));
    return inside && t > 0.0 && t < t_max ? t : t_max;
}

SurfacePoint quad_point(Quad q, vec3 p, uint id) {
    SurfacePoint r;
    vec3 w = p - q.origin;
    r.p = p - dot(w, q.normal) * q.normal; // onto the plane: the error left is the rounding of this line
    r.error = gamma_error(8.0) * (abs(q.origin) + abs(w) + abs(p));
    // The point keeps off the edges by that error: else a ray that leaves a corner could begin behind the other wall.
    vec2 at = vec2(dot(w, q.dual_u), dot(w, q.dual_v)), size = vec2(q.u_length, q.v_length);
    vec2 edge = min(vec2(max_component(r.error)), 0.5 * size);
    vec2 by = clamp(at, edge, size - edge) - at;
    r.p += by.x * q.dual_u + by.y * q.dual_v;
    r.ng = q.normal;
    r.ns = q.normal;
    r.tangent = q.u;
    r.material = q.material;
    r.light = q.light;
    r.shape = disk_is(q) ? q.shape & ~ROUND : q.shape;
    r.flat_id = id;
#if HAS_TEXTURES || HAS_ANISOTROPIC
    r.handed = dot(cross(q.normal, q.u), q.v) < 0.0 ? -1.0 : 1.0;
#endif
#if HAS_TEXTURES
    r.uv = clamp(at / size, 0.0, 1.0);
    r.uv_1 = vec2(0.0);
    r.color = vec4(1.0);
#endif
#if HAS_HEIGHTS
    r.chart = mat2x3(q.u, q.v);
    r.chart_1 = mat2x3(0.0);
#endif
    shapes_plain(r);
#if ANY_FOOTPRINTS
    r.grow_u = q.dual_u / q.u_length;
    r.grow_v = q.dual_v / q.v_length;
#endif
    return r;
}
