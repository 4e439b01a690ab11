// Picks one of many bounded lights by a walk down a binary tree. At each pair of nodes the probabilities follow bounds
// on the contribution of either's lights at the shaded point [Conty Estevez & Kulla 2018; Pharr, Jakob, Humphreys 2023,
// section 12.6.3]. gpu/accel/light_tree.py makes the tree.

// A point for which lights are sampled.
struct LightContext {
    vec3 p;
    vec3 n;       // its normal, unit: light from behind it does not count ...
    bool through; // ... unless the surface transmits
};

#if HAS_LIGHT_TREE
layout(binding = LIGHT_TREE_TEXTURE) uniform usampler2D light_tree_words;

uvec4 light_tree_fetch(uint i) {
    return texelFetch(light_tree_words, ivec2(i & (LIGHT_TREE_ROW - 1u), i / LIGHT_TREE_ROW), 0);
}

uvec4 light_tree_head() { return texelFetch(light_tree_words, ivec2(0), 0); }

vec3 light_tree_axis(uint bits) {
    return basis_octahedral(vec2(bits & 0xffu, (bits >> 8u) & 0xffu) * (1.0 / 127.0) - 1.0);
}

float light_tree_intensity(uvec4 node) { return uintBitsToFloat(((node.z >> 21u) << 19u) + (40u << 23u)); }

// The square of a cluster's distance, in radii of its ball, beyond which its lights matter by intensity alone.
// A thousand lamps over a floor take three quarters of the time then, for 5 % more error at equal samples.
const float LIGHT_TREE_FAR = 6.0;
// The least number of codes that lead to a cluster at which a walk may end: with fewer, its lights would not get their
// shares of them.
const int LIGHT_TREE_LEAST = 1 << 20;

// x follows the contribution of a node's lights times y, the square of their distance; z is positive where they are far.
// p is on the tree's grid. The cosine of an angle a less another one b is taken as cos a + sin b, at most 1, which
// needs no square root of a's: for b up to a right angle it is positive wherever cos(a - b) is, so that no light that
// gives anything has the chance 0. At equal samples a thousand lamps err as with the true cosines.
vec3 light_tree_importance(uvec4 node, vec3 p, LightContext context) {
    vec3 to = vec3(node.x & 0xffffu, node.x >> 16u, node.y & 0xffffu) - p;
    float radius = uintBitsToFloat(((node.y & 0xff0000u) << 4u) + (123u << 23u));
    float d2 = dot(to, to), r2 = radius * radius;
    float inv = inversesqrt(max(d2, 1e-30)), sin_ball = min(radius * inv, 1.0); // of the angle that the ball fills
    float cos_in = dot(to, context.n) * inv;
#if HAS_TRANSMISSION
    if (context.through) cos_in = abs(cos_in);
#endif
    cos_in = clamp(cos_in + sin_ball, 0.0, 1.0);
#if ANY_AIMED_LIGHTS
    float half_sine = float(node.y >> 24u) * (1.0 / 255.0);
    float cos_cone = 1.0 - 2.0 * half_sine * half_sine;
    float sin_cone = cos_cone <= 0.0 ? 1.0 : sqrt(max(0.0, 1.0 - cos_cone * cos_cone));
    float cos_out = -dot(to, light_tree_axis(node.z)) * inv;
    cos_out = cos_cone <= 0.0 ? 1.0 : min(cos_out + sin_cone + sin_ball, 1.0);
    float edge = float((node.z >> 16u) & 31u) * (1.0 / 31.0);
    if (cos_out < 1.0 - edge * edge) cos_out = 0.0;
#else
    float cos_out = 1.0; // all lights shine in all directions
#endif
    float share = d2 <= r2 ? 1.0 : max(cos_in, 0.0) * max(cos_out, 0.0);
    return vec3(light_tree_intensity(node) * share, max(d2, r2), d2 - LIGHT_TREE_FAR * r2);
}

// Where a walk down the tree has ended.
struct LightTreeEnd {
    uint found;    // the light
    float chance;  // of coming to that node
    float inverse; // of the intensity of a cluster's lights; 0: the node is the light itself
};

