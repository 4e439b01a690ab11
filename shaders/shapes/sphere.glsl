// |p - c|^2 - r^2. For a ball so vast that the scene stands on it as on a plain, it comes from s.power, which was
// computed in float64 from the centre and the radius: a float32 of 10 000 km is precise to a metre only.
float sphere_power(Sphere s, vec3 p) {
    vec3 f = p - s.center;
#if HAS_VAST_SPHERES
    if (s.power < INFINITY_T) return dot(p, p - 2.0 * s.center) + s.power;
#endif
    return dot(f, f) - s.radius * s.radius;
}

// The nearest root of |o + t d - c| = r in (0, t_max), or t_max [Haines et al. 2019, "Precision improvements for
// ray/sphere intersection"]: the discriminant comes from the closest approach, and the roots do not cancel.
float sphere_hit(Sphere s, vec3 o, vec3 d, float t_max) {
    vec3 f = o - s.center;
    float b = -dot(f, d);
    vec3 l = f + b * d;
    float disc = s.radius * s.radius - dot(l, l);
    float c = sphere_power(s, o);
#if HAS_VAST_SPHERES
    if (s.power < INFINITY_T) disc = b * b - c;
#endif
    float q = b + (b < 0.0 ? -1.0 : 1.0) * sqrt(max(disc, 0.0));
    float ta = c / q, tb = q;
    float near = min(ta, tb), far = max(ta, tb);
    float t = near > 0.0 ? near : far;
    return disc >= 0.0 && t > 0.0 && t < t_max ? t : t_max;
}

#if HAS_TEXTURES
// The texture coordinates of a place on the unit sphere: u grows eastwards from -z, v from the lower pole.
vec2 sphere_uv(vec3 n) {
    float u = n.x == 0.0 && n.z == 0.0 ? 0.0 : atan(n.x, n.z);
    return vec2(0.5 + u * (0.5 * INV_PI), 1.0 - acos(clamp(n.y, -1.0, 1.0)) * INV_PI);
}
#endif

#if HAS_HEIGHTS
// Its derivatives: how a place on the unit sphere moves with u and with v.
mat2x3 sphere_chart(vec3 n) {
    float side = length(n.xz);
    vec2 out_xz = side > 0.0 ? n.xz / side : vec2(0.0, 1.0);
    return mat2x3(TWO_PI * vec3(n.z, 0.0, -n.x), PI * vec3(-n.y * out_xz.x, side, -n.y * out_xz.y));
}
#endif

SurfacePoint sphere_point(Sphere s, vec3 p) {
    SurfacePoint r;
    r.ng = normalize(p - s.center);
    r.p = s.center + s.radius * r.ng;
    r.error = gamma_error(6.0) * (abs(s.center) + s.radius);
#if HAS_VAST_SPHERES
    if (s.power < INFINITY_T) {
        r.p = p - sphere_power(s, p) / (length(p - s.center) + s.radius) * r.ng;
        r.error = gamma_error(16.0) * abs(p) + gamma_error(16.0) * length(p);
    }
#endif
    r.ns = r.ng;
    r.material = s.material;
    r.light = s.light;
    r.shape = s.shape;
    r.flat_id = NONE;
#if HAS_ANISOTROPIC || HAS_TEXTURES
    // The tangent points along growing u = 1/2 + atan2(x, z) / 2 pi; at a pole any direction serves.
    vec3 n = basis_rotate(vec4(-s.rotation.xyz, s.rotation.w), r.ng);
    vec3 t = dot(n.xz, n.xz) > 0.0 ? vec3(n.z, 0.0, -n.x) : vec3(1.0, 0.0, 0.0);
    r.tangent = basis_rotate(s.rotation, t);
    r.handed = 1.0;
#else
    r.tangent = vec3(1.0, 0.0, 0.0);
#endif
#if HAS_TEXTURES
    r.uv = sphere_uv(n);
    r.uv_1 = vec2(0.0);
    r.color = vec4(1.0);
#endif
#if HAS_HEIGHTS
    mat2x3 chart = sphere_chart(n);
    r.chart = s.radius * mat2x3(basis_rotate(s.rotation, chart[0]), basis_rotate(s.rotation, chart[1]));
    r.chart_1 = mat2x3(0.0);
#endif
    shapes_plain(r);
#if ANY_FOOTPRINTS
    r.bend = 1.0 / s.radius;
    float by = inversesqrt(max(dot(t, t), 1e-12)); // the tangent is as long as the circle of latitude is wide
    r.grow_u = r.tangent * (0.5 * INV_PI * r.bend * by * by);
    r.grow_v = cross(r.ng, r.tangent) * (INV_PI * r.bend * by);
#endif
    return r;
}
