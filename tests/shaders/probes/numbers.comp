// The sampler's and the warps' output for sample indices 0, 1, 2 ... of one pixel: xy in WHAT's domain.
layout(local_size_x = 64) in;
#include "layout.glsl"
#include "math/constants.glsl"
#include "math/sobol.glsl"
#include "math/sampling.glsl"
layout(std430, binding = SLOT_OUTPUT) writeonly buffer answer_buffer { vec4 answers[]; };
uniform uvec2 pixel;
uniform uint pair;
uniform uint count;
uniform uint doublings; // 2: the quarters of a quarter of the samples

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    Sampler whole = sobol_begin(pixel, i >> doublings, uniforms.replicate);
    vec2 u = sobol_pair(sobol_part(whole, i & ((1u << doublings) - 1u), doublings), pair);
    vec4 a = vec4(u, 0.0, 0.0);
#if WHAT == 1
    a.xy = sampling_disk(u);
#elif WHAT == 2
    a.xyz = sampling_cosine(u);
#elif WHAT == 3
    a.xyz = sampling_sphere(u);
#elif WHAT == 4
    a.xyz = sampling_hemisphere(u);
#elif WHAT == 5
    a.xy = sampling_triangle(u);
#elif WHAT == 6
    a.xy = sampling_filter(u);
#endif
    answers[i] = a;
}
