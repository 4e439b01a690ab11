// A cylinder is a box with the bit ROUND: in its own space that about the y axis which touches the faces of the cube.
// With the bit OPEN it is the side alone, a sheet without caps.

bool cylinder_is(Solid s) { return HAS_CYLINDERS != 0 && (s.shape & ROUND) != 0u; }

#if HAS_CYLINDERS && (HAS_BOXES || HAS_BVH_BOXES)
// The nearest hit in (0, t_max), or t_max, of the ray f + t g in the cylinder's own space, which is between its ends for
// t in `ends`. The roots are those of an ellipsoid's circle (solid.glsl).
float cylinder_hit(Solid s, vec3 f, vec3 g, vec2 ends, float t_max) {
    float a = max(dot(g.xz, g.xz), 1e-30); // of a ray along the axis: the side is then far away in both directions
    float b = -dot(f.xz, g.xz);
    vec2 l = f.xz + (b / a) * g.xz;
    float disc = 1.0 - dot(l, l);
    float q = b + (b < 0.0 ? -1.0 : 1.0) * sqrt(max(disc, 0.0) * a);
    float ta = (dot(f.xz, f.xz) - 1.0) / q, tb = q / a;
    float near = min(ta, tb), far = max(ta, tb), t;
    bool met = disc >= 0.0;
    if ((s.shape & OPEN) != 0u) {
        // The sheet reaches beyond its ends by the rounding of a hit, so that no ray slips through between it and the
        // disks that close it where it shines.
        vec2 y = abs(f.y + vec2(near, far) * g.y);
        vec2 most = 1.0 + gamma_error(8.0) * (2.0 + 2.0 * length(s.row_y) * abs(vec2(near, far)));
        t = near > 0.0 && y.x <= most.x ? near : far;
        met = met && (t == near || y.y <= most.y);
    } else {
        near = max(near, ends.x);
        far = min(far, ends.y);
        t = near > 0.0 ? near : far;
        met = met && near <= far;
    }
    return met && t > 0.0 && t < t_max ? t : t_max;
}

SurfacePoint cylinder_point(Solid s, vec3 p) {
    vec3 q = solid_rows(s, p - s.center);
    float r = length(q.xz);
    vec3 side = r > 0.0 ? vec3(q.x, 0.0, q.z) / r : vec3(1.0, 0.0, 0.0);
    // The face is the one to which the way is shorter in world space: that of a needle or a coin may have a thousandth
    // of the other's size.
    vec3 row = solid_gradient(s, side);
    bool on_side = (s.shape & OPEN) != 0u || (1.0 - r) * length(s.row_y) < (1.0 - abs(q.y)) * length(row);
    // As on a box the point lies exactly on the face and keeps off its rim by its error.
    vec3 error = solid_error(s, solid_axes(s));
    float end = max(0.0, 1.0 - dot(abs(s.row_y), error)), rim = max(0.0, 1.0 - dot(abs(row), error));
    float up = q.y < 0.0 ? -1.0 : 1.0;
    vec3 n = on_side ? side : vec3(0.0, up, 0.0);
    q = on_side ? vec3(side.x, clamp(q.y, -end, end), side.z) : vec3(side.x * min(r, rim), up, side.z * min(r, rim));
    SurfacePoint at = solid_point(s, q, n);
#if HAS_ANISOTROPIC || HAS_TEXTURES
    // On the side u grows as on a sphere and v from the base; caps have the coordinates of a box's top and bottom.
    vec3 t = on_side ? vec3(q.z, 0.0, -q.x) : vec3(1.0, 0.0, 0.0);
    at.tangent = solid_axes(s) * t;
#endif
#if HAS_TEXTURES
    vec3 b = on_side ? vec3(0.0, 1.0, 0.0) : vec3(0.0, 0.0, -up);
    at.uv = clamp(0.5 + 0.5 * vec2(on_side ? atan(q.x, q.z) * INV_PI : q.x, dot(q, b)), 0.0, 1.0);
#endif
#if HAS_HEIGHTS
    at.chart = solid_axes(s) * mat2x3((on_side ? TWO_PI : 2.0) * t, 2.0 * b);
#endif
#if ANY_FOOTPRINTS
    at.grow_u = (on_side ? 0.5 * INV_PI : 0.5) * solid_gradient(s, t);
    at.grow_v = 0.5 * solid_gradient(s, b);
    at.bend = on_side ? 0.5 * length(row) : 0.0; // the mean of its curvatures, of which the one along the axis is 0
#endif
    return at;
}
#endif

#if HAS_CYLINDER_LIGHTS
// The distance from p, outside, to the near half of a side whose far half is seen in the direction wi; 0 where the ray
// comes in by an end.
float cylinder_near(Solid s, vec3 p, vec3 wi) {
    vec3 f = solid_rows(s, p - s.center), g = solid_rows(s, wi);
    float a = dot(g.xz, g.xz), b = -dot(f.xz, g.xz);
    vec2 l = f.xz + (b / a) * g.xz;
    float t = (dot(f.xz, f.xz) - 1.0) / (b + sqrt(max(1.0 - dot(l, l), 0.0) * a));
    return t > 0.0 && abs(f.y + t * g.y) <= 1.0 ? t : 0.0;
}
#endif
