// Affine images of the unit sphere (ellipsoid), of the cube [-1, 1]^3 (box.glsl) and of the cylinder in it
// (cylinder.glsl). Rays are intersected in the solid's own space, where their direction is not of unit length, so that t
// is the same in both spaces.

#if HAS_BOXES || HAS_BVH_BOXES || HAS_ELLIPSOIDS || HAS_BVH_ELLIPSOIDS || ANY_SOLID_LIGHTS
vec3 solid_rows(Solid s, vec3 v) { return vec3(dot(s.row_x, v), dot(s.row_y, v), dot(s.row_z, v)); }

// The columns of world_from_object, from the rows of its inverse.
mat3 solid_axes(Solid s) {
    vec3 x = cross(s.row_y, s.row_z), y = cross(s.row_z, s.row_x), z = cross(s.row_x, s.row_y);
    return mat3(x, y, z) / dot(s.row_x, x);
}

vec3 solid_error(Solid s, mat3 axes) {
    return gamma_error(16.0) * (abs(s.center) + abs(axes[0]) + abs(axes[1]) + abs(axes[2]));
}

// A gradient in world space, from one in the solid's own.
vec3 solid_gradient(Solid s, vec3 g) { return g.x * s.row_x + g.y * s.row_y + g.z * s.row_z; }

SurfacePoint solid_point(Solid s, vec3 q, vec3 n) {
    SurfacePoint r;
    mat3 axes = solid_axes(s);
    r.p = s.center + axes * q;
    r.error = solid_error(s, axes);
    r.ng = normalize(n.x * s.row_x + n.y * s.row_y + n.z * s.row_z); // inverse transpose
    r.ns = r.ng;
    r.material = s.material;
    r.light = s.light;
    r.shape = s.shape & ~SOLID_BITS;
    r.flat_id = NONE;
    r.tangent = axes[0];
#if HAS_TEXTURES || HAS_ANISOTROPIC
    r.handed = dot(s.row_x, cross(s.row_y, s.row_z)) < 0.0 ? -1.0 : 1.0;
#endif
#if HAS_TEXTURES
    r.uv = vec2(0.0);
    r.uv_1 = vec2(0.0);
    r.color = vec4(1.0);
#endif
#if HAS_HEIGHTS
    r.chart = r.chart_1 = mat2x3(0.0);
#endif
    shapes_plain(r);
    return r;
}

float ellipsoid_hit(Solid s, vec3 o, vec3 d, float t_max) {
    vec3 f = solid_rows(s, o - s.center), g = solid_rows(s, d);
    float a = dot(g, g);
    float b = -dot(f, g);
    vec3 l = f + (b / a) * g;
    float disc = 1.0 - dot(l, l);
    float q = b + (b < 0.0 ? -1.0 : 1.0) * sqrt(max(disc, 0.0) * a);
    float ta = (dot(f, f) - 1.0) / q, tb = q / a;
    float near = min(ta, tb), far = max(ta, tb);
    float t = near > 0.0 ? near : far;
    return disc >= 0.0 && t > 0.0 && t < t_max ? t : t_max;
}

SurfacePoint ellipsoid_point(Solid s, vec3 p) {
    vec3 q = normalize(solid_rows(s, p - s.center));
    SurfacePoint r = solid_point(s, q, q);
#if HAS_ANISOTROPIC || HAS_TEXTURES
    vec3 t = dot(q.xz, q.xz) > 0.0 ? vec3(q.z, 0.0, -q.x) : vec3(1.0, 0.0, 0.0);
    r.tangent = solid_axes(s) * t;
#endif
#if HAS_TEXTURES
    r.uv = sphere_uv(q);
#endif
#if HAS_HEIGHTS
    r.chart = solid_axes(s) * sphere_chart(q);
#endif
#if ANY_FOOTPRINTS
    float by = inversesqrt(max(dot(t, t), 1e-12));
    r.grow_u = solid_gradient(s, t) * (0.5 * INV_PI * by * by);
    r.grow_v = solid_gradient(s, cross(q, t)) * (INV_PI * by);
    r.bend = (length(s.row_x) + length(s.row_y) + length(s.row_z)) / 3.0; // that of a ball of about its size
#endif
    return r;
}
#endif
