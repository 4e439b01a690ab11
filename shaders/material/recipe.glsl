// Texels that are computed: noise, and ramps over it, over a coordinate or over the texel of an image or a checker.
#include "material/noise.glsl"
#include "material/projection.glsl"

#if HAS_NOISES || HAS_RAMPS
#if HAS_NOISES
// Where the noise is read: in the shape's own space, or at its texture coordinates.
vec3 recipe_place(TextureSlot s, SurfacePoint at, vec2 uv) {
    vec3 p = vec3(uv, 0.0);
#if HAS_SOLID_TEXTURES
    vec3 q = space_place(space_of(at), at.p);
    if ((s.flags & TEXTURE_SLOT_SOLID) != 0u) p = q;
#endif
    return p;
}

vec3 recipe_noise(TextureSlot s, TextureRecipe r, vec3 p) {
    bool turbulence = (s.flags & TEXTURE_SLOT_TURBULENCE) != 0u;
    float n = r.amplitude * noise_sum(p * r.scale + r.offset, r, turbulence);
    return mix(s.color_a, s.color_b, clamp(turbulence ? n : 0.5 + 0.5 * n, 0.0, 1.0));
}
#endif

#if HAS_RAMPS
// The ramp's colour at t: each stop that t has passed takes the place of those before it.
vec3 recipe_ramp(TextureSlot s, uint material, uint k, float t) {
    float folded = t - 2.0 * floor(0.5 * t);
    if ((s.flags & TEXTURE_SLOT_RAMP_REPEAT) != 0u) t = fract(t);
    if ((s.flags & TEXTURE_SLOT_RAMP_MIRROR) != 0u) t = min(folded, 2.0 - folded);
    vec4 last = texture_stop_load(material, k, 0u);
    vec3 color = last.yzw;
    for (uint i = 1u; i < uint(TEXTURE_STOPS); i++) {
        vec4 stop = texture_stop_load(material, k, i);
        float width = stop.x - last.x, passed = t < stop.x ? 0.0 : 1.0;
        float w = width > 0.0 ? clamp((t - last.x) / width, 0.0, 1.0) : passed;
        if ((s.flags & TEXTURE_SLOT_RAMP_SMOOTH) != 0u) w = w * w * (3.0 - 2.0 * w);
        if ((s.flags & TEXTURE_SLOT_RAMP_CONSTANT) != 0u) w = passed;
        color = mix(color, stop.yzw, w);
        last = stop;
    }
    return color;
}
#endif

// The texel of a slot at its coordinates uv; `c` is that of its image or checker, where it has one.
vec4 recipe_texel(TextureSlot s, SurfacePoint at, vec2 uv, vec4 c) {
    uint k = s.flags >> TEXTURE_SLOT_NUMBER_SHIFT;
    TextureRecipe r = texture_recipe_load(at.material, k);
#if HAS_NOISES
    if ((s.flags & TEXTURE_SLOT_NOISE) != 0u) c = vec4(recipe_noise(s, r, recipe_place(s, at, uv)), 1.0);
#endif
#if HAS_RAMPS
    if ((s.flags & TEXTURE_SLOT_COORDINATES) != 0u) c = vec4(uv, 0.0, 1.0);
    vec3 ramp = recipe_ramp(s, at.material, k, dot(c, r.ramp_reads) + r.ramp_offset);
    if ((s.flags & TEXTURE_SLOT_RAMP) != 0u) c = vec4(ramp, 1.0);
#endif
    return c;
}
#endif
