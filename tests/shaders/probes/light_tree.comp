// How lights are picked from a place: of the numbers asks[i].x, which light (by its `index`) and with what chance; or
// of the light i, its chance, and the least importance of the nodes on the way to it.
layout(local_size_x = 64) in;
#include "layout.glsl"
#include "math/constants.glsl"
#include "math/sobol.glsl"
#include "math/sampling.glsl"
#include "shapes/shapes.glsl"
#include "lights/lights.glsl"
layout(std430, binding = SLOT_SUM) readonly buffer ask_buffer { uvec4 asks[]; };
layout(std430, binding = SLOT_OUTPUT) writeonly buffer answer_buffer { vec4 answers[]; };
uniform vec3 p;
uniform vec3 n;
uniform uint through;
uniform uint count;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    LightContext at = LightContext(p, n, through != 0u);
#if SAMPLE
    Light l = lights_pick(asks[i].x, at);
    answers[i] = vec4(float(l.index), l.probability, 0.0, 0.0);
#else
    Light l = light_load(i);
    bool near = i < light_tree_head().w;
    LightTreeEnd end = light_tree_walk(near, true, 0u, l.alias, at);
    uint found = end.inverse > 0.0 ? i : end.found;
    float chance = light_tree_chance(end, l);
    uvec4 grid = texelFetch(light_tree_words, ivec2(1, 0), 0);
    vec3 o = (p - uintBitsToFloat(grid.xyz)) * uintBitsToFloat(grid.w);
    uint pair = 1u, depth = 0u;
    float least = near ? 3e38 : 0.0;
    bool more = near;
    do {
        uvec4 node = light_tree_fetch(2u * pair + ((l.alias >> depth) & 1u));
        if (more) {
            least = min(least, light_tree_importance(node, o, at).x);
            more = (node.w & LEAF_BIT) == 0u;
            pair = node.w & ~CLUSTER_BIT;
        }
        depth++;
    } while (more && depth < 32u);
    answers[i] = vec4(near ? float(found) : float(i), near ? l.probability + chance : l.probability, least, chance);
#endif
}
