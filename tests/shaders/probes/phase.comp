// A direction of the phase function with mean cosine g for asks[i].xy, where z is wo, and its value there.
layout(local_size_x = 64) in;
#include "layout.glsl"
#include "math/constants.glsl"
#include "math/sobol.glsl"
#include "math/sampling.glsl"
#include "bsdf/bsdf.glsl"
layout(std430, binding = SLOT_SUM) readonly buffer ask_buffer { vec4 asks[]; };
layout(std430, binding = SLOT_OUTPUT) writeonly buffer answer_buffer { vec4 answers[]; };
uniform float g;
uniform uint count;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    vec3 wi = phase_sample(g, asks[i].xy);
    answers[i] = vec4(wi, phase_eval(g, vec3(0.0, 0.0, 1.0), wi).pdf);
}
