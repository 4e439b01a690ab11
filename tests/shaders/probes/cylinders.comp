// Samples of cylinder 0 as it is seen from `p`, for asks[i].xy, and the density that directions to the place asks[i] of
// its side have: its part of a turn, and its height from -1 to 1.
layout(local_size_x = 64) in;
#include "layout.glsl"
#include "math/constants.glsl"
#include "math/sobol.glsl"
#include "math/sampling.glsl"
#include "shapes/shapes.glsl"
#include "lights/lights.glsl"
layout(std430, binding = SLOT_SUM) readonly buffer ask_buffer { vec4 asks[]; };
layout(std430, binding = SLOT_OUTPUT) writeonly buffer answer_buffer { vec4 answers[]; }; // direction, density
layout(std430, binding = SLOT_ALBEDO) writeonly buffer share_buffer { vec4 shares[]; };   // distance, share
uniform vec3 p;
uniform uint sides;
uniform float transparency;
uniform uint count;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    Solid c = box_load(0u);
#if SAMPLE
    LightSample s = cylinder_light_sample(c, p, asks[i].xy, sides, transparency);
    answers[i] = vec4(s.wi, s.pdf);
    shares[i] = vec4(s.t, s.radiance);
#else
    vec3 n = vec3(sin(TWO_PI * asks[i].x), 0.0, cos(TWO_PI * asks[i].x));
    SurfacePoint at = solid_point(c, vec3(n.x, asks[i].y, n.z), n);
    vec3 to = at.p - p;
    float t = length(to);
    answers[i] = vec4(to / t, cylinder_light_pdf(c, p, at, to / t, sides, transparency));
    shares[i] = vec4(t, 0.0, 0.0, 0.0);
#endif
}
