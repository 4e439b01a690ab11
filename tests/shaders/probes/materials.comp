// What kernels make of the numbers of material i: whether it transmits, twice more where light may go straight through it,
// whether it only mirrors or refracts, its index of refraction and its coat's roughness.
layout(local_size_x = 64) in;
#include "layout.glsl"
#include "math/constants.glsl"
#include "math/sobol.glsl"
#include "math/sampling.glsl"
#include "bsdf/bsdf.glsl"
layout(std430, binding = SLOT_OUTPUT) writeonly buffer answer_buffer { vec4 answers[]; };
uniform uint count;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    Material m = material_load(i);
    Surface s = surface_make(m, vec2(1.0, 0.0));
    answers[i] = vec4(float(material_transmits(m)) + 2.0 * float(material_goes_straight(m)), material_is_delta(m), s.eta_outside, s.coat_roughness);
}
