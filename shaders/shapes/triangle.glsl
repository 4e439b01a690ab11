// The intersection test is watertight: shared edges are evaluated alike from both sides, so that no ray slips between
// two triangles [Woop, Benthin, Wald 2013].

// The part of the test that depends on the ray alone.
struct Shear {
    vec3 o;
    vec3 s; // shear in x and y, scale in z
    uint axis;
};

vec3 triangle_axes(vec3 v, uint axis) { return axis == 0u ? v.yzx : axis == 1u ? v.zxy : v; }

Shear triangle_shear(vec3 o, vec3 d) {
    vec3 a = abs(d);
    Shear s;
    s.axis = a.x >= a.y && a.x >= a.z ? 0u : a.y >= a.z ? 1u : 2u;
    vec3 e = triangle_axes(d, s.axis);
    s.s = vec3(e.xy, 1.0) / e.z;
    s.o = o;
    return s;
}

#if HAS_TRIANGLES || HAS_BVH_TRIANGLES || HAS_INSTANCES || HAS_TRIANGLE_LIGHTS
// The hit in (0, t_max), with the barycentric weights of v1 and v2 in uv, or t_max.
float triangle_hit(Triangle tri, Shear s, vec3 d, float t_max, inout vec2 uv) {
    // Precise: where a product and a sum are rounded once, a neighbour's edge is not this one's with another sign.
    precise vec3 a = triangle_axes(tri.v0 - s.o, s.axis);
    precise vec3 b = triangle_axes(tri.v1 - s.o, s.axis);
    precise vec3 c = triangle_axes(tri.v2 - s.o, s.axis);
    a.xy -= s.s.xy * a.z;
    b.xy -= s.s.xy * b.z;
    c.xy -= s.s.xy * c.z;
    precise float u = c.x * b.y - c.y * b.x;
    precise float v = a.x * c.y - a.y * c.x;
    precise float w = b.x * a.y - b.y * a.x;
    float det = u + v + w;
    float t = s.s.z * (u * a.z + v * b.z + w * c.z) / det;
    bool inside = min(u, min(v, w)) >= 0.0 || max(u, max(v, w)) <= 0.0;
    bool hit = inside && det != 0.0 && t > 0.0 && t < t_max;
#if HAS_SINGLE_SIDED
    bool single = (tri.shape & SINGLE_SIDED) != 0u;
#if HAS_TRANSMISSION
    bool clear = material_transmits(material_load(tri.material)); // a ray can only leave a body that has a back
    single = single && !clear;
#endif
    if (single) {
#if REVERSED
        d = -d; // the camera's rays would go the other way
#endif
        hit = hit && dot(cross(tri.v1 - tri.v0, tri.v2 - tri.v0), d) < 0.0;
    }
#endif
    if (hit) uv = vec2(v, w) / det;
    return hit ? t : t_max;
}

vec3 triangle_decode(uint bits) { return basis_octahedral(unpackSnorm2x16(bits)); }

#if HAS_UVS
layout(binding = TEXTURE_UVS_UNIT) uniform sampler2D triangle_uvs; // three texels a triangle
#endif
#if HAS_UVS_1
layout(binding = TEXTURE_UVS_1_UNIT) uniform sampler2D triangle_uvs_1;
#endif
#if HAS_VERTEX_COLORS
layout(binding = TEXTURE_COLORS_UNIT) uniform sampler2D triangle_colors;
#endif

#if HAS_TEXTURES
ivec2 triangle_corner(uint index, uint k) {
    uint at = 3u * index + k;
    return ivec2(at & (TEXTURE_ROW - 1u), at / TEXTURE_ROW);
}

// Interpolates texture coordinates and vertex colours at the weights b.
void triangle_detail(uint index, vec3 b, inout SurfacePoint r) {
    r.uv = vec2(0.0);
    r.uv_1 = vec2(0.0);
    r.color = vec4(1.0);
#if HAS_UVS
    r.uv = b.x * texelFetch(triangle_uvs, triangle_corner(index, 0u), 0).xy
         + b.y * texelFetch(triangle_uvs, triangle_corner(index, 1u), 0).xy
         + b.z * texelFetch(triangle_uvs, triangle_corner(index, 2u), 0).xy;
#endif
#if HAS_UVS_1
    r.uv_1 = b.x * texelFetch(triangle_uvs_1, triangle_corner(index, 0u), 0).xy
           + b.y * texelFetch(triangle_uvs_1, triangle_corner(index, 1u), 0).xy
           + b.z * texelFetch(triangle_uvs_1, triangle_corner(index, 2u), 0).xy;
#endif
#if HAS_VERTEX_COLORS
    r.color = b.x * texelFetch(triangle_colors, triangle_corner(index, 0u), 0)
            + b.y * texelFetch(triangle_colors, triangle_corner(index, 1u), 0)
            + b.z * texelFetch(triangle_colors, triangle_corner(index, 2u), 0);
#endif
}
#endif

