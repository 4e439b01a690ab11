// Textures and vertex colours, and the material that they make at a point. The texels of all images stand one after
// another, row 0 first, in one texture for bytes and one for floats. They are filtered here: images of any number, size
// and wrap cost no more than four fetches, and sRGB is decoded before it is filtered.
#include "material/recipe.glsl"

#if HAS_TEXTURES
ivec2 texture_place(uint at) { return ivec2(at & (TEXTURE_ROW - 1u), at / TEXTURE_ROW); }

// IEC 61966-2-1 inverted. Above the straight part it is a polynomial fitted to the 245 bytes there, with a relative
// error of at most 1.2e-5: twelve powers for each sample of a texture would cost more than its fetches.
vec3 texture_decoded(vec3 c) {
    vec3 y = -0.196990575 * c + 0.831461812;
    y = y * c - 1.50289935;
    y = y * c + 1.56965339;
    y = y * c - 1.14754887;
    y = y * c + 0.933739775;
    y = y * c + 0.475830709;
    y = y * c + 0.0359005807;
    y = y * c + 0.000841280823;
    return mix(y, c / 12.92, lessThanEqual(c, vec3(0.04045)));
}

#if HAS_BYTE_TEXELS
layout(binding = TEXTURE_BYTES_UNIT) uniform sampler2D texture_bytes;
#endif
#if HAS_FLOAT_TEXELS
layout(binding = TEXTURE_FLOATS_UNIT) uniform sampler2D texture_floats;
#endif

vec4 texture_texel(TextureSlot s, int x, int y) {
    uint at = s.first + uint(y) * s.width + uint(x);
    vec4 c = vec4(0.0);
#if HAS_BYTE_TEXELS
    c = texelFetch(texture_bytes, texture_place(at), 0);
#if HAS_SRGB_TEXELS
    if ((s.flags & TEXTURE_SLOT_SRGB) != 0u) c.rgb = texture_decoded(c.rgb);
#endif
#endif
#if HAS_FLOAT_TEXELS
    vec4 f = texelFetch(texture_floats, texture_place(at), 0);
    if ((s.flags & TEXTURE_SLOT_FLOATS) != 0u) c = f;
#endif
    return c;
}

// One axis: the two texels around x and the share of the second. x is 0..1, or anything where the texture repeats.
void texture_axis(float x, uint n, uint flags, out int a, out int b, out float share) {
    bool clamps = (flags & TEXTURE_SLOT_CLAMP) != 0u, mirrors = (flags & TEXTURE_SLOT_MIRROR) != 0u;
    float folded = x - 2.0 * floor(0.5 * x);
    float once = clamps ? clamp(x, 0.0, 1.0) : mirrors ? min(folded, 2.0 - folded) : fract(x);
    float t = once * float(n) - 0.5, low = floor(t);
    int last = int(n) - 1;
    share = t - low;
    a = int(low);
    b = a + 1;
    bool stays = clamps || mirrors; // the border texel of a mirrored image is its own neighbour
    if (a < 0) a = stays ? 0 : last;
    if (b > last) b = stays ? last : 0;
}

// `made`: whether the slot has a recipe in some material.
vec4 texture_sample(TextureSlot s, SurfacePoint at, bool made) {
    vec2 uv = at.uv;
#if HAS_UVS_1
    if ((s.flags & TEXTURE_SLOT_UV_1) != 0u) uv = at.uv_1;
#endif
    uv = vec2(dot(s.turn.xy, uv), dot(s.turn.zw, uv)) + vec2(s.offset_u, s.offset_v);
    vec4 c = vec4(0.0);
#if HAS_BYTE_TEXELS || HAS_FLOAT_TEXELS
    int x0, x1, y0, y1;
    vec2 share;
    texture_axis(uv.x, s.width, s.flags, x0, x1, share.x);
    texture_axis(uv.y, s.height, s.flags, y0, y1, share.y); // counted from below
    int top = int(s.height) - 1;
    vec4 low = mix(texture_texel(s, x0, top - y0), texture_texel(s, x1, top - y0), share.x);
    vec4 high = mix(texture_texel(s, x0, top - y1), texture_texel(s, x1, top - y1), share.x);
    c = mix(low, high, share.y);
#endif
#if HAS_CHECKERS
    vec2 cell = floor(uv);
    bool even = fract(0.5 * (cell.x + cell.y)) < 0.25;
    if ((s.flags & TEXTURE_SLOT_CHECKER) != 0u) c = vec4(even ? s.color_a : s.color_b, 1.0);
#endif
#if HAS_NOISES || HAS_RAMPS
    if (made && (s.flags & TEXTURE_SLOT_MADE) != 0u) c = recipe_texel(s, at, uv, c);
#endif
    return c;
}

vec4 texture_sample(TextureSlot s, SurfacePoint at) { return texture_sample(s, at, true); }

