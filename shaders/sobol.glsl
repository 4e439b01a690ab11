// Random numbers: for sample `index` of a pixel, dimension pair `pair`, two numbers in [0, 1).
//
// SAMPLER 0: pairs of the first two Sobol' dimensions, Owen-scrambled by hashing, each pair with its own
// shuffle of the sample order [Burley 2020, "Practical hash-based Owen scrambling"; hash of Vegdahl 2021].
// Both the sequence and its scramble stay (0, 2)-sequences, so every 2^k samples are stratified in every way.
// SAMPLER 1: independent numbers, for comparison.
// The pairs a path uses are fixed places (PAIR_*), so no feature shifts the numbers of another.

const uint PAIR_PIXEL = 0u;
const uint PAIR_LENS = 1u;
const uint PAIR_BOUNCE = 2u; // first pair of bounce 0
const uint PAIRS_A_BOUNCE = 4u;
const uint PAIR_CHOICE = 0u; // x: which light; y: which lobe
const uint PAIR_LIGHT = 1u;
const uint PAIR_BSDF = 2u;
const uint PAIR_ROULETTE = 3u;

struct Sampler {
    uint seed;           // of this pixel, picture and replicate
    uint index;          // of the sample
    uint index_reversed; // its bits, mirrored
};

// PCG output permutation over an LCG step [Jarzynski & Olano 2020].
uint sobol_hash(uint x) {
    uint s = x * 747796405u + 2891336453u;
    uint w = ((s >> ((s >> 28u) + 4u)) ^ s) * 277803737u;
    return (w >> 22u) ^ w;
}

// Owen scramble of a number whose bits come mirrored, least significant digit last.
uint sobol_scramble(uint x, uint seed) {
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16u) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return x;
}

// The second Sobol' dimension, mirrored: digit r is the sum of C(j, r) v_j mod 2, Pascal's triangle, in five steps
// [Ahmed 2024, "An implementation algorithm of 2D Sobol sequence fast, elegant, and compact"].
uint sobol_pascal(uint v) {
    v ^= v >> 16u;
    v ^= (v & 0xff00ff00u) >> 8u;
    v ^= (v & 0xf0f0f0f0u) >> 4u;
    v ^= (v & 0xccccccccu) >> 2u;
    v ^= (v & 0xaaaaaaaau) >> 1u;
    return v;
}

float sobol_unit(uint x) { return float(x >> 8u) * 5.9604645e-8; } // 2^-24: never rounds up to 1

// `replicate`: which of the independent scrambles; 0 is the picture's own.
Sampler sobol_begin(uvec2 pixel, uint index, uint replicate) {
    uint seed = sobol_hash(pixel.x ^ sobol_hash(pixel.y ^ sobol_hash(frame.seed ^ sobol_hash(replicate))));
    return Sampler(seed, index, bitfieldReverse(index));
}

vec2 sobol_units(uvec2 bits) { return vec2(sobol_unit(bits.x), sobol_unit(bits.y)); }

uvec2 sobol_bits(Sampler s, uint pair) {
    uint seed = sobol_hash(s.seed ^ (pair * 0x9e3779b9u));
#if SAMPLER == 0
    uint shuffled = bitfieldReverse(sobol_scramble(s.index_reversed, seed));
    uint seed_x = sobol_hash(seed ^ 0x68bc21ebu);
    uint seed_y = sobol_hash(seed ^ 0x02e5be93u);
    uint x = bitfieldReverse(sobol_scramble(shuffled, seed_x));
    uint y = bitfieldReverse(sobol_scramble(sobol_pascal(shuffled), seed_y));
#else
    uint x = sobol_hash(seed + s.index * 0x85ebca6bu);
    uint y = sobol_hash(x ^ 0x27d4eb2fu);
    x = sobol_hash(x ^ seed);
#endif
    return uvec2(x, y);
}

// The k-th of the samples, a power of two, of a sequence of as many times more, that stand for this one: as well spread
// as those. Without doublings this one itself.
Sampler sobol_part(Sampler s, uint k, uint doublings) {
    s.index = (s.index << doublings) | k;
    s.index_reversed = bitfieldReverse(s.index);
    return s;
}

vec2 sobol_pair(Sampler s, uint pair) { return sobol_units(sobol_bits(s, pair)); }