#if HAS_HEIGHTS
// How the point moves with texture coordinates that grow by d1 and d2 along the edges e1 and e2.
mat2x3 triangle_chart_of(vec3 e1, vec3 e2, vec2 d1, vec2 d2) {
    float area = d1.x * d2.y - d1.y * d2.x;
    mat2x3 chart = mat2x3(d2.y * e1 - d1.y * e2, d1.x * e2 - d2.x * e1);
    return area != 0.0 ? chart / area : mat2x3(0.0);
}

void triangle_chart(uint index, vec3 e1, vec3 e2, inout SurfacePoint r) {
    r.chart = r.chart_1 = mat2x3(0.0);
    ivec2 a = triangle_corner(index, 0u), b = triangle_corner(index, 1u), c = triangle_corner(index, 2u);
#if HAS_UVS
    vec2 uv = texelFetch(triangle_uvs, a, 0).xy;
    r.chart = triangle_chart_of(e1, e2, texelFetch(triangle_uvs, b, 0).xy - uv, texelFetch(triangle_uvs, c, 0).xy - uv);
#endif
#if HAS_UVS_1
    vec2 uv_1 = texelFetch(triangle_uvs_1, a, 0).xy;
    r.chart_1 = triangle_chart_of(e1, e2, texelFetch(triangle_uvs_1, b, 0).xy - uv_1,
                                  texelFetch(triangle_uvs_1, c, 0).xy - uv_1);
#endif
}
#endif

#if ANY_FOOTPRINTS
#if HAS_UVS || HAS_UVS_1
// The gradients of a triangle's barycentric weights of its second and third corner, from its edges there.
void triangle_weights_grow(vec3 e1, vec3 e2, out vec3 g1, out vec3 g2) {
    vec3 c = cross(e1, e2);
    float inv = 1.0 / max(dot(c, c), 1e-37);
    g1 = cross(e2, c) * inv;
    g2 = cross(c, e1) * inv;
}
#endif

// The gradients of the texture coordinates.
void triangle_grow(uint index, vec3 e1, vec3 e2, inout SurfacePoint r) {
#if HAS_UVS || HAS_UVS_1
    vec3 g1, g2;
    triangle_weights_grow(e1, e2, g1, g2);
#endif
#if HAS_UVS
    vec2 uv = texelFetch(triangle_uvs, triangle_corner(index, 0u), 0).xy;
    vec2 uv1 = texelFetch(triangle_uvs, triangle_corner(index, 1u), 0).xy - uv;
    vec2 uv2 = texelFetch(triangle_uvs, triangle_corner(index, 2u), 0).xy - uv;
    r.grow_u = uv1.x * g1 + uv2.x * g2;
    r.grow_v = uv1.y * g1 + uv2.y * g2;
#endif
#if HAS_UVS_1
    vec2 st = texelFetch(triangle_uvs_1, triangle_corner(index, 0u), 0).xy;
    vec2 st1 = texelFetch(triangle_uvs_1, triangle_corner(index, 1u), 0).xy - st;
    vec2 st2 = texelFetch(triangle_uvs_1, triangle_corner(index, 2u), 0).xy - st;
    r.grow_u_1 = st1.x * g1 + st2.x * g2;
    r.grow_v_1 = st1.y * g1 + st2.y * g2;
#endif
}
#endif

#if HAS_TANGENTS
// The tangent of the k-th corner, whose normal has these bits. It is coded as an angle in that normal's plane, from the
// x of the frame of [Duff et al. 2017]. The bits decide on the frame's sign, as they are the same on every device.
vec3 triangle_tangent(uint normal, uint bits, uint k) {
    vec3 n = triangle_decode(normal);
    vec2 e = abs(unpackSnorm2x16(normal));
    float s = e.x + e.y < 1.0 - 0.5 / 32767.0 ? 1.0 : -1.0;
    float a = -1.0 / (s + n.z);
    vec3 x = vec3(1.0 + s * n.x * n.x * a, s * n.x * n.y * a, -s * n.x);
    uint code = (bits >> (TANGENT_SHIFT + k * TANGENT_BITS)) & ((1u << TANGENT_BITS) - 1u);
    float angle = float(int(code) - 1) * (TWO_PI / float(TANGENT_STEPS));
    return cos(angle) * x + sin(angle) * cross(n, x);
}
#endif

#if HAS_SMOOTH_NORMALS
// Adds what a corner with the weight b and the normal n says of the smooth surface, as seen from the corner to the point
// `to`: the point's distance from the plane through the corner, on whichever side that plane lies [Hanika 2021].
void triangle_lift(float b, vec3 to, vec3 n, inout SurfacePoint r) {
    float above = dot(to, n);
    r.lift -= b * min(above, 0.0) * n;
    r.sink -= b * max(above, 0.0) * n;
}
#endif

