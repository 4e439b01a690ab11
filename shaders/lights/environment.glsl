// Light from infinity. An image is in latitude and longitude. It is sampled by cells of equal chance, each of which
// names a block of texels (gpu/tables/environment_cells.py); inside a block the direction is uniform in longitude and
// in the cosine of its colatitude, and its density is constant.

#if HAS_ENVIRONMENT
vec3 environment_turn(vec3 d) { // world to image: undo the rotation about +Y
    vec2 cs = uniforms.environment_turn;
    return vec3(cs.x * d.x - cs.y * d.z, d.y, cs.y * d.x + cs.x * d.z);
}

vec3 environment_turn_back(vec3 d) {
    vec2 cs = uniforms.environment_turn;
    return vec3(cs.x * d.x + cs.y * d.z, d.y, -cs.y * d.x + cs.x * d.z);
}

#if HAS_ENVIRONMENT_IMAGE
vec4 environment_image(vec3 d) {
    ivec2 size = textureSize(environment_texels, 0);
    float azimuth = d.x == 0.0 && d.z == 0.0 ? 0.0 : atan(d.x, -d.z);
    float polar = atan(length(d.xz), d.y); // exact near the poles, where acos(y) is not
    vec2 xy = vec2(0.5 + azimuth * (0.5 * INV_PI), polar * INV_PI) * vec2(size);
    ivec2 at = min(ivec2(xy), size - 1);
    vec2 c = floor(xy - 0.5);
    vec2 f = xy - 0.5 - c;
    int x0 = int(c.x) < 0 ? size.x - 1 : int(c.x);
    int x1 = x0 + 1 == size.x ? 0 : x0 + 1;
    int y0 = max(int(c.y), 0), y1 = min(int(c.y) + 1, size.y - 1);
    vec4 a = texelFetch(environment_texels, ivec2(x0, y0), 0), b = texelFetch(environment_texels, ivec2(x1, y0), 0);
    vec4 e = texelFetch(environment_texels, ivec2(x0, y1), 0), g = texelFetch(environment_texels, ivec2(x1, y1), 0);
    vec3 radiance = mix(mix(a.rgb, b.rgb, f.x), mix(e.rgb, g.rgb, f.x), f.y);
    return vec4(radiance, at.y == y0 ? (at.x == x0 ? a.a : b.a) : (at.x == x0 ? e.a : g.a));
}
#endif

// The radiance from the world direction w, with the sun's or without, and the density with which
// environment_light_sample gives it.
vec4 environment_radiance(vec3 w, bool sun) {
    vec3 d = environment_turn(w);
#if HAS_ENVIRONMENT_IMAGE
    vec4 l = environment_image(d);
#else
    vec4 l = texelFetch(environment_texels, ivec2(0), 0);
#endif
#if HAS_ENVIRONMENT_CUBE
    vec4 cube = cubemap_radiance(d);
    if (uniforms.environment_cube != 0u) l = cube;
#endif
#if HAS_SUN
    bool sunny = sun_holds(d);
    if (sun && sunny && d.y > 0.0) l.rgb += uniforms.environment_sun_radiance;
    l.a = mix(l.a, sunny ? 1.0 / (TWO_PI * uniforms.environment_sun_cap) : 0.0, uniforms.environment_sun_share);
#endif
    return vec4(l.rgb * uniforms.environment_scale, l.a);
}

// Whether the environment differs between directions.
bool environment_varies() { return textureSize(environment_texels, 0).x > 1; }

LightSample environment_light_sample(uvec2 bits) {
    vec2 u = sobol_units(bits);
#if HAS_SUN
    uint cut = uint(uniforms.environment_sun_share * 4294967296.0);
    bool sunny = bits.x < cut;
    vec3 to_sun = sun_sample(vec2(float(bits.x) / max(float(cut), 1.0), u.y));
    bits.x = sunny ? bits.x : sun_rest(bits.x, cut);
    u.x = sobol_unit(bits.x);
#endif
#if HAS_ENVIRONMENT_IMAGE || HAS_ENVIRONMENT_CUBE
    uvec2 size = uvec2(textureSize(environment_texels, 0));
    // All 32 bits count: the 24 of a float would leave a large map three bits for the place inside the block.
    uint i, low;
    umulExtended(bits.x, uint(environment_cell_words.length()), i, low);
    EnvironmentCell e = environment_cell_load(i);
    vec2 corner = vec2(e.corner & 0xffffu, e.corner >> 16u), block = vec2(e.size & 0xffffu, e.size >> 16u);
    // The rest of the first number is uniform again and places the direction inside the block.
    float v = (float(i - e.first) + sobol_unit(low)) / float(e.count);
#endif
#if HAS_ENVIRONMENT_IMAGE
    float phi = (corner.x + block.x * u.y) / float(size.x) * TWO_PI - PI;
    // The block lies between two colatitudes and is uniform in the cosine, written in sines, which do not cancel at a
    // pole.
    float top = corner.y / float(size.y) * PI, bottom = (corner.y + block.y) / float(size.y) * PI;
    float s0 = sqr(sin(0.5 * top)), s1 = sqr(sin(0.5 * bottom));
    float h = mix(s0, s1, v); // sin^2 of half the colatitude
#else
    float phi = TWO_PI * u.y - PI, h = u.x; // as an image of one texel
#endif
    float y = 1.0 - 2.0 * h, r = 2.0 * sqrt(max(0.0, h * (1.0 - h)));
    vec3 d = vec3(r * sin(phi), y, -r * cos(phi));
#if HAS_ENVIRONMENT_CUBE
    if (uniforms.environment_cube != 0u) d = cubemap_point(corner, block * vec2(u.y, v));
#endif
#if HAS_SUN
    if (sunny) d = to_sun;
#endif
    vec3 wi = environment_turn_back(d);
    vec4 l = environment_radiance(wi, true);
    return LightSample(wi, INFINITY_T, l.rgb, l.a, true, NONE);
}
#endif

void environment_light_sample_case(Light l, uvec2 bits, inout LightSample s) {
#if HAS_ENVIRONMENT
    if (l.kind == LIGHT_ENVIRONMENT) s = environment_light_sample(bits);
#endif
}
