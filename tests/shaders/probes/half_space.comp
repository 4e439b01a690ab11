// The albedo of single scattering of half spaces with the colour asks[i].rgb, for the mean cosine g.
layout(local_size_x = 64) in;
#include "layout.glsl"
#include "path/half_space.glsl"
layout(std430, binding = SLOT_SUM) readonly buffer ask_buffer { vec4 asks[]; };
layout(std430, binding = SLOT_OUTPUT) writeonly buffer answer_buffer { vec4 answers[]; };
uniform float g;
uniform uint count;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    answers[i] = vec4(half_space_albedo(asks[i].rgb, g), 0.0);
}
