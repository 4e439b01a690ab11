// Entry: f, without the cosine of wi, and the density of wi, for pairs of a wo and a wi, both in the frame of
// bsdf/bsdf_alone.glsl; and what is perfectly specular as seen from each wo.
#include "layout.glsl"
layout(local_size_x = BSDF_GROUP) in;
#include "math/constants.glsl"
#include "math/sobol.glsl"
#include "math/sampling.glsl"
#include "bsdf/bsdf.glsl"
#include "bsdf/bsdf_alone.glsl"
layout(std430, binding = SLOT_SUM) readonly buffer direction_buffer { vec4 directions[]; }; // every wo, then every wi
layout(std430, binding = SLOT_OUTPUT) writeonly buffer value_buffer { vec4 values[]; };     // f and its density
layout(std430, binding = SLOT_MOMENTS) writeonly buffer delta_buffer { vec4 deltas[]; };    // wi and chance; weight
uniform uint first; // of the pairs to evaluate
uniform uint count;
uniform uint wo_count;
uniform uint wi_count; // of each wo
uniform uint wi_step;  // 0: every wo has the same ones; 1: the first is as far along as its wo

void main() {
    if (gl_GlobalInvocationID.x >= count) return;
    uint pair = first + gl_GlobalInvocationID.x;
    uint row = pair / wi_count, column = pair - row * wi_count;
    vec3 wo = directions[row].xyz, wi = directions[wo_count + row * wi_step + column].xyz;
    BsdfAlone alone = bsdf_alone_make(wo);
    wo = bsdf_alone_turn(alone, wo);
    Scatter value = bsdf_eval(alone.s, wo, bsdf_alone_turn(alone, wi));
    if (!alone.visible || wi.z == 0.0) value = Scatter(vec3(0.0), 0.0);
    else value.f /= abs(wi.z);
    values[pair] = vec4(value.f, value.pdf);
    LobeSample specular[BSDF_DELTAS];
    bsdf_deltas(alone.s, wo, specular);
    if (column == 0u) {
        for (int k = 0; k < BSDF_DELTAS; k++) {
            uint at = 2u * (row * uint(BSDF_DELTAS) + uint(k));
            deltas[at] = vec4(bsdf_alone_turn(alone, specular[k].wi), alone.visible ? specular[k].scatter.pdf : 0.0);
            deltas[at + 1u] = vec4(specular[k].scatter.f, 0.0);
        }
    }
}
