// Heights from textures: the normal of the surface that they displace, where it stays as it is.
#if HAS_HEIGHTS && TEXTURE_HEIGHT >= 0
// How far apart heights are compared along u and v, to both sides of a point: half a texel, which makes the slope of a
// magnified image continuous, as that of bilinear filtering is not. What has no texels is taken for an image of 256, or
// of four texels to a cell of the finest octave of a noise.
vec2 height_step(TextureSlot s, uint material) {
    vec2 texels = vec2(s.width, s.height);
    if ((s.flags & (TEXTURE_SLOT_CHECKER | TEXTURE_SLOT_COORDINATES)) != 0u) texels = vec2(256.0);
#if HAS_NOISES
    if ((s.flags & TEXTURE_SLOT_NOISE) != 0u) {
        TextureRecipe r = texture_recipe_load(material, s.flags >> TEXTURE_SLOT_NUMBER_SHIFT);
        texels = vec2(4.0 * max_component(abs(r.scale)) * pow(r.lacunarity, float(r.octaves) - 1.0));
    }
#endif
    vec2 along = max(abs(s.turn.xy) * texels.x, abs(s.turn.zw) * texels.y);
    if ((s.flags & TEXTURE_SLOT_SOLID) != 0u) along = texels;
    return 0.5 / max(along, vec2(1e-6)); // with a scale of 0 nothing varies, at any distance
}

// How the point moves with the texture's coordinates; of a solid one these are metres along the surface.
mat2x3 height_chart(SurfacePoint at, TextureSlot s, vec3 n) {
    mat2x3 chart = at.chart;
#if HAS_UVS_1
    if ((s.flags & TEXTURE_SLOT_UV_1) != 0u) chart = at.chart_1;
#endif
#if HAS_PROJECTIONS
    mat2x3 projected = projection_chart(projection_make(s, at), n);
    if ((s.flags & TEXTURE_SLOT_PROJECTED) != 0u) chart = projected;
#endif
#if HAS_SOLID_TEXTURES
    Basis along = basis_make(n);
    if ((s.flags & TEXTURE_SLOT_SOLID) != 0u) chart = mat2x3(along.x, along.y);
#endif
    return chart;
}

// The point of the plane that touches the surface there, `by` away in texture coordinates.
SurfacePoint height_beside(SurfacePoint at, mat2x3 chart, vec2 by) {
    at.uv += by;
    at.uv_1 += by;
    at.p += chart * by;
    return at;
}

// What the texture grows by for a unit of u and of v.
vec2 height_slopes(SurfacePoint at, mat2x3 chart, TextureSlot s, TextureUse use) {
    vec4 channel = mix(vec4(0.0), vec4(1.0), equal(uvec4(use.channel), TEXTURE_CHANNEL_R + uvec4(0u, 1u, 2u, 3u)));
    vec2 far = height_step(s, at.material), sum = vec2(0.0);
    for (uint k = 0u; k < 4u; k++) {
        vec2 side = (k < 2u ? vec2(1.0, 0.0) : vec2(0.0, 1.0)) * ((k & 1u) == 0u ? 1.0 : -1.0);
        sum += side * dot(texture_sample(s, height_beside(at, chart, side * far)), channel);
    }
    return sum / (2.0 * far);
}

// Bends the outward normal n into that of the displaced surface; false where the material has no height. For p + h n
// it is n minus the gradient of h along the surface [Mikkelsen 2010, "Bump mapping unparametrized surfaces on the GPU",
// eq. 4], which does not change where the triangles are displaced already and n is that of the surface before.
bool height_normal(SurfacePoint at, inout vec3 n) {
    TextureUse use = texture_use_pick(at.material, TEXTURE_HEIGHT_USE);
    TextureSlot s = texture_slot_pick(at.material, uint(TEXTURE_HEIGHT));
    mat2x3 chart = height_chart(at, s, n);
    bool mapped = use.channel != TEXTURE_CHANNEL_NONE;
    vec2 slopes = use.factor.x * height_slopes(at, chart, s, use);
    float area = dot(n, cross(chart[0], chart[1]));
    vec3 r = n - (slopes.x * cross(chart[1], n) + slopes.y * cross(n, chart[0])) / area;
    float r2 = dot(r, r);
    // Where texture coordinates have no area there is no slope; a vertical wall is as steep as it gets.
    if (mapped && area != 0.0 && r2 > 0.0 && r2 < 1e30) n = r * inversesqrt(r2);
    return mapped;
}
#else
bool height_normal(SurfacePoint at, inout vec3 n) { return false; }
#endif
