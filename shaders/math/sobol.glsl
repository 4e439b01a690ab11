// Random numbers: sample `index` of a pixel has two numbers in [0, 1) for each dimension pair `pair`.
//
// SAMPLER 0: pairs of the first two Sobol' dimensions, Owen-scrambled by hashing, each pair with its own
// shuffle of the sample order [Burley 2020, "Practical hash-based Owen scrambling"; hash of Vegdahl 2021].
// Both the sequence and its scramble stay (0, 2)-sequences, so every 2^k samples are stratified in every way.
// SAMPLER 1: independent numbers, for comparison.
//
// The errors of neighbours shall cancel (blue noise), as an eye or a filter sees the mean of several pixels. A block of
// 4 x 4 pixels shares its scrambles, and each of its pixels shifts the digits before they are scrambled. For the pixel
// itself that is one more scramble, as good as any other, at any number of samples; between pixels it decides whose
// points fall into whose gaps. ADAPTIVE goes without, as its unbiased counts need rows that are independent.
// The pairs a path uses are fixed places (PAIR_*), so no feature shifts the numbers of another.

const uint PAIR_PIXEL = 0u;
const uint PAIR_LENS = 1u;
const uint PAIR_BOUNCE = 2u; // first pair of bounce 0
const uint PAIRS_A_BOUNCE = 4u;
const uint PAIR_CHOICE = 0u; // x: which light; y: which lobe
const uint PAIR_LIGHT = 1u;
const uint PAIR_BSDF = 2u;
const uint PAIR_ROULETTE = 3u;

// The first pair of a bounce.
uint sobol_bounce_pair(uint bounce) { return PAIR_BOUNCE + bounce * PAIRS_A_BOUNCE; }

struct Sampler {
    uint seed;           // of this pixel or block, picture and replicate
    uint index;          // of the sample
    uint index_reversed; // its bits, mirrored
#if !ADAPTIVE
    uvec2 shift; // of the digits of x and y, mirrored
    uint quad;   // twice the place, in the block, of this pixel's 2 x 2
#endif
};

// PCG output permutation over an LCG step [Jarzynski & Olano 2020].
uint sobol_hash(uint x) {
    uint s = x * 747796405u + 2891336453u;
    uint w = ((s >> ((s >> 28u) + 4u)) ^ s) * 277803737u;
    return (w >> 22u) ^ w;
}

// The Owen scramble of a number whose bits come mirrored, least significant digit last.
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

#if !ADAPTIVE
// Shifts of the first eight digits of x and y by the bits of a pixel's place: its column and row in its square of 2 x
// 2, and those of the square in the block. They were found by a search among 2^64: they leave the least error of steps,
// ramps and blobs on the square after blurring, at 1, 2, 4, ... 256 samples: a half after a blur of one pixel, a third
// after one of two.
const uvec2 SOBOL_COLUMN = uvec2(0xadu, 0xb6u), SOBOL_ROW = uvec2(0xf6u, 0x6du);
const uvec2 SOBOL_QUAD_COLUMN = uvec2(0xbcu, 0xa2u), SOBOL_QUAD_ROW = uvec2(0x05u, 0xc5u);

// The shift by two bits.
uvec2 sobol_apart(uint bits, uvec2 column, uvec2 row) { return (-(bits & 1u) & column) ^ (-(bits >> 1u & 1u) & row); }

// One of four places: the first stays and the others rotate, else all places above each other would err alike.
uint sobol_place(uint place, uint turn) { return place == 0u ? 0u : (place - 1u + (turn & 7u)) % 3u + 1u; }
#endif

uint sobol_seed(uvec2 at, uint replicate) {
    return sobol_hash(at.x ^ sobol_hash(at.y ^ sobol_hash(uniforms.seed ^ sobol_hash(replicate))));
}

// `replicate` names one of the independent scrambles; 0 is the picture's own.
Sampler sobol_begin(uvec2 pixel, uint index, uint replicate) {
    uint own = sobol_seed(pixel, replicate);
#if !ADAPTIVE
    uint in_quad = (pixel.x & 1u) | (pixel.y & 1u) << 1u, quad = (pixel.x >> 1u & 1u) | (pixel.y & 2u);
    uint block = sobol_seed(pixel >> 2u, 0x9e3779b9u);
    uvec2 apart = sobol_apart(sobol_place(in_quad, block >> 3u * quad), SOBOL_COLUMN, SOBOL_ROW)
        ^ sobol_apart(sobol_place(quad, block >> 12u), SOBOL_QUAD_COLUMN, SOBOL_QUAD_ROW);
    // Beyond these eight digits each pixel has its own.
    uvec2 shift = apart | uvec2(own, sobol_hash(own ^ 0x5bd1e995u)) << 8u;
    return Sampler(SAMPLER == 0 && replicate == 0u ? block : own, index, bitfieldReverse(index), shift, 2u * quad);
#else
    return Sampler(own, index, bitfieldReverse(index));
#endif
}

vec2 sobol_units(uvec2 bits) { return vec2(sobol_unit(bits.x), sobol_unit(bits.y)); }

uvec2 sobol_bits(Sampler s, uint pair) {
    uint seed = sobol_hash(s.seed ^ (pair * 0x9e3779b9u));
    if (SAMPLER == 1) {
        uint first = sobol_hash(seed + s.index * 0x85ebca6bu);
        return uvec2(sobol_hash(first ^ seed), sobol_hash(first ^ 0x27d4eb2fu));
    }
    uint shuffled = bitfieldReverse(sobol_scramble(s.index_reversed, seed));
    uint seed_x = sobol_hash(seed ^ 0x68bc21ebu);
    uint seed_y = sobol_hash(seed ^ 0x02e5be93u);
    uvec2 digits = uvec2(shuffled, sobol_pascal(shuffled));
#if !ADAPTIVE
    // The four squares of a block change places from pair to pair: where an error depends on two pairs, points that lie
    // apart in both alike would do the same twice.
    digits ^= s.shift ^ sobol_apart(seed >> s.quad, SOBOL_COLUMN, SOBOL_ROW);
#endif
    uint x = bitfieldReverse(sobol_scramble(digits.x, seed_x));
    uint y = bitfieldReverse(sobol_scramble(digits.y, seed_y));
    return uvec2(x, y);
}

// The k-th of the 2^doublings samples that replace this one, in a sequence that is as many times longer and as well
// distributed. Without doublings it is this sample itself.
Sampler sobol_part(Sampler s, uint k, uint doublings) {
    s.index = (s.index << doublings) | k;
    s.index_reversed = bitfieldReverse(s.index);
    return s;
}

vec2 sobol_pair(Sampler s, uint pair) { return sobol_units(sobol_bits(s, pair)); }
