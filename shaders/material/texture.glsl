// Textures and vertex colours, and the material that they make at a point. The texels of all images stand one after
// another, row 0 first, in one texture for bytes and one for floats. They are filtered here: images of any number, size
// and wrap cost no more than four fetches, and sRGB is decoded before it is filtered.
#include "material/footprint.glsl"
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

vec4 texture_texel(TextureSlot s, uint at) {
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

// A coordinate as the texture wraps it, 0..1. `wrap` has the bits of u; those of v are shifted down to them.
float texture_once(float x, uint wrap) {
    float once = fract(x);
#if ANY_MIRRORED
    float folded = x - 2.0 * floor(0.5 * x);
    if ((wrap & TEXTURE_SLOT_MIRROR) != 0u) once = min(folded, 2.0 - folded);
#endif
#if ANY_CLAMPED
    if ((wrap & TEXTURE_SLOT_CLAMP) != 0u) once = clamp(x, 0.0, 1.0);
#endif
    return once;
}

// One axis: the two texels around x and the share of the second. x is 0..1, or anything where the texture repeats.
void texture_axis(float x, uint n, uint wrap, out int a, out int b, out float share) {
    float t = texture_once(x, wrap) * float(n) - 0.5, low = floor(t);
    int last = int(n) - 1;
    share = t - low;
    a = int(low);
    b = a + 1;
    // The border texel of a mirrored image is its own neighbour.
    bool stays = (ANY_CLAMPED != 0 || ANY_MIRRORED != 0) && (wrap & TEXTURE_SLOT_WRAPS) != 0u;
    if (a < 0) a = stays ? 0 : last;
    if (b > last) b = stays ? last : 0;
}

#if ANY_FOOTPRINTS
const uint TEXTURE_THIRD = 0xaaaaaaabu; // times this is a third of a multiple of 3, modulo 2^32

// Where a mip level begins, and its size. Behind the image stand levels of a quarter each, down to one that is a single
// texel high or wide, and then levels of a half.
void texture_level(TextureSlot s, int level, out uint first, out ivec2 size) {
    ivec2 power = ivec2(s.color_a.xy);
    ivec2 left = max(power - level, 0), top = max(power - 1, 0);
    uint mine = 1u << uint(left.x + left.y), most = 1u << uint(top.x + top.y);
    uint line = min(1u << uint(abs(power.x - power.y)), most);
    uint before = 4u * TEXTURE_THIRD * (most - max(mine, line)) + 2u * (line - min(mine, line));
    first = level > 0 ? s.first + s.width * s.height + before : s.first;
    size = level > 0 ? ivec2(1) << left : ivec2(s.width, s.height);
}

// A footprint that is wider than a texel, as four places in the level whose texels are about as wide as a quarter of
// it. A texel is read as it is: it is the mean over its square, and the samples of a pixel smooth its edges.
void texture_taps(TextureSlot s, vec2 uv, mat2 spread, inout uint first, inout uint width, inout ivec2 at[4],
                  inout vec2 share, inout bool whole) {
    vec2 size = vec2(s.width, s.height);
    vec2 a = spread[0] * size, b = spread[1] * size;
    float a2 = dot(a, a), b2 = dot(b, b), major2 = min(max(a2, b2), 1e18);
    if (major2 > 1.0 && (s.flags & TEXTURE_SLOT_LEVELS) != 0u) {
        int last = int(max(s.color_a.x, s.color_a.y));
        float inverse = inversesqrt(major2), major = major2 * inverse, minor = abs(a.x * b.y - a.y * b.x) * inverse;
        bool square = major < 2.0 * minor; // then two by two places, else four in a row
        float fine = square ? 0.5 * major : max(minor, 0.25 * major);
        int power = floatBitsToInt(fine * 1.4142136) >> 23; // of two, the nearest, and its bias of 127
        int level = clamp(power - 127, 0, last);
        ivec2 n;
        texture_level(s, level, first, n);
        width = uint(n.x);
        // The four begin to part where they take the place of four neighbours. A normal map's normals are not mixed.
        float apart = (s.flags & TEXTURE_SLOT_NORMALS) != 0u ? 0.0 : 0.25 * sqrt(1.0 - inverse * inverse);
        vec2 by = apart * (a2 >= b2 ? spread[0] : spread[1]), aside = apart * (a2 >= b2 ? spread[1] : spread[0]);
        for (int k = 0; k < 4; k++) {
            vec2 p = uv + (square ? float(2 * (k & 1) - 1) * by + float((k & 2) - 1) * aside
                                  : (float(k) - 1.5) * by);
            vec2 once = vec2(texture_once(p.x, s.flags), texture_once(p.y, s.flags >> TEXTURE_SLOT_V_SHIFT));
            at[k] = min(ivec2(once * vec2(n)), n - 1);
            at[k].y = n.y - 1 - at[k].y;
        }
        share = vec2(0.5);
        whole = level == 0;
    }
}
#endif

// The texel of an image at its coordinates uv. Always four are read: the neighbours of a point, or those of a footprint.
vec4 texture_image(TextureSlot s, vec2 uv, mat2 spread) {
    int x0, x1, y0, y1;
    vec2 share;
    texture_axis(uv.x, s.width, s.flags, x0, x1, share.x);
    texture_axis(uv.y, s.height, s.flags >> TEXTURE_SLOT_V_SHIFT, y0, y1, share.y); // counted from below
    int top = int(s.height) - 1;
    ivec2 at[4] = ivec2[4](ivec2(x0, top - y0), ivec2(x1, top - y0), ivec2(x0, top - y1), ivec2(x1, top - y1));
    uint first = s.first, width = s.width;
    bool whole = true; // the image itself is read, none of its levels
#if ANY_FOOTPRINTS
    texture_taps(s, uv, spread, first, width, at, share, whole);
#endif
    vec4 texels[4];
    for (int k = 0; k < 4; k++) texels[k] = texture_texel(s, first + uint(at[k].y) * width + uint(at[k].x));
    vec4 c = mix(mix(texels[0], texels[1], share.x), mix(texels[2], texels[3], share.x), share.y);
#if HAS_NORMAL_MAPS
    if (whole && (s.flags & TEXTURE_SLOT_NORMALS) != 0u) c.a = 0.0; // no normals are lost
#endif
    return c;
}

#if HAS_CHECKERS
// The mean of the wave that is 1 in even cells and -1 in odd ones, over [x - w / 2, x + w / 2].
vec2 texture_wave(vec2 x, vec2 w) {
    x -= 2.0 * floor(0.5 * x);
    vec2 low = fract(0.5 * x - 0.25 * w), high = fract(0.5 * x + 0.25 * w);
    // The wave's integral from 0 is as high as the distance from the middle of an odd cell is less than 1.
    vec2 sum = abs(2.0 * low - 1.0) - abs(2.0 * high - 1.0);
    return mix(clamp(sum / max(w, 1e-3), -1.0, 1.0), 1.0 - 2.0 * step(1.0, x), lessThan(w, vec2(1e-3)));
}

// How far a footprint reaches before cells are filtered at all, in cells: up close nothing blurs.
const float TEXTURE_SHARP = 0.125;

// A checker's colour at uv, which count its cells.
vec3 texture_checker(TextureSlot s, vec2 uv, mat2 spread) {
#if ANY_FOOTPRINTS
    // The mean over a box is a product of two; four of them follow the longer axis.
    bool first = dot(spread[0], spread[0]) >= dot(spread[1], spread[1]);
    vec2 major = first ? spread[0] : spread[1], minor = first ? spread[1] : spread[0];
    float m2 = max(dot(major, major), 1e-20), n2 = max(dot(minor, minor), 1e-20);
    major *= sqrt(max(1.0 - sqr(TEXTURE_SHARP) / m2, 0.0));
    minor *= sqrt(max(1.0 - sqr(TEXTURE_SHARP) / n2, 0.0));
    vec2 box = 0.25 * abs(major) + abs(minor);
    float even = 0.0;
    for (int k = 0; k < 4; k++) {
        vec2 wave = texture_wave(uv + (0.25 * float(k) - 0.375) * major, box);
        even += wave.x * wave.y;
    }
    return mix(s.color_b, s.color_a, 0.5 + 0.125 * even);
#else
    vec2 wave = texture_wave(uv, vec2(0.0));
    return wave.x * wave.y > 0.0 ? s.color_a : s.color_b;
#endif
}
#endif

// The texel at the slot's own coordinates uv, filtered over `spread`: the axes of the footprint there.
vec4 texture_filtered(TextureSlot s, vec2 uv, mat2 spread) {
    vec4 c = vec4(0.0);
#if HAS_BYTE_TEXELS || HAS_FLOAT_TEXELS
    c = texture_image(s, uv, spread);
#endif
#if HAS_CHECKERS
    if ((s.flags & TEXTURE_SLOT_CHECKER) != 0u) c = vec4(texture_checker(s, uv, spread), 1.0);
#endif
    return c;
}

// The slot's own coordinates of a point, and the footprint in them.
vec2 texture_uv(TextureSlot s, SurfacePoint at, Footprint footprint, out mat2 spread) {
    vec2 uv = at.uv;
    spread = footprint_in(s, footprint);
#if HAS_UVS_1
    if ((s.flags & TEXTURE_SLOT_UV_1) != 0u) uv = at.uv_1;
#endif
#if HAS_PROJECTIONS
    Projection by = projection_make(s, at);
    bool projected = (s.flags & TEXTURE_SLOT_PROJECTED) != 0u;
    if (projected) uv = by.uv;
    if (projected) spread = footprint_along(s, footprint, by.grow_u, by.grow_v);
#endif
    return vec2(dot(s.turn.xy, uv), dot(s.turn.zw, uv)) + vec2(s.offset_u, s.offset_v);
}

// `made`: whether the slot has a recipe in some material.
vec4 texture_sample(TextureSlot s, SurfacePoint at, Footprint footprint, bool made) {
    mat2 spread;
    vec2 uv = texture_uv(s, at, footprint, spread);
    vec4 c = texture_filtered(s, uv, spread);
#if HAS_NOISES || HAS_RAMPS
    if (made && (s.flags & TEXTURE_SLOT_MADE) != 0u) c = recipe_texel(s, at, uv, c);
#endif
    return c;
}

vec4 texture_sample(TextureSlot s, SurfacePoint at, Footprint footprint) {
    return texture_sample(s, at, footprint, true);
}

// At the point itself.
vec4 texture_sample(TextureSlot s, SurfacePoint at) { return texture_sample(s, at, footprint_none(), true); }

// Samples all slots that a surface is made from.
void texture_look(SurfacePoint at, Footprint footprint, out vec4 texels[max(TEXTURE_SURFACE_SLOTS, 1)]) {
    texels[0] = vec4(0.0);
    for (uint k = 0u; k < uint(TEXTURE_SURFACE_LOOP); k++) {
        bool made = ((TEXTURE_MADE_SLOTS >> k) & 1u) != 0u; // known to the compiler where the loop unrolls
        texels[k] = texture_sample(texture_slot_pick(at.material, k), at, footprint, made);
    }
}

// The material at the point.
Material material_at(SurfacePoint at, vec4 texels[max(TEXTURE_SURFACE_SLOTS, 1)]) {
    Material m = material_pick(at.material);
    texture_members(at.material, texels, m);
#if HAS_VERTEX_COLORS
    m.base_color *= at.color.rgb;
#endif
    return m;
}

// Likewise, with texels of the point alone.
Material material_at(SurfacePoint at) {
    vec4 texels[max(TEXTURE_SURFACE_SLOTS, 1)];
    texture_look(at, footprint_none(), texels);
    return material_at(at, texels);
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

vec3 texture_emission(SurfacePoint at, Footprint footprint) {
    vec3 emission = material_pick(at.material).emission;
#if TEXTURE_EMISSION >= 0
    TextureSlot slot = texture_slot_pick(at.material, uint(TEXTURE_EMISSION));
    texture_use_emission(at.material, texture_sample(slot, at, footprint), emission);
#endif
    return emission;
}

vec3 texture_ambient(SurfacePoint at, Footprint footprint) {
    vec3 ambient = material_pick(at.material).ambient;
#if TEXTURE_AMBIENT >= 0
    TextureSlot slot = texture_slot_pick(at.material, uint(TEXTURE_AMBIENT));
    texture_use_ambient(at.material, texture_sample(slot, at, footprint), ambient);
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
#if HAS_PROJECTIONS
    mat2x3 chart = projection_chart(projection_make(s, at), n);
    if ((s.flags & TEXTURE_SLOT_PROJECTED) != 0u) {
        at.tangent = chart[0];
        at.handed = dot(cross(n, chart[0]), chart[1]) < 0.0 ? -1.0 : 1.0;
    }
#endif
    vec3 x = at.tangent - dot(at.tangent, n) * n;
    float x2 = dot(x, x);
    x *= inversesqrt(max(x2, 1e-30));
    vec3 r = t.x * x + (at.handed * t.y) * cross(n, x) + t.z * n;
    float r2 = dot(r, r);
    return x2 > 1e-30 && r2 > 0.0 ? r * inversesqrt(r2) : n;
}

// The variance of slopes, along one axis, that the level of a normal map has lost: what it keeps in alpha, squared.
float texture_lost(TextureSlot s, vec4 texel, float strength) {
    return (s.flags & TEXTURE_SLOT_NORMALS) != 0u ? sqr(texel.a * strength) : 0.0;
}

// Bends the base's outward shading normal n; false where no map does. `lost` is what roughness takes over of its bumps.
bool texture_normal(SurfacePoint at, vec4 texels[max(TEXTURE_SURFACE_SLOTS, 1)], inout vec3 n, out float lost) {
    bool mapped = false;
    lost = 0.0;
#if TEXTURE_NORMAL >= 0
    TextureUse use = texture_use_pick(at.material, TEXTURE_NORMAL_USE);
    mapped = use.channel != TEXTURE_CHANNEL_NONE;
    TextureSlot s = texture_slot_pick(at.material, uint(TEXTURE_NORMAL));
    if (mapped) n = texture_bent(at, n, texels[TEXTURE_NORMAL], s, use.factor.x);
    if (mapped) lost = texture_lost(s, texels[TEXTURE_NORMAL], use.factor.x);
#endif
    return mapped;
}

// Bends the coat's likewise.
bool texture_coat_normal(SurfacePoint at, vec4 texels[max(TEXTURE_SURFACE_SLOTS, 1)], inout vec3 n, out float lost) {
    bool mapped = false;
    lost = 0.0;
#if TEXTURE_COAT_NORMAL >= 0
    TextureUse use = texture_use_pick(at.material, TEXTURE_COAT_NORMAL_USE);
    mapped = use.channel != TEXTURE_CHANNEL_NONE;
    TextureSlot s = texture_slot_pick(at.material, uint(TEXTURE_COAT_NORMAL));
    if (mapped) n = texture_bent(at, n, texels[TEXTURE_COAT_NORMAL], s, use.factor.x);
    if (mapped) lost = texture_lost(s, texels[TEXTURE_COAT_NORMAL], use.factor.x);
#endif
    return mapped;
}
#endif
#else
Material material_at(SurfacePoint at) { return material_pick(at.material); }
#endif
