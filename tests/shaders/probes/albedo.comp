// Directional albedo of material i seen from asks[i] = (cosine, azimuth, from inside?, 0): mean and mean square of the
// largest channel's weight over `samples`, and whether all was finite. Transmitted light as basic radiance.
layout(local_size_x = 64) in;
#include "layout.glsl"
#include "math/constants.glsl"
#include "math/sobol.glsl"
#include "math/sampling.glsl"
#include "bsdf/bsdf.glsl"
layout(std430, binding = SLOT_SUM) readonly buffer ask_buffer { vec4 asks[]; };
layout(std430, binding = SLOT_OUTPUT) writeonly buffer answer_buffer { vec4 answers[]; };
uniform uint count;
uniform uint samples;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    vec4 ask = asks[i];
    Surface s = surface_make(material_load(i), normalize(vec2(0.8, 0.6)));
    float r = sqrt(max(0.0, 1.0 - ask.x * ask.x));
    vec3 wo = vec3(r * cos(ask.y), r * sin(ask.y), ask.x);
    models_face(wo, ask.z > 0.5, s);
    vec3 sum = vec3(0.0), squares = vec3(0.0);
    bool finite = true;
    uint k = 0u;
    do {
        Sampler rng = sobol_begin(uvec2(i, 7u), k, 0u);
        LobeSample lobe = bsdf_sample(s, wo, sobol_pair(rng, 0u).x, sobol_pair(rng, 1u));
        Scatter f = bsdf_eval(s, wo, lobe.wi);
        if (lobe.is_delta) f = lobe.scatter;
        vec3 w = f.pdf > 0.0 ? f.f / f.pdf : vec3(0.0);
        finite = finite && !any(isnan(w)) && !any(isinf(w)) && !isnan(f.pdf) && min(w.x, min(w.y, w.z)) >= 0.0;
        sum += w;
        squares += w * w;
    } while (++k < samples);
    float n = float(samples);
    uint c = sum.y > sum.x ? 1u : 0u;
    c = sum.z > sum[c] ? 2u : c;
    answers[i] = vec4(sum[c] / n, squares[c] / n, finite ? 1.0 : 0.0, 0.0);
}
