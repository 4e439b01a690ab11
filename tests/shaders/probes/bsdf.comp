// Evaluates the BSDF of material 0 for wi = asks[i]; or samples it by asks[i] = (u_lobe, u, u), where `samples` is 1.
// Behind `count` of these stand the wo, one each or one for all; where `inside` is 1, they are inside the body.
// Perfectly specular samples have directions[i].w = 1.
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
uniform uint samples;
uniform uint inside;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    Surface s = surface_make(material_load(0u), normalize(vec2(0.8, 0.6)));
    vec4 ask = asks[i];
    vec3 wo = asks[count + min(i, last_wo)].xyz;
    float specular = 0.0;
    models_face(wo, inside == 1u, s);
    vec3 wi = ask.xyz;
    LobeSample lobe;
    lobe.is_delta = false;
    if (samples == 1u) {
        lobe = bsdf_sample(s, wo, ask.x, ask.yz);
        wi = lobe.wi;
    }
    Scatter f = bsdf_eval(s, wo, wi);
    if (lobe.is_delta) {
        f = lobe.scatter;
        specular = 1.0;
    }
    answers[i] = vec4(f.f, f.pdf);
    directions[i] = vec4(wi, specular);
}