#if HAS_INSTANCES
SurfacePoint triangle_point(Triangle tri, vec2 uv, uint index, uint id, Instance it) {
    SurfacePoint r;
    mat3 axes = instance_axes(it);
    tri.v0 = axes * tri.v0;
    tri.v1 = axes * tri.v1;
    tri.v2 = axes * tri.v2;
    vec3 e1 = tri.v1 - tri.v0, e2 = tri.v2 - tri.v0, across = it.side * cross(e1, e2);
    float twice_area = length(across);
    r.ng = across / twice_area;
    r.error = gamma_error(7.0) * (abs(tri.v0) + abs(tri.v1) + abs(tri.v2)) + ULP * it.error;
#else
SurfacePoint triangle_point(Triangle tri, vec2 uv, uint index, uint id) {
    SurfacePoint r;
    vec3 e1 = tri.v1 - tri.v0, e2 = tri.v2 - tri.v0, across = cross(e1, e2);
    float twice_area = length(across);
    r.ng = across / twice_area;
    r.error = gamma_error(7.0) * (abs(tri.v0) + abs(tri.v1) + abs(tri.v2));
#endif
    // The point keeps off the edges by that error: else a ray that leaves a corner could begin behind the other wall.
    vec3 edge = vec3(length(e2 - e1), length(e2), length(e1)) * (max_component(r.error) / twice_area);
    vec3 b = max(vec3(1.0 - uv.x - uv.y, uv), min(edge, vec3(1.0 / 3.0)));
    b /= b.x + b.y + b.z;
    float b0 = b.x;
    uv = b.yz;
    r.p = b0 * tri.v0 + uv.x * tri.v1 + uv.y * tri.v2;
    r.ns = r.ng;
#if HAS_INSTANCES
    r.p += it.center;
#endif
    r.tangent = e1;
#if HAS_TEXTURES || HAS_ANISOTROPIC
    r.handed = 1.0;
#endif
#if HAS_TEXTURES
    triangle_detail(index, vec3(b0, uv), r);
#endif
#if HAS_HEIGHTS
    triangle_chart(index, e1, e2, r);
#endif
    shapes_plain(r);
#if ANY_FOOTPRINTS
    triangle_grow(index, e1, e2, r);
#endif
#if HAS_SMOOTH_NORMALS
    TriangleNormals n = triangle_normals_load(index);
#if HAS_INSTANCES
    vec3 n0 = instance_normal(it, triangle_decode(n.n0)), n1 = instance_normal(it, triangle_decode(n.n1));
    vec3 n2 = instance_normal(it, triangle_decode(n.n2));
#else
    vec3 n0 = triangle_decode(n.n0), n1 = triangle_decode(n.n1), n2 = triangle_decode(n.n2);
#endif
    vec3 ns = b0 * n0 + uv.x * n1 + uv.y * n2;
    if ((n.bits & NORMALS_SMOOTH) != 0u && dot(ns, ns) > 0.0) {
        r.ns = normalize(ns);
        triangle_lift(b0, uv.x * e1 + uv.y * e2, n0, r);
        triangle_lift(uv.x, uv.y * e2 - (1.0 - uv.x) * e1, n1, r);
        triangle_lift(uv.y, uv.x * e1 - (1.0 - uv.y) * e2, n2, r);
    }
#if ANY_FOOTPRINTS
    // The mean of what the normals turn along two edges, over their lengths.
    float turned = dot(n1 - n0, e1) / dot(e1, e1) + dot(n2 - n0, e2) / dot(e2, e2);
    if ((n.bits & NORMALS_SMOOTH) != 0u) r.bend = 0.5 * turned;
#endif
#if HAS_TANGENTS
#if HAS_INSTANCES
    vec3 along = b0 * instance_tangent(it, triangle_decode(n.n0), triangle_tangent(n.n0, n.bits, 0u))
               + uv.x * instance_tangent(it, triangle_decode(n.n1), triangle_tangent(n.n1, n.bits, 1u))
               + uv.y * instance_tangent(it, triangle_decode(n.n2), triangle_tangent(n.n2, n.bits, 2u));
#else
    vec3 along = b0 * triangle_tangent(n.n0, n.bits, 0u) + uv.x * triangle_tangent(n.n1, n.bits, 1u)
               + uv.y * triangle_tangent(n.n2, n.bits, 2u);
#endif
    if ((n.bits >> TANGENT_SHIFT) != 0u && dot(along, along) > 0.0) r.tangent = along;
#if HAS_TEXTURES || HAS_ANISOTROPIC
    if ((n.bits & NORMALS_LEFT) != 0u) r.handed = -1.0;
#if HAS_INSTANCES
    if ((n.bits >> TANGENT_SHIFT) != 0u) r.handed *= it.side;
#endif
#endif
#endif
#endif
    r.material = tri.material;
    r.light = tri.light;
    r.shape = tri.shape;
    r.flat_id = id;
    return r;
}

#if HAS_INSTANCES
SurfacePoint triangle_point(Triangle tri, vec2 uv, uint index, uint id) {
    return triangle_point(tri, uv, index, id, instance_none());
}
#endif
#endif
