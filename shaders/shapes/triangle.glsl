// Watertight test: shared edges are evaluated alike from both sides, so no ray slips between two triangles
// [Woop, Benthin, Wald 2013].

struct Shear { // the ray's own part, made once
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

// Hit in (0, t_max) with the barycentric weights of v1 and v2 in uv, or t_max.
float triangle_hit(Triangle tri, Shear s, vec3 d, float t_max, inout vec2 uv) {
    vec3 a = triangle_axes(tri.v0 - s.o, s.axis);
    vec3 b = triangle_axes(tri.v1 - s.o, s.axis);
    vec3 c = triangle_axes(tri.v2 - s.o, s.axis);
    a.xy -= s.s.xy * a.z;
    b.xy -= s.s.xy * b.z;
    c.xy -= s.s.xy * c.z;
    float u = c.x * b.y - c.y * b.x;
    float v = a.x * c.y - a.y * c.x;
    float w = b.x * a.y - b.y * a.x;
    float det = u + v + w;
    float t = s.s.z * (u * a.z + v * b.z + w * c.z) / det;
    bool inside = min(u, min(v, w)) >= 0.0 || max(u, max(v, w)) <= 0.0;
    bool hit = inside && det != 0.0 && t > 0.0 && t < t_max;
#if HAS_SINGLE_SIDED
    bool single = (tri.shape & SINGLE_SIDED) != 0u;
#if HAS_TRANSMISSION
    Material m = material_load(tri.material); // a body that is left must have a back
    if (m.model == MODEL_PRINCIPLED && m.transmission > 0.0 && m.metallic < 1.0) single = false;
#endif
    if (single) {
        hit = hit && dot(cross(tri.v1 - tri.v0, tri.v2 - tri.v0), d) < 0.0;
    }
#endif
    if (hit) uv = vec2(v, w) / det;
    return hit ? t : t_max;
}

vec3 triangle_decode(uint bits) {
    vec2 e = unpackSnorm2x16(bits);
    vec3 n = vec3(e, 1.0 - abs(e.x) - abs(e.y));
    float fold = max(-n.z, 0.0);
    n.xy -= fold * mix(vec2(-1.0), vec2(1.0), greaterThanEqual(n.xy, vec2(0.0)));
    return normalize(n);
}

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

// Texture coordinates and vertex colours at the weights b, and the tangent along growing u.
void triangle_detail(uint index, vec3 b, vec3 e1, vec3 e2, inout Point r) {
    r.uv = vec2(0.0);
    r.uv_1 = vec2(0.0);
    r.color = vec4(1.0);
    r.handed = 1.0;
#if HAS_UVS
    vec2 a0 = texelFetch(triangle_uvs, triangle_corner(index, 0u), 0).xy;
    vec2 a1 = texelFetch(triangle_uvs, triangle_corner(index, 1u), 0).xy;
    vec2 a2 = texelFetch(triangle_uvs, triangle_corner(index, 2u), 0).xy;
    r.uv = b.x * a0 + b.y * a1 + b.z * a2;
    vec2 d1 = a1 - a0, d2 = a2 - a0;
    float turned = d1.x * d2.y - d1.y * d2.x;
    if (turned != 0.0) {
        r.handed = turned < 0.0 ? -1.0 : 1.0;
        r.tangent = r.handed * (d2.y * e1 - d1.y * e2);
    }
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

Point triangle_point(Triangle tri, vec2 uv, uint index, uint id) {
    Point r;
    vec3 e1 = tri.v1 - tri.v0, e2 = tri.v2 - tri.v0, across = cross(e1, e2);
    float twice_area = length(across);
    r.ng = across / twice_area;
    r.error = gamma_error(7.0) * (abs(tri.v0) + abs(tri.v1) + abs(tri.v2));
    // Off the edges by that error: else a ray that leaves a corner could begin behind the other wall.
    vec3 edge = vec3(length(e2 - e1), length(e2), length(e1)) * (max_component(r.error) / twice_area);
    vec3 b = max(vec3(1.0 - uv.x - uv.y, uv), min(edge, vec3(1.0 / 3.0)));
    b /= b.x + b.y + b.z;
    float b0 = b.x;
    uv = b.yz;
    r.p = b0 * tri.v0 + uv.x * tri.v1 + uv.y * tri.v2;
    r.ns = r.ng;
    r.tangent = e1;
#if HAS_TEXTURES
    triangle_detail(index, vec3(b0, uv), e1, e2, r);
#endif
#if HAS_SMOOTH_NORMALS
    TriangleNormals n = triangle_normals_load(index);
    vec3 ns = b0 * triangle_decode(n.n0) + uv.x * triangle_decode(n.n1) + uv.y * triangle_decode(n.n2);
    if (n.smoothed != 0u && dot(ns, ns) > 0.0) r.ns = normalize(ns);
#endif
    r.material = tri.material;
    r.light = tri.light;
    r.shape = tri.shape;
    r.flat_id = id;
    return r;
}