// Draws one of a cluster's lights by a number 0 .. 1.
void light_tree_draw(float u, inout LightTreeEnd end) {
    uvec4 cluster = light_tree_fetch(2u * light_tree_head().w + end.found);
    float x = u * float(cluster.y);
    uint i = min(uint(x), cluster.y - 1u);
    uvec4 entry = light_tree_fetch(cluster.x + i);
    end.found = x - float(i) >= uintBitsToFloat(entry.z) ? entry.y : entry.x;
    end.inverse = uintBitsToFloat(cluster.z);
}

// Goes down the tree to a light: to the one that `code` leads to, or with `trailed` to the one that the turns in
// `trail` lead to. `near` is false where the light is not in the tree. The codes of a node are an interval, which its
// children share out. A walk ends at a cluster that is far.
LightTreeEnd light_tree_walk(bool near, bool trailed, uint code, uint trail, LightContext context) {
    uvec4 head = light_tree_head(), grid = texelFetch(light_tree_words, ivec2(1, 0), 0);
    vec3 p = (context.p - uintBitsToFloat(grid.xyz)) * uintBitsToFloat(grid.w);
    int rest = int(code) - int(head.y), width = int(head.x - head.y);
    uint pair = 1u, depth = 0u;
    bool more = near, far = false;
    do {
        uvec4 a = light_tree_fetch(2u * pair), b = light_tree_fetch(2u * pair + 1u);
        vec3 x = light_tree_importance(a, p, context), y = light_tree_importance(b, p, context);
        float first = x.x * y.y, second = y.x * x.y; // gpu/accel/light_tree.py keeps them inside float32
        // Neither bound says that light arrives, though that of the parent did: the chances follow intensity alone.
        bool lost = !(first + second > 0.0);
        if (lost) {
            first = light_tree_intensity(a);
            second = light_tree_intensity(b);
        }
        int cut = int(float(width) * (first / (first + second)));
        cut = max(min(max(cut, 1), width - 1), 0); // both stay possible
        bool right = trailed ? ((trail >> depth) & 1u) != 0u : rest >= cut;
        if (more) {
            uint link = right ? b.w : a.w;
            rest -= right ? cut : 0;
            width = right ? width - cut : cut;
            far = (link & (LEAF_BIT | CLUSTER_BIT)) == CLUSTER_BIT && (right ? y.z : x.z) > 0.0
                && width >= LIGHT_TREE_LEAST;
            more = (link & LEAF_BIT) == 0u && !far;
            pair = link & ~(LEAF_BIT | CLUSTER_BIT); // or the light
        }
        depth++;
    } while (more && depth < 32u);
    LightTreeEnd end = LightTreeEnd(near ? pair : 0u, float(width) * (1.0 / float(LIGHT_CODES)), 0.0);
    if (far) light_tree_draw(trailed ? 0.0 : float(rest) / float(width), end);
    return end;
}

// The chance of picking the light l by a walk that ends there.
float light_tree_chance(LightTreeEnd end, Light l) {
    return end.chance * (end.inverse > 0.0 ? l.threshold * end.inverse : 1.0);
}

// Picks a light by all 32 bits, as one among many has a chance too small for the 24 bits of a float. Some codes lead
// down the tree, the others to the alias table of the lights that are outside it.
Light light_tree_pick(uint bits, LightContext context) {
    uvec4 head = light_tree_head();
    uint code = bits >> 2u, far = uniforms.light_count - head.w;
    bool near = code < head.x, even = code < head.y;
    float x = float(code - head.x) * (float(far) / float(max(LIGHT_CODES - head.x, 1u)));
    uint i = head.w + min(uint(x), far - 1u), first = near ? (even ? code >> head.z : 0u) : i;
    Light drawn = light_pick(first);
    LightTreeEnd end = light_tree_walk(near, even, code, drawn.alias, context);
    uint other = fract(x) >= drawn.threshold ? drawn.alias : i;
    Light l = light_pick(near ? (even ? first : end.found) : other);
    if (near) l.probability += light_tree_chance(end, l);
    return l;
}
#endif

// Adds the chance of picking the light l, which has that number, by a walk down the tree.
void light_tree_add_chance(uint light, LightContext context, inout Light l) {
#if HAS_LIGHT_TREE
    bool near = light != NONE && light_tree_head().x > 0u;
    l.probability += light_tree_chance(light_tree_walk(near, true, 0u, l.alias, context), l);
#endif
}
