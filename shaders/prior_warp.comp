// Entry: a picture as another camera would see it, by the depth of its first hits: what lies at a pixel of the new picture
// is searched for in the old one. What the old camera did not see has alpha -1.
#include "layout_constants.glsl"
layout(local_size_x = WORK_GROUP, local_size_y = WORK_GROUP) in;
layout(std430, binding = SLOT_BEFORE) readonly buffer before_buffer { vec4 before[]; };
layout(std430, binding = SLOT_DEPTHS) readonly buffer depth_buffer { float depths[]; }; // along the ray; 0: nothing is hit
layout(std430, binding = SLOT_OUTPUT) writeonly buffer warped_buffer { vec4 warped[]; };
uniform uvec2 size;
// Of both cameras: the position, and the frame as columns right, down and forward; `pixels` to a tangent of 1.
uniform vec3 old_position, new_position;
uniform mat3 old_frame, new_frame;
uniform float old_pixels, new_pixels;

const int STEPS = 8;
const float FOUND = 0.6; // pixels by which the search may miss
const float NEAR = 0.05; // pixels at which it has nothing more to gain
const float ALIKE = 1.1; // the ratio of depths below which neighbours are taken for one surface

// The depth at a place of the old picture: between four pixels of one surface, else that of the nearest.
float prior_depth(vec2 at) {
    vec2 p = clamp(at - 0.5, vec2(0.0), vec2(size) - 1.0), f = fract(p);
    uvec2 low = uvec2(p), high = min(low + 1u, size - 1u);
    vec4 four = vec4(depths[low.y * size.x + low.x], depths[low.y * size.x + high.x],
                     depths[high.y * size.x + low.x], depths[high.y * size.x + high.x]);
    float least = min(min(four.x, four.y), min(four.z, four.w)), most = max(max(four.x, four.y), max(four.z, four.w));
    if (most < ALIKE * least) return mix(mix(four.x, four.y, f.x), mix(four.z, four.w, f.x), f.y);
    return f.y < 0.5 ? (f.x < 0.5 ? four.x : four.y) : (f.x < 0.5 ? four.z : four.w);
}

// Where the new camera sees what the old one sees at `at`; false where that is behind it.
bool prior_moved(vec2 at, out vec2 seen) {
    float depth = prior_depth(at);
    vec3 d = normalize(old_frame * vec3((at - 0.5 * vec2(size)) / old_pixels, 1.0));
    vec3 v = (depth > 0.0 ? old_position - new_position + depth * d : d) * new_frame; // v is transformed by the transpose
    seen = 0.5 * vec2(size) + new_pixels * v.xy / v.z;
    return v.z > 0.0;
}

vec4 prior_texel(vec2 at) {
    vec2 p = clamp(at - 0.5, vec2(0.0), vec2(size) - 1.0), f = fract(p);
    uvec2 low = uvec2(p), high = min(low + 1u, size - 1u);
    vec4 top = mix(before[low.y * size.x + low.x], before[low.y * size.x + high.x], f.x);
    return mix(top, mix(before[high.y * size.x + low.x], before[high.y * size.x + high.x], f.x), f.y);
}

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (pixel.x >= size.x || pixel.y >= size.y) return;
    vec2 wanted = vec2(pixel) + 0.5, at = wanted, seen;
    bool there = true, more = true;
    float off = 0.0;
    for (int i = 0; i <= STEPS && more; i++) {
        there = prior_moved(at, seen);
        off = distance(seen, wanted);
        more = there && off > NEAR && i < STEPS;
        if (more) at += wanted - seen;
    }
    there = there && off < FOUND;
    there = there && all(greaterThanEqual(at, vec2(0.0))) && all(lessThan(at, vec2(size)));
    warped[pixel.y * size.x + pixel.x] = there ? prior_texel(at) : vec4(0.0, 0.0, 0.0, -1.0);
}
