// Nearest hits of rays (origins, directions), and whether a ray leaving each hit towards `away` meets anything.
layout(local_size_x = 64) in;
#include "layout.glsl"
#include "math/constants.glsl"
#include "shapes/shapes.glsl"
layout(std430, binding = SLOT_SUM) readonly buffer origin_buffer { vec4 origins[]; };
layout(std430, binding = SLOT_COMPENSATION) readonly buffer direction_buffer { vec4 directions[]; };
layout(std430, binding = SLOT_MOMENTS) readonly buffer away_buffer { vec4 aways[]; };
layout(std430, binding = SLOT_OUTPUT) writeonly buffer hit_buffer { vec4 hits[]; };       // normal, t
layout(std430, binding = SLOT_ALBEDO) writeonly buffer place_buffer { vec4 places[]; };   // point, tangent's x
layout(std430, binding = SLOT_NORMAL) writeonly buffer leave_buffer { vec4 leaves[]; };   // again, shape, tangent's yz
uniform uint count;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    vec3 o = origins[i].xyz, d = directions[i].xyz;
    Hit hit = shapes_nearest(o, d, NONE);
    SurfacePoint at = shapes_point(hit, o, d);
    vec3 side = dot(at.ng, d) < 0.0 ? at.ng : -at.ng;
    vec3 w = aways[i].xyz;
    w = normalize(dot(w, side) < 0.0 ? -w : w);
    Hit again = shapes_nearest(shapes_leave(at, w), w, at.flat_id);
    bool met = hit.id != NONE;
    hits[i] = vec4(at.ng, met ? hit.t : -1.0);
    places[i] = vec4(at.p, at.tangent.x);
    leaves[i] = vec4(met && again.id != NONE ? 1.0 : 0.0, float(hit.id >> LEAF_KIND_SHIFT), at.tangent.yz);
}
