// Evaluates or samples the BSDF of material 0: asks[i] is wi, or (u_lobe, u, u) with SAMPLE 1; behind `count` of them
// stand the wo, one each or one for all. With INSIDE, wo is inside the body. Perfectly specular samples have
// directions[i].w = 1.
layout(local_size_x = 64) in;
#include "layout.glsl"
#include "math/constants.glsl"
#include "math/sobol.glsl"
#include "math/sampling.glsl"
#include "bsdf/bsdf.glsl"
layout(std430, binding = SLOT_SUM) readonly buffer ask_buffer { vec4 asks[]; };
layout(std430, binding = SLOT_MOMENTS) writeonly buffer answer_buffer { vec4 answers[]; };
layout(std430, binding = SLOT_OUTPUT) writeonly buffer direction_buffer { vec4 directions[]; };
uniform uint count;
uniform uint last_wo;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    Surface s = surface_make(material_load(0u), normalize(vec2(0.8, 0.6)));
    vec4 ask = asks[i];
    vec3 wo = asks[count + min(i, last_wo)].xyz;
    float specular = 0.0;
    models_face(wo, INSIDE == 1, s);
#if SAMPLE
    LobeSample lobe = bsdf_sample(s, wo, ask.x, ask.yz);
    vec3 wi = lobe.wi;
    Scatter f = bsdf_eval(s, wo, wi);
    if (lobe.is_delta) {
        f = lobe.scatter;
        specular = 1.0;
    }
#else
    vec3 wi = ask.xyz;
    Scatter f = bsdf_eval(s, wo, wi);
#endif
    answers[i] = vec4(f.f, f.pdf);
    directions[i] = vec4(wi, specular);
}
