// Along (0, 0, 1) from the origin, for t metres at most: the distance that asks[i].x draws, or asks[i].y where that is not
// negative, with its density, and the chance of drawing one.
layout(local_size_x = 64) in;
#include "layout.glsl"
#include "math/constants.glsl"
#include "path/equiangular.glsl"
layout(std430, binding = SLOT_SUM) readonly buffer ask_buffer { vec4 asks[]; };
layout(std430, binding = SLOT_OUTPUT) writeonly buffer answer_buffer { vec4 answers[]; };
uniform float t;
uniform float rate;
uniform uint count;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    Equiangular e = equiangular_make(vec3(0.0), vec3(0.0, 0.0, 1.0), t, rate);
    float chance = equiangular_chance(e);
    float drawn = asks[i].y >= 0.0 ? asks[i].y : equiangular_sample(e, asks[i].x * chance);
    answers[i] = vec4(drawn, equiangular_pdf(e, drawn), chance, e.far);
}
