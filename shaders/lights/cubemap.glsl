// Six square faces in one texture of 3 x 2: px nx py, then ny pz nz. On a face a runs right and b down, -1..1. The
// density of a texel is per unit of area in the face's plane at distance 1; r^3 turns it into one per solid angle.

#if HAS_ENVIRONMENT_CUBE
// (a, b) and the face of a direction, by OpenGL's table.
vec3 cubemap_place(vec3 d) {
    vec3 m = abs(d);
    bool along_x = m.x >= m.y && m.x >= m.z, along_y = !along_x && m.y >= m.z;
    float major = along_x ? m.x : along_y ? m.y : m.z;
    bool back = (along_x ? d.x : along_y ? d.y : d.z) < 0.0;
    vec2 ab = along_x ? vec2(back ? d.z : -d.z, -d.y)
        : along_y ? vec2(d.x, back ? -d.z : d.z) : vec2(back ? -d.x : d.x, -d.y);
    return vec3(ab / major, (along_x ? 0.0 : along_y ? 2.0 : 4.0) + (back ? 1.0 : 0.0));
}

// The direction, not of unit length, of a place on a face.
vec3 cubemap_direction(vec2 ab, uint face) {
    float side = (face & 1u) == 0u ? 1.0 : -1.0;
    if (face < 2u) return vec3(side, -ab.y, -side * ab.x);
    if (face < 4u) return vec3(ab.x, side, side * ab.y);
    return vec3(side * ab.x, -ab.y, side);
}

// The radiance, filtered bilinearly within the face, and the density per steradian.
vec4 cubemap_radiance(vec3 d) {
    vec3 place = cubemap_place(d);
    int n = max(textureSize(environment_texels, 0).y / 2, 1);
    int face = int(place.z);
    ivec2 corner = ivec2(face >= 3 ? face - 3 : face, face >= 3 ? 1 : 0) * n;
    vec2 xy = (0.5 * place.xy + 0.5) * float(n);
    ivec2 at = clamp(ivec2(xy), 0, n - 1);
    vec2 c = floor(xy - 0.5);
    vec2 f = xy - 0.5 - c;
    ivec2 p0 = corner + max(ivec2(c), 0), p1 = corner + min(ivec2(c) + 1, n - 1);
    vec4 a = texelFetch(environment_texels, p0, 0), b = texelFetch(environment_texels, ivec2(p1.x, p0.y), 0);
    vec4 e = texelFetch(environment_texels, ivec2(p0.x, p1.y), 0), g = texelFetch(environment_texels, p1, 0);
    at += corner;
    float here = at.y == p0.y ? (at.x == p0.x ? a.a : b.a) : (at.x == p0.x ? e.a : g.a);
    float r2 = 1.0 + dot(place.xy, place.xy);
    return vec4(mix(mix(a.rgb, b.rgb, f.x), mix(e.rgb, g.rgb, f.x), f.y), here * r2 * sqrt(r2));
}

// The direction towards the place that lies `inside` texels from a block's corner, a texel of the texture.
vec3 cubemap_point(vec2 corner, vec2 inside) {
    float n = float(textureSize(environment_texels, 0).y / 2);
    uint column = (corner.x >= n ? 1u : 0u) + (corner.x >= 2.0 * n ? 1u : 0u), row = corner.y >= n ? 1u : 0u;
    vec2 ab = (corner - vec2(column, row) * n + inside) / n * 2.0 - 1.0;
    return normalize(cubemap_direction(ab, column + 3u * row));
}
#endif
