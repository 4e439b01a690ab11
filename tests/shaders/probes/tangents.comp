// The tangent at the first corner of triangle i, as its normals' record has it.
layout(local_size_x = 64) in;
#include "layout.glsl"
#include "math/constants.glsl"
#include "math/sobol.glsl"
#include "math/sampling.glsl"
#include "shapes/shapes.glsl"
layout(std430, binding = SLOT_OUTPUT) writeonly buffer answer_buffer { vec4 answers[]; };
uniform uint count;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    TriangleNormals n = triangle_normals_load(i);
    answers[i] = vec4(triangle_tangent(n.n0, n.bits, 0u), 0.0);
}
