// What shines from a direction (asks[i].xyz), or with SAMPLE a pick by two words of random bits.
layout(local_size_x = 64) in;
#include "layout.glsl"
#include "math/constants.glsl"
#include "math/sobol.glsl"
#include "math/sampling.glsl"
#include "shapes/shapes.glsl"
#include "lights/lights.glsl"
layout(std430, binding = SLOT_SUM) readonly buffer ask_buffer { vec4 asks[]; };
layout(std430, binding = SLOT_MOMENTS) writeonly buffer answer_buffer { vec4 answers[]; };
layout(std430, binding = SLOT_OUTPUT) writeonly buffer direction_buffer { vec4 directions[]; };
uniform uint count;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    vec4 ask = asks[i];
#if SAMPLE
    LightSample s = environment_light_sample(floatBitsToUint(ask.xy));
    answers[i] = vec4(s.radiance, s.pdf);
    directions[i] = vec4(s.wi, 0.0);
#else
    answers[i] = environment_radiance(ask.xyz, true);
    directions[i] = ask;
#endif
}
