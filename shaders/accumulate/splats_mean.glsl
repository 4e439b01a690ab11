// What paths of light bring to a pixel in the mean, from the sums of `splats.glsl`. It is computed in double precision, as
// gpu/picture/light_paths.py does it in numpy: both have the same bits.
#if CAUSTICS
layout(std430, binding = SLOT_LIGHT_SUMS) readonly buffer light_sum_buffer { uvec4 light_sums[]; }; // two for each pixel
uniform double light_scale; // from a sum to the mean radiance

// The number of 64 bits whose lower word is x.
double splats_number(uvec2 words) { return double(int(words.y)) * 4294967296.0lf + double(words.x); }

vec3 splats_mean(uint slot) {
    uvec4 a = light_sums[2u * slot], b = light_sums[2u * slot + 1u];
    return vec3(dvec3(splats_number(a.xy), splats_number(a.zw), splats_number(b.xy)) * light_scale);
}
#endif