// Samples all slots that a surface is made from.
void texture_look(SurfacePoint at, out vec4 texels[max(TEXTURE_SURFACE_SLOTS, 1)]) {
    texels[0] = vec4(0.0);
    for (uint k = 0u; k < uint(TEXTURE_SURFACE_SLOTS); k++) {
        bool made = ((TEXTURE_MADE_SLOTS >> k) & 1u) != 0u; // known to the compiler, as the loop unrolls
        texels[k] = texture_sample(texture_slot_pick(at.material, k), at, made);
    }
}

// The material at the point.
Material texture_material(SurfacePoint at, vec4 texels[max(TEXTURE_SURFACE_SLOTS, 1)]) {
    Material m = material_pick(at.material);
    texture_members(at.material, texels, m);
#if HAS_VERTEX_COLORS
    m.base_color *= at.color.rgb;
#endif
    return m;
}

// The chance that a ray meets the surface at the point. An alpha cutoff is compared with the filtered texel.
float texture_opacity(SurfacePoint at) {
    Material m = material_pick(at.material);
    float opacity = m.opacity;
#if TEXTURE_OPACITY >= 0
    TextureSlot slot = texture_slot_pick(at.material, uint(TEXTURE_OPACITY));
    vec4 texel = texture_sample(slot, at);
#if TEXTURE_OPACITY_IN_ALPHA
    texel.rgb = vec3(0.0); // so that they are neither decoded nor filtered
#endif
    texture_use_opacity(at.material, texel, opacity);
#endif
#if HAS_VERTEX_COLORS
    opacity *= at.color.a;
#endif
#if TEXTURE_CUTOFF >= 0
    texture_use_cutoff(at.material, texture_sample(texture_slot_pick(at.material, uint(TEXTURE_CUTOFF)), at), m.cutoff);
#endif
#if TEXTURE_OPACITY >= 0 || TEXTURE_CUTOFF >= 0 || HAS_VERTEX_COLORS
    if (m.cutoff >= 0.0) opacity = opacity >= m.cutoff ? 1.0 : 0.0;
#endif
    return opacity;
}

vec3 texture_emission(SurfacePoint at) {
    vec3 emission = material_pick(at.material).emission;
#if TEXTURE_EMISSION >= 0
    TextureSlot slot = texture_slot_pick(at.material, uint(TEXTURE_EMISSION));
    texture_use_emission(at.material, texture_sample(slot, at), emission);
#endif
    return emission;
}

vec3 texture_ambient(SurfacePoint at) {
    vec3 ambient = material_pick(at.material).ambient;
#if TEXTURE_AMBIENT >= 0
    TextureSlot slot = texture_slot_pick(at.material, uint(TEXTURE_AMBIENT));
    texture_use_ambient(at.material, texture_sample(slot, at), ambient);
#endif
    return ambient;
}

#if HAS_NORMAL_MAPS
// The shading normal n, bent as a normal map says: red along growing u, green along growing v, blue outwards. u and v
// are the image's own: where it is turned or mirrored on the surface, so are its bumps. Scaling keeps their slopes.
vec3 texture_bent(SurfacePoint at, vec3 n, vec4 texel, TextureSlot s, float strength) {
    vec3 t = 2.0 * texel.xyz - 1.0;
    vec2 u = s.turn.xz, v = s.turn.yw;
    t.xy = vec2(dot(t.xy, u) * inversesqrt(max(dot(u, u), 1e-30)), dot(t.xy, v) * inversesqrt(max(dot(v, v), 1e-30)));
    t.xy *= strength;
    vec3 x = at.tangent - dot(at.tangent, n) * n;
    float x2 = dot(x, x);
    x *= inversesqrt(max(x2, 1e-30));
    vec3 r = t.x * x + (at.handed * t.y) * cross(n, x) + t.z * n;
    float r2 = dot(r, r);
    return x2 > 1e-30 && r2 > 0.0 ? r * inversesqrt(r2) : n;
}

// Bends the base's outward shading normal n; false where no map does.
bool texture_normal(SurfacePoint at, vec4 texels[max(TEXTURE_SURFACE_SLOTS, 1)], inout vec3 n) {
    bool mapped = false;
#if TEXTURE_NORMAL >= 0
    TextureUse use = texture_use_pick(at.material, TEXTURE_NORMAL_USE);
    mapped = use.channel != TEXTURE_CHANNEL_NONE;
    TextureSlot s = texture_slot_pick(at.material, uint(TEXTURE_NORMAL));
    if (mapped) n = texture_bent(at, n, texels[TEXTURE_NORMAL], s, use.factor.x);
#endif
    return mapped;
}

// Bends the coat's likewise.
bool texture_coat_normal(SurfacePoint at, vec4 texels[max(TEXTURE_SURFACE_SLOTS, 1)], inout vec3 n) {
    bool mapped = false;
#if TEXTURE_COAT_NORMAL >= 0
    TextureUse use = texture_use_pick(at.material, TEXTURE_COAT_NORMAL_USE);
    mapped = use.channel != TEXTURE_CHANNEL_NONE;
    TextureSlot s = texture_slot_pick(at.material, uint(TEXTURE_COAT_NORMAL));
    if (mapped) n = texture_bent(at, n, texels[TEXTURE_COAT_NORMAL], s, use.factor.x);
#endif
    return mapped;
}
#endif
#endif
