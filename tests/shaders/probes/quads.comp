// Samples of quad 0 as it is seen from `p`, for asks[i].xy, and the density that directions towards asks[i] have.
layout(local_size_x = 64) in;
#include "layout.glsl"
#include "math/constants.glsl"
#include "math/sobol.glsl"
#include "math/sampling.glsl"
#include "shapes/shapes.glsl"
#include "lights/lights.glsl"
layout(std430, binding = SLOT_SUM) readonly buffer ask_buffer { vec4 asks[]; };
layout(std430, binding = SLOT_OUTPUT) writeonly buffer answer_buffer { vec4 answers[]; }; // direction, density
uniform vec3 p;
uniform uint sides;
uniform uint count;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    Quad q = quad_load(0u);
#if SAMPLE
    LightSample s = quad_light_sample(q, p, asks[i].xy, sides);
    answers[i] = vec4(s.wi, s.pdf);
#else
    vec3 to = q.origin + asks[i].x * q.u + asks[i].y * q.v - p;
    float t = length(to);
    answers[i] = vec4(to / t, quad_light_pdf(q, p, t, to / t, sides));
#endif
}
