// What a textured ambient light is at texture coordinates, xy, over a footprint along u and v, zw.
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
    SurfacePoint at = shapes_none(vec3(0.0), vec3(0.0, 0.0, 1.0));
    at.uv = asks[i].xy;
    Footprint f = footprint_none();
    f.axes = vec4(asks[i].z, 0.0, 0.0, asks[i].w);
    answers[i] = vec4(texture_emission(at, f), 1.0);
}
