// What a textured emission is at a place, which is also its texture coordinates.
layout(local_size_x = 64) in;
#include "layout.glsl"
layout(std430, binding = SLOT_SUM) readonly buffer ask_buffer { vec4 asks[]; };
layout(std430, binding = SLOT_OUTPUT) writeonly buffer answer_buffer { vec4 answers[]; };
#include "math/constants.glsl"
#include "math/sobol.glsl"
#include "math/sampling.glsl"
#include "shapes/shapes.glsl"
#include "material/texture.glsl"
uniform uint count;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    SurfacePoint at = shapes_point(Hit(0.0, NONE, vec2(0.0)), vec3(0.0), vec3(0.0, 0.0, 1.0));
    at.p = asks[i].xyz;
    at.uv = asks[i].xy;
    answers[i] = vec4(texture_emission(at, footprint_none()), texture_opacity(at));
}
