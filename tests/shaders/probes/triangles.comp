// Samples of triangle 0 as it is seen from `p`, for asks[i].xy, and the density that directions towards its places
// have.
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
    Triangle tri = triangle_load(0u);
#if SAMPLE
    LightSample s = triangle_light_sample(tri, p, asks[i].xy, sides);
    answers[i] = vec4(s.wi, s.pdf);
#else
    SurfacePoint at = triangle_point(tri, asks[i].xy, 0u, NONE);
    vec3 to = at.p - p;
    float t = length(to);
    answers[i] = vec4(to / t, triangle_light_pdf(tri, p, t, at.ng, to / t, sides));
#endif
}
