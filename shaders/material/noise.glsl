// Gradient noise [Perlin 2002, "Improving noise"] in three dimensions, and sums of its octaves. Its cells are hashed as
// whole numbers of 32 bits, so that the pattern is the same on every device.
#if HAS_NOISES
// The period along each axis, in cells: a power of two, so that folding a cell into it rounds nothing, and so large that
// a float32 has three bits left inside a cell where the pattern repeats.
const float NOISE_PERIOD = 1048576.0;

// A turn by a quaternion of the whole numbers 4, 1, 2, 3: no axis or plane of a shape lies along the cells, nor those
// of an octave along those of the next one, which would show as a grid.
const mat3 NOISE_TURN = mat3(4.0, 28.0, -10.0, -20.0, 10.0, 20.0, 22.0, 4.0, 20.0) / 30.0;
// How the cells of the octaves lie beside each other, in cells: noise is 0 at all corners of its cells, which must not
// meet at the origin.
const vec3 NOISE_SHIFT = vec3(0.19, 0.47, 0.73);

// Mixes bits so that each depends on each ("lowbias32" of Wellons' search for such functions, 2018).
uint noise_hash(uint x) {
    x = (x ^ (x >> 16)) * 0x7feb352du;
    x = (x ^ (x >> 15)) * 0x846ca68bu;
    return x ^ (x >> 16);
}

// The product of one of twelve gradients, towards the edges of a cube, with the way from its corner.
float noise_slope(uint hash, vec3 t) {
    uint h = hash >> 28;
    float u = h < 8u ? t.x : t.y, v = h < 4u ? t.y : h == 12u || h == 14u ? t.x : t.z;
    return ((h & 1u) == 0u ? u : -u) + ((h & 2u) == 0u ? v : -v);
}

// One octave: continuous with its first two derivatives, within -1.04 .. 1.04.
float noise_octave(vec3 p, uint seed) {
    vec3 low = floor(p), t = p - low;
    uvec3 a = uvec3(low - NOISE_PERIOD * floor(low / NOISE_PERIOD)), b = (a + 1u) & (uint(NOISE_PERIOD) - 1u);
    uint x0 = noise_hash(a.x ^ seed), x1 = noise_hash(b.x ^ seed);
    uint x0y0 = noise_hash(x0 + a.y), x0y1 = noise_hash(x0 + b.y);
    uint x1y0 = noise_hash(x1 + a.y), x1y1 = noise_hash(x1 + b.y);
    vec3 s = t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    vec4 near = vec4(noise_slope(noise_hash(x0y0 + a.z), t), noise_slope(noise_hash(x1y0 + a.z), t - vec3(1, 0, 0)),
                     noise_slope(noise_hash(x0y1 + a.z), t - vec3(0, 1, 0)),
                     noise_slope(noise_hash(x1y1 + a.z), t - vec3(1, 1, 0)));
    vec4 far = vec4(noise_slope(noise_hash(x0y0 + b.z), t - vec3(0, 0, 1)),
                    noise_slope(noise_hash(x1y0 + b.z), t - vec3(1, 0, 1)),
                    noise_slope(noise_hash(x0y1 + b.z), t - vec3(0, 1, 1)),
                    noise_slope(noise_hash(x1y1 + b.z), t - vec3(1, 1, 1)));
    vec4 face = mix(near, far, s.z);
    vec2 edge = mix(face.xz, face.yw, s.x);
    return mix(edge.x, edge.y, s.y);
}

// The octaves' sum, each times gain^i; with `turbulence` that of their absolute values.
float noise_sum(vec3 p, TextureRecipe r, bool turbulence) {
    float sum = 0.0, weight = 1.0;
    uint i = 0u;
    do {
        p = NOISE_TURN * p + NOISE_SHIFT;
        float n = noise_octave(p, noise_hash(r.seed + i));
        sum += weight * (turbulence ? abs(n) : n);
        weight *= r.gain;
        p *= r.lacunarity;
    } while (++i < r.octaves);
    return sum;
}
#endif
