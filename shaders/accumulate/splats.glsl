// Light that is added to any pixel, from whichever invocation found it. It is summed in integers of 64 bits, so that the
// order does not matter: a picture has the same bits however its work was cut.

#if CAUSTICS
// For each pixel the two words of four numbers, the low ones first: red, green, blue, and the luminance of the first samples of
// periods less that of the second ones, whose square says how far the two are apart.
layout(std430, binding = SLOT_SPLATS) buffer splat_buffer { uint splat_words[]; };

const float SPLAT_WORD = 4294967296.0;
const float SPLAT_MOST = 1.0e18; // of one splat, in units: 64 bits hold nine of them

void splats_add(uint i, float units, bool negative) {
    uint high = uint(units / SPLAT_WORD);
    uint low = uint(units - float(high) * SPLAT_WORD);
    if (negative) {
        high = ~high + (low == 0u ? 1u : 0u);
        low = ~low + 1u;
    }
    uint before = atomicAdd(splat_words[2u * i], low);
    uint carry = before + low < before ? 1u : 0u;
    if (high + carry != 0u) atomicAdd(splat_words[2u * i + 1u], high + carry);
}

void splats_add_pixel(ivec2 pixel, vec3 c, bool odd) {
    uint i = 4u * (uint(pixel.y) * uniforms.resolution.x + uint(pixel.x));
    // Each path of light stands for all of the light. The sums are those of a sample, which has one for each pixel.
    float scale = uniforms.moment_scale * SPLAT_UNITS / (float(uniforms.resolution.x) * float(uniforms.resolution.y));
    vec3 units = floor(min(c * scale, vec3(SPLAT_MOST)) + 0.5);
    for (uint k = 0u; k < 3u; k++) splats_add(i + k, units[k], false);
    splats_add(i + 3u, floor(dot(units, LUMINANCE)), odd);
}

// Adds light that passes the picture at the place `at`, in pixels, to all pixels whose filters reach there.
void splats_add_filtered(vec2 at, vec3 c, bool odd) {
    float radius = sampling_filter_radius();
    ivec2 low = ivec2(floor(at - radius - 0.5)), high = ivec2(ceil(at + radius - 0.5)), size = ivec2(uniforms.resolution);
    low.y = max(low.y, 0);
    high.y = min(high.y, size.y - 1);
    if (!camera_is_around()) {
        low.x = max(low.x, 0);
        high.x = min(high.x, size.x - 1);
    }
    for (int y = low.y; y <= high.y; y++) {
        float weight_y = sampling_filter_density(float(y) + 0.5 - at.y);
        for (int x = low.x; x <= high.x; x++) {
            float weight = weight_y * sampling_filter_density(float(x) + 0.5 - at.x);
            int column = (x % size.x + size.x) % size.x;
            if (weight > 0.0) splats_add_pixel(ivec2(column, y), weight * c, odd);
        }
    }
}

// The same where the picture goes on beyond its edges: over the poles of a panorama.
void splats_take(vec2 at, vec3 c, bool odd) {
    splats_add_filtered(at, c, odd);
    if (camera_is_around()) {
        vec2 size = vec2(uniforms.resolution);
        vec2 over = vec2(mod(at.x + 0.5 * size.x, size.x), -at.y);
        float radius = sampling_filter_radius();
        if (at.y < radius) splats_add_filtered(over, c, odd);
        over.y = 2.0 * size.y - at.y;
        if (size.y - at.y < radius) splats_add_filtered(over, c, odd);
    }
}
#endif
