// Entry: what a picture showed before an edit, corrected by what the edit changes. That change is known from two small
// pictures of few samples, before and after it, that followed the same random numbers: where the edit changes nothing
// they are equal, and elsewhere much of their noise is the same. It is added to the large picture; where it is as large
// as the picture itself, nothing of the old one is right, and the small new one takes its place; so it does where the
// old one says nothing (alpha -1).
#include "layout_constants.glsl"
layout(local_size_x = WORK_GROUP, local_size_y = WORK_GROUP) in;
layout(std430, binding = SLOT_BEFORE) readonly buffer before_buffer { vec4 before[]; }; // of the large picture
layout(std430, binding = SLOT_CHANGE) readonly buffer change_buffer { vec4 changes[]; }; // small; w: how much to replace
layout(std430, binding = SLOT_AFTER) readonly buffer after_buffer { vec4 after[]; };     // small
layout(std430, binding = SLOT_SUM) writeonly buffer sum_buffer { vec4 sums[]; };
layout(std430, binding = SLOT_MOMENTS) writeonly buffer moment_buffer { vec4 moments[]; };
uniform uvec2 size;       // of the large picture
uniform uvec2 small_size;
uniform float worth;      // the samples that a pixel counts for

// Four pixels of a small picture and their weights: bilinear filtering, with centres at whole numbers and a half.
void prior_around(uvec2 pixel, out uvec4 at, out vec4 weights) {
    vec2 p = (vec2(pixel) + 0.5) * vec2(small_size) / vec2(size) - 0.5;
    ivec2 most = ivec2(small_size) - 1;
    vec2 f = fract(p);
    ivec2 low = clamp(ivec2(floor(p)), ivec2(0), most), high = clamp(ivec2(floor(p)) + 1, ivec2(0), most);
    at = uvec4(ivec4(low.y, low.y, high.y, high.y) * int(small_size.x) + ivec4(low.x, high.x, low.x, high.x));
    weights = vec4((1.0 - f.x) * (1.0 - f.y), f.x * (1.0 - f.y), (1.0 - f.x) * f.y, f.x * f.y);
}

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (pixel.x >= size.x || pixel.y >= size.y) return;
    uint slot = pixel.y * size.x + pixel.x;
    uvec4 at;
    vec4 w, change = vec4(0.0), small = vec4(0.0);
    prior_around(pixel, at, w);
    for (int k = 0; k < 4; k++) {
        change += w[k] * changes[at[k]];
        small += w[k] * after[at[k]];
    }
    vec4 old = before[slot];
    vec4 corrected = mix(vec4(max(old.rgb + change.rgb, vec3(0.0)), old.a), small, old.a < 0.0 ? 1.0 : change.a);
    sums[slot] = worth * corrected;
    moments[slot] = vec4(0.0, 0.0, 0.0, worth);
}
